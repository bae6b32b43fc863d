use depth_image::{Antialias, PinholeCamera, ToneMapping};
use glam::{UVec2, Vec3};

use super::*;
use crate::{FrameCodec, SampleSetId, StageTimes};

fn header(data: &[u8]) -> FrameHeader {
    FrameHeader {
        sample_set_id: SampleSetId { plan_epoch: 1, index: 0 },
        cell: 0,
        is_neighbour_cell: false,
        camera: PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8)),
        size_px: UVec2::splat(8),
        antialias: Antialias::NONE,
        tone: ToneMapping::NONE,
        codec: FrameCodec::Lz4,
        color_bytes: data.len() as u64,
        inverse_depth_bytes: 0,
        provenance_bytes: 0,
        crc32: crc32fast::hash(data),
        stage_times: StageTimes::default(),
    }
}

fn parts(len: usize) -> (Vec<u8>, Vec<FramePart>) {
    let data: Vec<u8> = (0..len).map(|i| (i * 31 % 251) as u8).collect();
    let parts = FramePart::cut(5, header(&data), data.clone().into()).collect();
    (data, parts)
}

fn push_all(parts: Vec<FramePart>) -> Result<Option<WholeFrame>, FrameAssemblyError> {
    let mut assembly = FrameAssembly::default();
    let mut last = None;
    for part in parts {
        last = assembly.push(part)?;
    }
    assembly.finish()?;
    Ok(last)
}

#[test]
fn frames_of_any_length_survive() {
    for len in [0, 1, MAX_CHUNK_BYTES, MAX_CHUNK_BYTES + 1, 3 * MAX_CHUNK_BYTES] {
        let (data, parts) = parts(len);
        let frame = push_all(parts).unwrap().expect("whole");
        assert_eq!((frame.frame, &frame.data[..]), (5, &data[..]));
    }
}

#[test]
fn streams_that_are_corrupt_or_out_of_order_are_refused() {
    let (_, good) = parts(3 * MAX_CHUNK_BYTES);
    let spoil = |change: &dyn Fn(&mut Vec<FramePart>)| {
        let mut parts = good.clone();
        change(&mut parts);
        push_all(parts).expect_err("spoilt").to_string()
    };
    assert!(spoil(&|p| p.swap(1, 2)).contains("offset_bytes"));
    assert!(spoil(&|p| p.insert(1, p[1].clone())).contains("offset_bytes"));
    assert!(spoil(&|p| p.insert(1, p[0].clone())).contains("cut off"));
    assert!(spoil(&|p| drop(p.pop())).contains("ends inside frame 5"));
    assert!(spoil(&|p| drop(p.remove(0))).contains("header"));
    assert!(spoil(&|p| p[1].data = Bytes::from(vec![0; MAX_CHUNK_BYTES])).contains("checksum"));
    assert!(spoil(&|p| p[2].data = Bytes::from(vec![0; MAX_CHUNK_BYTES + 1])).contains("at most"));
}
