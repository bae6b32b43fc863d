use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use codec::{FrameCodec, SampleSetId, StageTimes};
use depth_image::{Antialias, PinholeCamera, ToneMapping};

use super::*;

fn request(frame: u64) -> ViewRequest {
    let [eye, target, up] = [[0.0, 0.0, 1.0], [0.0; 3], [0.0, 1.0, 0.0]].map(Into::into);
    ViewRequest { frame, set_index: 0, camera: PinholeCamera::looking_at(eye, target, up, 1.0, [8, 8].into()) }
}

fn header(index: u64) -> FrameHeader {
    FrameHeader {
        sample_set_id: SampleSetId { plan_epoch: 1, index },
        cell: 0,
        is_neighbour_cell: false,
        camera: request(0).camera,
        size_px: [8, 8].into(),
        antialias: Antialias::NONE,
        tone: ToneMapping::NONE,
        codec: FrameCodec::Lz4,
        color_bytes: 1,
        inverse_depth_bytes: 0,
        provenance_bytes: 0,
        crc32: 0,
        stage_times: StageTimes::default(),
    }
}

fn window(requests: impl IntoIterator<Item = ViewRequest, IntoIter: Send + 'static>) -> Result<Window, ClientError> {
    Window::open(requests.into_iter(), 1000, ViewPlanes::default())
}

#[test]
fn a_frame_is_accepted_once_and_from_its_own_set() {
    let mut window = window([request(4), request(7)]).unwrap();
    assert_eq!(window.fault_of(4, &header(0)), None);
    assert_eq!((window.decoded_bytes(4), window.decoded_bytes(5)), (64 * 3, 0));
    assert_eq!((window.take(4), window.received), (Some(request(4)), 1));
    let mut elsewhere = header(0);
    elsewhere.camera.eye_in_world.x += 0.1;
    for (frame, header, reason) in [
        (4, header(0), "has been received"),
        (5, header(0), "not requested"),
        (7, header(1), "sample set"),
        (7, elsewhere, "another pose"),
    ] {
        assert!(window.fault_of(frame, &header).unwrap().contains(reason));
    }
    assert_eq!((window.take(4), window.due(), window.is_complete()), (None, vec![request(7)], false));
    assert!(window.finish().unwrap_err().to_string().contains("1 frames are missing: [7]"));
    window.take(7).unwrap();
    assert!(window.is_complete());
    window.finish().unwrap();
}

#[test]
fn numbers_that_do_not_rise_are_refused() {
    for [first, second] in [[4, 4], [5, 4]] {
        let refused = window([request(first), request(second)]).unwrap_err();
        assert!(matches!(refused, ClientError::Invalid { field: "frame", .. }), "{refused}");
    }
    let beyond = window([ViewRequest { set_index: 1000, ..request(4) }]).unwrap_err();
    assert!(matches!(beyond, ClientError::Invalid { field: "set_index", .. }), "{beyond}");
}

#[test]
fn requests_before_one_that_cannot_be_met_are_met() {
    let mut window = window((0..20_000).map(request).chain([request(3)])).unwrap();
    let mut drawn = window.due().len();
    while let run @ 1.. = window.draw().len() {
        drawn += run;
    }
    assert_eq!((drawn, window.is_complete()), (20_000, false));
    (0..20_000).for_each(|frame| _ = window.take(frame).unwrap());
    assert!(window.is_complete(), "nothing more is to be received");
    assert!(window.finish().unwrap_err().to_string().contains("3 follows 19999"));
}

#[test]
fn a_source_is_drawn_no_further_than_its_window() {
    let drawn = Arc::new(AtomicUsize::new(0));
    let counted = drawn.clone();
    let endless = (0..).map(move |frame| {
        counted.fetch_add(1, Ordering::Relaxed);
        ViewRequest { set_index: (frame / 10 % 1000) as u32, ..request(frame) }
    });
    let mut window = window(endless).unwrap();
    let lead = drawn.load(Ordering::Relaxed);
    assert!((LEAST_AHEAD_VIEWS..LEAST_AHEAD_VIEWS + 12).contains(&lead), "{lead}");
    for frame in 0..100_000 {
        if window.due.len() < LEAST_AHEAD_VIEWS {
            assert_eq!(window.draw().len(), 10, "a set");
        }
        window.take(frame).unwrap();
    }
    assert!(drawn.load(Ordering::Relaxed) - 100_000 <= LEAST_AHEAD_VIEWS + 11);
}

#[test]
fn a_large_set_is_drawn_in_parts() {
    let mut window = window((0..10_000).map(request)).unwrap();
    assert_eq!(window.due().len(), MAX_RUN_VIEWS);
    assert_eq!([window.draw().len(), window.draw().len(), window.draw().len()], [MAX_RUN_VIEWS, 1808, 0]);
}
