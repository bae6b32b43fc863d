//! Frames of one call to a compositor: received whole, then decoded.

use std::time::Duration;

use codec::{DecodeLimits, FrameAssembly, FrameAssemblyError, FrameHeader, FramePart, WholeFrame, decode_view};
use depth_image::View;
use tokio_stream::StreamExt as _;
use wire::rpc::Messages;

use crate::error::ClientError;
use crate::peer::{Failure, Peer};

/// The time that a compositor may be silent while frames are due: samplers on slow devices take minutes.
const SILENCE: Duration = Duration::from_secs(600);

/// The frames of one call, before they are decoded.
pub(crate) struct FrameStream {
    parts: Messages<FramePart>,
    assembly: FrameAssembly,
}

impl FrameStream {
    pub(crate) fn new(parts: Messages<FramePart>) -> Self {
        Self { parts, assembly: FrameAssembly::default() }
    }

    /// The next whole frame of `peer`; `None` at the stream's end. Can be dropped and called again without losing a frame.
    pub(crate) async fn next(&mut self, peer: &Peer) -> Result<Option<WholeFrame>, Failure> {
        let corrupt = |error: FrameAssemblyError| Failure::of_peer(peer, peer.error(error));
        while let Some(part) = self.next_part(peer).await? {
            if let Some(frame) = self.assembly.push(part).map_err(corrupt)? {
                return Ok(Some(frame));
            }
        }
        self.assembly.finish().map_err(corrupt)?;
        Ok(None)
    }

    async fn next_part(&mut self, peer: &Peer) -> Result<Option<FramePart>, Failure> {
        match tokio::time::timeout(SILENCE, self.parts.next()).await {
            Ok(part) => part.transpose().map_err(|status| Failure::of_status(peer, &status)),
            Err(_) => {
                let reason = format!("no frame was received for {} s", SILENCE.as_secs());
                Err(Failure::of_peer(peer, peer.error(reason)))
            }
        }
    }
}

/// Decodes a frame of `peer` on a blocking thread.
pub(crate) async fn decode(frame: WholeFrame, peer: &Peer) -> Result<(FrameHeader, View), ClientError> {
    let decoding = move || decode_view(&frame, &DecodeLimits::default()).map(|view| (frame.header, view));
    match tokio::task::spawn_blocking(decoding).await {
        Ok(decoded) => decoded.map_err(|error| peer.error(error)),
        Err(error) => Err(peer.error(error)),
    }
}
