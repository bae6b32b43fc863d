//! One of a visitor's two streams: poses that were asked for, pictures that were sent and not shown yet.

use std::collections::VecDeque;
use std::time::Instant;

use bytes::Bytes;
use client::{ClientError, ClientId, EncodedFrame, EncodedLiveView, PictureQuality, Session};
use codec::FrameCodec;
use depth_image::{Antialias, PinholeCamera};

use crate::protocol::{self, PictureHeader, PictureTimes, Pose};
use crate::rate::Rung;
use crate::still::PictureLight;

/// Poses that are remembered: a client replaces those that were not sent.
const MAX_ASKED: usize = 512;

/// A pose that was asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) pose: Pose,
    pub(crate) light: PictureLight,
    /// The rung that was chosen for it; `None` for a still.
    chosen: Option<Rung>,
    /// The live stream's own number.
    frame: u64,
    arrived: Instant,
    /// Poses that it replaced.
    replaced: u64,
}

/// A picture of a pose to ask for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    pub(crate) set_index: u32,
    pub(crate) samples: Antialias,
    pub(crate) light: PictureLight,
}

/// A picture that was sent and not shown yet.
#[derive(Debug, Clone, Copy)]
struct Sent {
    number: u64,
    frame: u64,
    /// `None` for a picture whose age says nothing of the link: a still, one that was discarded, or one that repeats a pose.
    chosen: Option<Rung>,
}

/// What the page is told of a picture, beside its frame's own header.
#[derive(Debug, Clone, Copy)]
pub(crate) struct About {
    /// From 1.
    pub(crate) light_step: u32,
    /// Whether its view cell is made for its place.
    pub(crate) is_own_cell: bool,
    pub(crate) is_direct: bool,
    /// Whether a better picture of the pose follows.
    pub(crate) more: bool,
    /// The least round trip to the page so far.
    pub(crate) rtt_s: Option<f64>,
}

pub(crate) struct PictureStream {
    view: EncodedLiveView,
    /// The number of the last picture.
    last: u64,
    asked: VecDeque<Asked>,
    sent: VecDeque<Sent>,
}

impl PictureStream {
    /// A stream of this client.
    pub(crate) fn new(session: &Session, client: ClientId) -> Self {
        Self { view: session.live_encoded(client), last: 0, asked: VecDeque::new(), sent: VecDeque::new() }
    }

    /// Asks for a picture of a pose; `chosen` is its rung in motion.
    pub(crate) fn ask(
        &mut self,
        pose: Pose,
        camera: PinholeCamera,
        quality: PictureQuality,
        wanted: Wanted,
        chosen: Option<Rung>,
    ) -> Result<(), ClientError> {
        let frame = self.view.set_pose(camera, wanted.set_index, quality)?;
        if self.asked.len() >= MAX_ASKED {
            self.asked.pop_front();
        }
        self.asked.push_back(Asked { pose, light: wanted.light, chosen, frame, arrived: Instant::now(), replaced: 0 });
        Ok(())
    }

    /// Whether the last picture that was asked for is to be drawn directly.
    pub(crate) fn draws(&self) -> bool {
        self.asked.back().is_some_and(|asked| asked.light == PictureLight::Drawn)
    }

    /// The next picture, and the pose that it answers. Cancellation loses none.
    pub(crate) async fn next(&mut self) -> Result<(EncodedFrame, Option<Asked>), ClientError> {
        let frame = self.view.next().await?;
        let at = self.asked.iter().position(|asked| asked.frame == frame.request.frame);
        let asked = at.and_then(|at| {
            let asked = self.asked.drain(..=at).next_back()?;
            Some(Asked { replaced: at as u64, ..asked })
        });
        Ok((frame, asked))
    }

    /// A picture is not sent. Its credit is given back, after those of pictures that were sent before it.
    pub(crate) fn discard(&mut self, frame: &EncodedFrame) {
        match self.sent.back().copied() {
            Some(last) => self.sent.push_back(Sent { frame: frame.request.frame, chosen: None, ..last }),
            None => self.view.confirm(frame.request.frame),
        }
    }

    /// The rung of a picture that was sent and not shown yet.
    pub(crate) fn chosen_for(&self, number: u64) -> Option<Rung> {
        self.sent.iter().find(|sent| sent.number == number)?.chosen
    }

    /// All pictures up to this number have been shown, or never will be.
    pub(crate) fn shown(&mut self, number: u64) {
        while let Some(sent) = self.sent.front().copied().filter(|sent| sent.number <= number) {
            self.view.confirm(sent.frame);
            self.sent.pop_front();
        }
    }

    /// The message of a picture, which is sent now.
    pub(crate) fn message(&mut self, frame: &EncodedFrame, asked: &Asked, about: About) -> Bytes {
        let number = asked.pose.number;
        let chosen = asked.chosen.filter(|_| number > self.last);
        self.last = number;
        self.sent.push_back(Sent { number, frame: frame.request.frame, chosen });
        let header = &frame.header;
        let (media_type, jpeg_quality) = match header.codec {
            FrameCodec::Png => ("image/png", None),
            FrameCodec::Jpeg { quality } => ("image/jpeg", Some(quality)),
            FrameCodec::Lz4 => ("application/octet-stream", None),
        };
        let picture = PictureHeader {
            number,
            still: asked.pose.still,
            media_type,
            jpeg_quality,
            rtt_ms: about.rtt_s.map(|rtt_s| rtt_s * 1000.0),
            size_px: header.size_px.to_array(),
            bytes: header.color_bytes as usize,
            camera: asked.pose.camera,
            set: header.sample_set_id.to_string(),
            cell: header.cell,
            light_step: about.light_step,
            samples: header.antialias.samples(),
            neighbour: !about.is_own_cell,
            quality: match asked.light {
                PictureLight::Shared(quality) if !about.is_direct => Some(quality.name()),
                _ => None,
            },
            direct: about.is_direct,
            more: about.more,
            compositor: frame.node_name.clone(),
            replaced: asked.replaced,
            times_ms: times(frame, asked.arrived, Instant::now()),
        };
        protocol::picture(&picture, &frame.data[..header.color_bytes as usize])
    }
}

fn ms(seconds: f64) -> f64 {
    seconds * 1000.0
}

/// The parts of a picture's time between its pose's arrival and its departure, which add up.
fn times(frame: &EncodedFrame, arrived: Instant, leaves: Instant) -> PictureTimes {
    let at = &frame.header.stage_times;
    let [to_send, forward, gateway] = [(arrived, frame.sent), (frame.received, leaves), (arrived, leaves)]
        .map(|(from, to)| ms(to.saturating_duration_since(from).as_secs_f64()));
    let stages_s = at.set_wait_s + at.credit_wait_s + at.queue_s + at.batch_s + at.encode_s + at.send_wait_s;
    PictureTimes {
        gateway,
        to_send,
        // What no stage of the compositor accounts for.
        cluster_network: gateway - to_send - forward - ms(stages_s),
        set: ms(at.set_wait_s),
        credit: ms(at.credit_wait_s),
        queue: ms(at.queue_s),
        reconstruct: ms(at.batch_s),
        encode: ms(at.encode_s),
        send: ms(at.send_wait_s),
        forward,
    }
}
