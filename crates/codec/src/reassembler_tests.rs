//! Chunks that come as they should, and in every other way.

use super::*;
use crate::{InverseDepthRange, PlaneHeader, PlaneKind, split_into_chunks, test_support::Random};

const SET: SampleSetId = SampleSetId { plan_epoch: 3, index: 14 };
const LATER: SampleSetId = SampleSetId { plan_epoch: 4, index: 0 };

/// The payload is not an image: the reassembler does not look into it.
fn image(payload_bytes: usize) -> EncodedImage {
    let depth_bytes = payload_bytes / 3;
    let plane = |kind: PlaneKind, packed_bytes: usize| PlaneHeader {
        kind,
        encoding: kind.encoding(),
        raw_bytes: 10,
        packed_bytes: packed_bytes as u32,
    };
    let header = ImageHeader {
        width: 2048,
        height: 2048,
        inverse_depth_range: InverseDepthRange { least_per_m: 0.1, greatest_per_m: 1.0 },
        layered: None,
        planes: vec![
            plane(PlaneKind::InverseDepth, depth_bytes),
            plane(PlaneKind::ColorRgb9e5, payload_bytes - depth_bytes),
        ],
    };
    let mut random = Random::new(payload_bytes as u64);
    EncodedImage { header, payload: (0..payload_bytes).map(|_| random.next_u32() as u8).collect() }
}

fn chunks(payload_bytes: usize) -> Vec<Chunk> {
    split_into_chunks(SET, 2, image(payload_bytes)).collect()
}

fn reassembler() -> Reassembler {
    Reassembler::new(DecodeLimits::default(), SET)
}

fn push_all(reassembler: &mut Reassembler, chunks: Vec<Chunk>) -> Option<Reassembled> {
    chunks.into_iter().fold(None, |_, chunk| reassembler.push(chunk).expect("in order"))
}

#[test]
fn chunks_in_order_give_the_image() {
    let mut reassembler = reassembler();
    for payload_bytes in [0, 1, MAX_CHUNK_BYTES, MAX_CHUNK_BYTES + 1, 3 * MAX_CHUNK_BYTES - 5] {
        let chunks = chunks(payload_bytes);
        assert_eq!(chunks.len(), 1 + payload_bytes.div_ceil(MAX_CHUNK_BYTES));
        let done = push_all(&mut reassembler, chunks).expect("complete");
        assert_eq!(done, Reassembled { sample_set_id: SET, image_index: 2, image: image(payload_bytes) });
    }
}

#[test]
fn a_missing_chunk_is_refused_and_the_next_image_survives() {
    let mut reassembler = reassembler();
    let chunks = chunks(3 * MAX_CHUNK_BYTES);
    assert_eq!(reassembler.push(chunks[0].clone()), Ok(None));
    let missing = ChunkError::Missing { sample_set_id: SET, image_index: 2, got: 2, expected: 1 };
    assert_eq!(reassembler.push(chunks[2].clone()), Err(missing));
    assert_eq!(reassembler.push(chunks[1].clone()), Err(ChunkError::NoHeader { image_index: 2, got: 1 }));
    assert!(push_all(&mut reassembler, chunks).is_some());
}

#[test]
fn duplicates_are_refused_and_do_no_harm() {
    let mut reassembler = reassembler();
    let chunks = chunks(2 * MAX_CHUNK_BYTES);
    for chunk in &chunks[..2] {
        assert_eq!(reassembler.push(chunk.clone()), Ok(None));
        let again = reassembler.push(chunk.clone());
        assert_eq!(again, Err(ChunkError::Duplicate { got: chunk.sequence, expected: chunk.sequence + 1 }));
    }
    assert!(reassembler.push(chunks[2].clone()).expect("in order").is_some());
}

#[test]
fn stale_sets_are_refused_and_later_ones_take_over() {
    let mut reassembler = reassembler();
    let old = chunks(2 * MAX_CHUNK_BYTES);
    let new: Vec<_> = split_into_chunks(LATER, 0, image(10)).collect();
    assert_eq!(reassembler.push(old[0].clone()), Ok(None));
    assert!(push_all(&mut reassembler, new).is_some());
    let mut later = Reassembler::new(DecodeLimits::default(), LATER);
    assert_eq!(later.push(old[0].clone()), Err(ChunkError::StaleSet { got: SET, oldest: LATER }));
}

#[test]
fn another_image_of_the_set_may_not_cut_in() {
    let mut reassembler = reassembler();
    assert_eq!(reassembler.push(chunks(5)[0].clone()), Ok(None));
    let other = split_into_chunks(SET, 3, image(5)).next().expect("header");
    assert!(matches!(reassembler.push(other), Err(ChunkError::Missing { expected: 1, got: 0, .. })));
}

#[test]
fn chunks_with_flipped_bits_are_refused() {
    let mut random = Random::new(13);
    let good = chunks(MAX_CHUNK_BYTES + 100);
    for _ in 0..200 {
        let mut chunk = good[2].clone();
        let ChunkBody::Data(data) = &chunk.body else { panic!("data") };
        let mut data = data.to_vec();
        let at = random.below(data.len());
        data[at] ^= 1 << random.below(8);
        chunk.body = ChunkBody::Data(data.into());
        let mut reassembler = reassembler();
        assert_eq!(push_all(&mut reassembler, good[..2].to_vec()), None);
        assert_eq!(reassembler.push(chunk), Err(ChunkError::Checksum { sequence: 2 }));
    }
    let mut header = good[0].clone();
    let ChunkBody::Header(fields) = &mut header.body else { panic!("header") };
    fields.width += 1;
    assert_eq!(reassembler().push(header), Err(ChunkError::Checksum { sequence: 0 }));
}

#[test]
fn sizes_over_the_limit_are_refused_before_they_are_allocated() {
    let mut huge = image(10);
    huge.header.planes[1].packed_bytes = u32::MAX;
    let header = ChunkBody::Header(huge.header);
    let chunk =
        Chunk { sample_set_id: SET, image_index: 0, sequence: 0, chunk_count: 2, crc32: header.crc32(), body: header };
    let error = reassembler().push(chunk).expect_err("4 GiB");
    assert!(matches!(error, ChunkError::Header(DecodeError::Limit { field: "payload_bytes", .. })));
}

#[test]
fn counts_and_lengths_must_agree_with_the_header() {
    let good = chunks(MAX_CHUNK_BYTES + 100);
    let refuse = |before: usize, chunk: Chunk, field| {
        let mut reassembler = reassembler();
        assert_eq!(push_all(&mut reassembler, good[..before].to_vec()), None);
        assert_eq!(reassembler.push(chunk.clone()), Err(ChunkError::Malformed { sequence: chunk.sequence, field }));
    };
    refuse(0, Chunk { chunk_count: 4, ..good[0].clone() }, "chunk_count");
    refuse(1, Chunk { chunk_count: 4, ..good[1].clone() }, "chunk_count");
    let short = ChunkBody::Data(Bytes::from_static(&[1, 2, 3]));
    refuse(1, Chunk { crc32: short.crc32(), body: short.clone(), ..good[1].clone() }, "data length");
    refuse(2, Chunk { crc32: short.crc32(), body: short.clone(), ..good[2].clone() }, "data length");
    refuse(0, Chunk { crc32: short.crc32(), body: short, ..good[0].clone() }, "body");
    assert!(matches!(reassembler().push(good[1].clone()), Err(ChunkError::NoHeader { got: 1, .. })));
}

#[test]
fn sets_order_by_plan_then_index() {
    assert!(SET < LATER && SampleSetId { index: 15, ..SET } > SET);
    assert_eq!(SET.to_string(), "3.14");
}
