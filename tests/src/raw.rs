//! Input that no regular client sends: any bytes as a message, and HTTP/2 by hand.

use bytes::{Buf, BufMut, Bytes};
use tonic::client::Grpc;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::{Request, Status};
use wire::rpc::connect;

/// Messages as bytes.
#[derive(Debug, Clone, Copy, Default)]
struct Raw;

impl Codec for Raw {
    type Encode = Bytes;
    type Decode = Bytes;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, message: Bytes, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put(message);
        Ok(())
    }
}

impl Decoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Bytes>, Status> {
        let count = buffer.remaining();
        Ok(Some(buffer.copy_to_bytes(count)))
    }
}

/// Calls `path` with a message of any bytes; its first answer.
///
/// # Errors
/// The server's error.
pub async fn call(address: &str, path: &'static str, message: Bytes) -> Result<Bytes, Status> {
    let mut client = Grpc::new(connect(address).await?);
    client.ready().await.map_err(|error| Status::unavailable(error.to_string()))?;
    let path = PathAndQuery::from_static(path);
    let mut answers = client.server_streaming(Request::new(message), path, Raw).await?.into_inner();
    answers.message().await?.ok_or_else(|| Status::not_found("no answer"))
}

/// A message's field of text, as in a request that is written by hand.
#[must_use]
pub fn text_field(number: u8, text: &str) -> Vec<u8> {
    let head = [number << 3 | 2, u8::try_from(text.len()).expect("a short text")];
    [&head[..], text.as_bytes()].concat()
}

/// A whole number below 128.
#[must_use]
pub fn number_field(number: u32, value: u8) -> Vec<u8> {
    let tag = number << 3;
    if tag < 128 { vec![tag as u8, value] } else { vec![tag as u8 | 128, (tag >> 7) as u8, value] }
}

/// The beginning of a connection: preface and empty settings.
#[must_use]
pub fn http2_start() -> Vec<u8> {
    [b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(), frame(4, 0, 0, &[])].concat()
}

/// A frame of HTTP/2.
#[must_use]
pub fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let mut bytes = (payload.len() as u32).to_be_bytes()[1..].to_vec();
    bytes.extend([kind, flags]);
    bytes.extend(stream.to_be_bytes());
    bytes.extend(payload);
    bytes
}

/// The headers of a call, each a literal.
#[must_use]
pub fn call_headers(path: &str) -> Vec<u8> {
    let headers = [
        (":method", "POST"),
        (":scheme", "http"),
        (":path", path),
        (":authority", "here"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ];
    let mut block = Vec::new();
    for (name, value) in headers {
        block.push(0);
        for text in [name, value] {
            block.push(u8::try_from(text.len()).expect("a short text"));
            block.extend(text.as_bytes());
        }
    }
    const END_HEADERS: u8 = 4;
    frame(1, END_HEADERS, 1, &block)
}

/// A message's head with a stated length.
#[must_use]
pub fn message_head(bytes: u32) -> Vec<u8> {
    [&[0][..], &bytes.to_be_bytes()].concat()
}
