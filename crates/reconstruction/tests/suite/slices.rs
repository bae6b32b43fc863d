//! A shared device: views are cut into slices, of the same bytes, and live views go between those of a batch.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use depth_image::{PinholeCamera, View, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use gpu::{CompiledOutside, DevicePreference, Gpu, Turn, WorkClass};
use reconstruction::{ReconstructRequest, ReconstructionMethod, Reconstructor, SampleSet};

use crate::stage::{CARVE, Corners, Stage};

const METHODS: [&str; 6] =
    ["joint_carve", "joint_carve:2", "light_field_search:64", "mesh", "hybrid_mesh", "hybrid_mesh:0.5"];
/// Rows of a piece are whole tiles: eight.
const FEW_PX: u64 = 1;

/// A device of its own, whose slices no other test counts.
struct Shared {
    gpu: Arc<Gpu>,
    reconstructor: Reconstructor,
}

impl Shared {
    fn new() -> Self {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        Self { reconstructor: Reconstructor::new(&gpu).expect("a reconstructor"), gpu }
    }

    fn upload(&self, stage: &Stage) -> SampleSet {
        self.reconstructor.upload(&stage.images, &stage.description(), Turn::default()).expect("a set")
    }

    /// Views, and the slices that they took.
    fn views(&self, set: &SampleSet, cameras: &[PinholeCamera], method: &str) -> (Vec<View>, u64) {
        let before = self.gpu.device_queue.slices();
        let method: ReconstructionMethod = method.parse().expect(method);
        let views = self
            .reconstructor
            .reconstruct(ReconstructRequest {
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(set, cameras, method)
            })
            .expect("views");
        (views, self.gpu.device_queue.slices() - before)
    }
}

fn corners() -> Corners {
    Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 }
}

fn cameras(size_px: UVec2) -> Vec<PinholeCamera> {
    [(0.1, 0.2), (-0.7, 0.4), (0.9, -0.8)].map(|(x, y)| corners().camera(x, y, size_px)).to_vec()
}

#[test]
fn a_view_in_slices_is_the_whole_view_with_every_method() {
    let shared = Shared::new();
    let samples = corners().samples(2);
    let whole_sets = Stage::with_corners(uv_sphere(1.0, 24), &samples);
    let with_holes = Stage::apart(uv_sphere(1.0, 24), &samples);
    // 61 rows are seven pieces and a part.
    let cameras = cameras(UVec2::new(67, 61));
    for (what, stage) in [("whole images", whole_sets), ("images with holes", with_holes)] {
        let set = shared.upload(&stage);
        for method in METHODS {
            shared.views(&set, &cameras, method);
            let (whole, one) = shared.views(&set, &cameras, method);
            assert_eq!(one, 1, "{method}: nobody watches");
            let live = shared.gpu.device_queue.force_slices(FEW_PX);
            let (cut, many) = shared.views(&set, &cameras, method);
            assert!(many > 3 * 8, "{method}: {many} slices");
            assert!(cut == whole, "{method}, {what}: bytes differ in slices");
            // The set and its mesh are made in slices, too.
            assert!(shared.views(&shared.upload(&stage), &cameras, method).0 == whole, "{method}, {what}");
            drop(live);
        }
    }
}

#[test]
fn a_live_view_goes_between_the_slices_of_a_batch() {
    let shared = Shared::new();
    let set = shared.upload(&Stage::new(uv_sphere(1.0, 24), &corners().samples(2)));
    let many = cameras(UVec2::new(320, 240));
    let one = cameras(UVec2::new(64, 48));
    let live = Turn { class: WorkClass::Live, flow: 1 };
    let view = || {
        shared
            .reconstructor
            .reconstruct(ReconstructRequest {
                turn: live,
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(&set, &one[..1], CARVE)
            })
            .expect("a view")
    };
    let alone = view();
    let _live = shared.gpu.device_queue.force_slices(FEW_PX);
    let batch_ended = AtomicBool::new(false);
    thread::scope(|threads| {
        let before = shared.gpu.device_queue.slices();
        threads.spawn(|| {
            let batch = Turn { class: WorkClass::Batch, flow: 2 };
            let views = shared.reconstructor.reconstruct(ReconstructRequest {
                turn: batch,
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(&set, &many, CARVE)
            });
            batch_ended.store(true, Ordering::Release);
            assert_eq!(views.expect("views").len(), many.len());
        });
        while shared.gpu.device_queue.slices() < before + 3 {
            thread::yield_now();
        }
        for _ in 0..3 {
            assert!(view() == alone);
            assert!(!batch_ended.load(Ordering::Acquire), "the live view waited for all of the batch");
        }
    });
    assert!(batch_ended.load(Ordering::Acquire));
}

#[test]
fn shaders_are_compiled_outside_the_queue_beside_a_live_stream() {
    let shared = Shared::new();
    let set = shared.upload(&Stage::with_corners(uv_sphere(1.0, 24), &corners().samples(2)));
    let _live = shared.gpu.device_queue.live_stream();
    for method in METHODS {
        shared.views(&set, &cameras(UVec2::new(67, 61)), method);
        assert_eq!(shared.gpu.compiled_outside().failed, 0, "{method}");
    }
    let CompiledOutside { compiled, .. } = shared.gpu.compiled_outside();
    assert!(compiled > METHODS.len() as u64, "{compiled}");
}
