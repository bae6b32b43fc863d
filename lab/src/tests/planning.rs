//! Measurements for budgets on the device.

use std::sync::Arc;

use app_core::setup::{SceneArgs, Setup};
use cluster::{BudgetMeasurement, DIRECT, MeasureCosts, Workload};
use depth_image::{PinholeCamera, ViewCell, ViewPart, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec2};
use gpu::DevicePreference;
use node::{
    DirectWork, Engine as _, MadeView, SampleSet, SampleWork, Turn, ViewAudit, ViewProbes as _, ViewWork, WorkClass,
};
use planner::{Budget, ViewErrors};
use probe::{Probers, view_errors};
use sampling::SamplingMethod;

const LIGHTING: &str = "soft 4, occlusion 4";

/// A scene on the device.
struct Stand {
    engine: Arc<GpuEngine>,
    setup: Setup,
    cell: ViewCell,
}

impl Stand {
    fn new(scene: &str) -> Self {
        let engine = GpuEngine::shared(DevicePreference::Software).unwrap();
        let setup = SceneArgs::new(fixtures::spec(scene).unwrap()).load().unwrap();
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene).unwrap();
        let cell = ViewCell::between(&setup.around).unwrap();
        Self { engine, setup, cell }
    }

    fn workload(&self, cameras: usize, lighting: &str) -> Workload {
        let cameras = self.cell.nested_cameras(cameras, UVec2::new(96, 72));
        self.setup.workload(SamplingMethod::default(), lighting.parse().unwrap(), &cameras)
    }

    fn views(&self, size_px: UVec2) -> Vec<PinholeCamera> {
        [(0.1, -0.3), (-0.7, 0.5), (0.9, 0.8)].map(|(x, y)| self.cell.camera_at(Vec2::new(x, y), size_px)).to_vec()
    }

    fn request(&self, method: &str, workload: Workload) -> MeasureCosts {
        MeasureCosts {
            workload,
            method: method.to_owned(),
            codec: "lz4".to_owned(),
            typical_views: self.views(UVec2::new(64, 48)),
            batch_count: 1,
            planes: ViewPlanes::COLOR,
            in_background: true,
            budget: None,
        }
    }
}

#[test]
fn errors_fall_with_samples_and_rays_and_the_truth_has_none() {
    let stand = Stand::new("blocks");
    let probers = Probers::new(stand.engine.clone());
    let budget = BudgetMeasurement { truth_lighting: LIGHTING.to_owned() };
    let flip: Budget = "flip 1".parse().unwrap();
    let error = |method: &str, cameras: usize, lighting: &str| {
        let measured = probers.probe(&stand.request(method, stand.workload(cameras, lighting)), &budget).unwrap();
        assert!(measured.validate().is_ok() && measured.views.len() == 3 && measured.busy_s > 0.0);
        assert!(measured.costs.reconstruct_view_s > 0.0);
        assert_eq!(measured.costs.sample_image_s > 0.0, method != DIRECT, "{method}");
        ViewErrors::mean_error(&measured.views, &flip)
    };
    assert_eq!(error(DIRECT, 1, LIGHTING), 0.0);
    let one_ray = error(DIRECT, 1, "soft 1, occlusion 1");
    let carved = error("joint_carve", 1, LIGHTING);
    let fast = error("light_cache:fast", 4, LIGHTING);
    let fine = error("light_cache:fine", 4, LIGHTING);
    println!("one ray {one_ray}, joint_carve {carved}, fast {fast}, fine {fine}");
    assert!(one_ray > 0.005 && fine > 0.0 && fine < fast && fast < carved, "{one_ray} {carved} {fast} {fine}");
}

#[test]
fn a_method_that_the_device_refuses_is_refused_by_name() {
    let stand = Stand::new("blocks");
    let budget = BudgetMeasurement { truth_lighting: LIGHTING.to_owned() };
    let request = stand.request("guess", stand.workload(1, LIGHTING));
    let refused = Probers::new(stand.engine.clone()).probe(&request, &budget).unwrap_err();
    assert!(refused.message().contains("guess"), "{refused}");
}

/// A part of a large view is drawn and made alone, with what is around it: its errors are those of the same pixels of the whole.
#[test]
fn an_audited_part_has_the_errors_of_its_pixels_in_the_whole_view() {
    let stand = Stand::new("blocks");
    let engine = &stand.engine;
    let turn = Turn::of(WorkClass::Batch);
    let method = "joint_carve".to_owned();
    let workload = stand.workload(4, "phong");
    let workload = Workload { planes: engine.sample_planes(&method).unwrap(), ..workload };
    let images = engine.sample(&SampleWork::of(&workload), turn).unwrap();
    let set = engine.upload(&SampleSet::of(&workload, images, false).unwrap(), turn).unwrap();
    let camera = stand.views(UVec2::new(400, 300))[2];
    let view = ViewWork { cameras: vec![camera], method, planes: ViewPlanes::COLOR };
    let truth = DirectWork::of(&workload, vec![camera], ViewPlanes::WITH_DEPTH);
    let made = engine.reconstruct(set.as_ref(), &view, turn).unwrap().remove(0);
    let drawn = engine.draw_direct(&truth, turn).unwrap().remove(0);
    let whole = ViewPart::whole(camera.size_px);
    for pixel in [UVec2::new(200, 150), UVec2::new(399, 200)] {
        let part = ViewPart::square_of(pixel, 128, camera.size_px);
        let mask: Vec<bool> = part.mask_within(&whole).collect();
        let expected = view_errors(&camera, &drawn, &made, Some(&mask)).unwrap();
        let audit = |made: MadeView| {
            let audit = ViewAudit { made, camera, part, truth: truth.clone() };
            Probers::new(engine.clone()).audit(audit).unwrap().0
        };
        let errors = audit(MadeView::FromSet { set: Arc::clone(&set), pinned: Box::new(()), view: view.clone() });
        assert!((errors.foreground_ratio - expected.foreground_ratio).abs() < 1e-3);
        assert!((errors.flip - expected.flip).abs() < 0.01 * expected.flip + 1e-5, "{errors:?}: {expected:?}");
        assert_eq!(audit(MadeView::Direct(truth.clone())).flip, 0.0, "drawn as its truth is");
    }
}
