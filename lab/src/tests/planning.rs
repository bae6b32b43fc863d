//! Plans on the device: what is promised holds on views that the plan never saw.

use std::sync::Arc;
use std::time::Duration;

use app_core::planning::{PlannedViews, Planning, one_node};
use app_core::setup::{SceneArgs, Setup};
use cluster::SamplePlanes;
use codec::FrameCodec;
use coordinator::schedule::EqualNodes;
use depth_image::{SampleImage, View, ViewPart, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use node::{
    CommonSet, DirectWork, Engine, EngineError, SampleSet, SampleWork, SharedSet, Turn, UploadedSet, ViewAudit,
    ViewProbes as _, ViewWork, WorkClass,
};
use planner::{
    Budget, Choice, Command, Event, Kept, Metric, Outcome, Planner, Price, Pricing as _, ProbeId, ProbeView,
    PromiseState, Purpose, Row, RowCosts,
};
use probe::{DirectCosts, Light, Prober, Probers, Representation, view_errors};

const VIEW_PX: UVec2 = UVec2::new(64, 48);

/// A scene on the device.
struct Stand {
    engine: Arc<GpuEngine>,
    setup: Setup,
    args: SceneArgs,
}

impl Stand {
    fn new(scene: &str, lighting: &str) -> Self {
        let engine = GpuEngine::shared(DevicePreference::Any).unwrap();
        let args = SceneArgs { lighting: lighting.parse().unwrap(), ..SceneArgs::new(fixtures::spec(scene).unwrap()) };
        let setup = args.load().unwrap();
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene).unwrap();
        Self { engine, setup, args }
    }

    fn planning(&self, seed: u64) -> Planning {
        let planes = ViewPlanes::COLOR;
        let codec = FrameCodec::default();
        let views = PlannedViews { size_px: VIEW_PX, planes, codec, scene_time_s: 0.0, seed };
        Planning::new(&self.setup, &self.args, &views).unwrap()
    }

    fn prober(&self, planning: &Planning) -> Prober {
        Prober::new(self.engine.clone(), planning.subject.clone(), Turn::of(WorkClass::Batch))
    }
}

/// Direct drawing costs more than any row: what is chosen does not depend on this machine.
const EXPENSIVE: EqualNodes =
    EqualNodes { nodes: 1, cells: 1, views_a_set: 290, direct_view_s: Some(1e3), encode_view_s: 1e-3 };

fn plan(planning: &Planning, prober: &mut Prober, budget: Budget, kept: Kept) -> (Outcome, Kept, f64) {
    let request = planning.request(budget, "a device".to_owned(), EXPENSIVE.views_a_set, 600.0);
    let mut planner = Planner::new(request, planning.ladder.clone(), EXPENSIVE).unwrap();
    let (outcome, kept) =
        probe::plan(&mut planner, prober, &planning.viewpoints, &planning.representations, kept, |_| ());
    (outcome, kept, planner.spent_s())
}

#[test]
fn a_plan_keeps_its_budget_on_views_that_it_never_saw() {
    let stand = Stand::new("blocks", "phong");
    let planning = stand.planning(1);
    let mut prober = stand.prober(&planning);
    let budget: Budget = "flip 0.12".parse().unwrap();
    let (outcome, kept, spent_s) = plan(&planning, &mut prober, budget, Kept::empty(planning.key()));
    assert_eq!(outcome.state, PromiseState::Kept, "{}", outcome.reason);
    let Choice::Row(row) = outcome.choice else { panic!("{}", outcome.reason) };
    assert!(spent_s > 0.0 && !kept.rows.is_empty());

    let unseen = stand.planning(2);
    let views = unseen.viewpoints.cameras(&(0..64).map(ProbeView::Fresh).collect::<Vec<_>>());
    let (errors, _) = stand.prober(&unseen).probe(&unseen.representations[row], Light::Session, &views).unwrap();
    // The views of a certificate and these differ by chance, and times choose among rows: a tenth is far beyond chance.
    let excess = errors.iter().map(|errors| errors.excess(Metric::Flip, 1.1 * 0.12)).sum::<f64>();
    assert!(excess <= 0.0, "{} is over on other views: {excess}", outcome.reason);

    // Later plans keep the budget, too, and draw other views: the number of drawn ones only rises.
    let drawn = kept.fresh_views_drawn;
    let (again, kept, _) = plan(&planning, &mut prober, budget, kept);
    assert_eq!(again.state, PromiseState::Kept, "{}", again.reason);
    assert!(drawn > 0 && kept.fresh_views_drawn >= drawn);
}

#[test]
fn errors_fall_with_cameras_and_texels_and_true_views_have_none() {
    let stand = Stand::new("courtyard", "phong");
    let planning = stand.planning(3);
    let mut prober = stand.prober(&planning);
    let views = planning.viewpoints.first(8);
    let method = planning.representations[0].method.clone();
    let mut error = |camera_count: u32, side_ratio: f64, metric: Metric| {
        let is_row = |row: &Row| {
            row.sampling == "conventional"
                && row.method == method
                && row.camera_count == camera_count
                && row.side_ratio == side_ratio
        };
        let place = planning.ladder.rows().iter().position(is_row).unwrap();
        let (errors, costs) = prober.probe(&planning.representations[place], Light::Session, &views).unwrap();
        assert!(costs.validate().is_ok() && errors.iter().all(|errors| errors.validate().is_ok()));
        errors.iter().map(|errors| errors.excess(metric, 0.0)).sum::<f64>()
    };
    let [one, four] = [1, 4].map(|cameras| error(cameras, 1.0, Metric::Disocclusion));
    assert!(one > 2.0 * four, "disocclusion of one camera {one}, of four {four}");
    let [half, whole] = [0.5, 1.0].map(|side| error(4, side, Metric::Flip));
    assert!(half > 1.1 * whole && whole > 0.0, "FLIP at half the side {half}, at the whole {whole}");
}

/// The device, which samples slowly in any light but the plain one.
struct SlowInOtherLight(Arc<GpuEngine>);

const SLOW: Duration = Duration::from_millis(300);

impl Engine for SlowInOtherLight {
    fn sample(&self, request: &SampleWork, turn: Turn) -> Result<Vec<SampleImage>, EngineError> {
        if request.lighting != "phong" {
            std::thread::sleep(SLOW);
        }
        self.0.sample(request, turn)
    }

    fn device_name(&self) -> String {
        self.0.device_name()
    }

    fn is_software(&self) -> bool {
        self.0.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError> {
        self.0.load_scene(hash, package)
    }

    fn has_scene(&self, hash: &str) -> bool {
        self.0.has_scene(hash)
    }

    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError> {
        self.0.images_are_sequential(sampling)
    }

    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError> {
        self.0.images_are_independent(sampling)
    }

    fn sample_planes(&self, method: &str) -> Result<SamplePlanes, EngineError> {
        self.0.sample_planes(method)
    }

    fn upload(&self, set: &SampleSet, turn: Turn) -> Result<SharedSet, EngineError> {
        self.0.upload(set, turn)
    }

    fn with_common(&self, set: SharedSet, common: Vec<CommonSet>) -> Result<SharedSet, EngineError> {
        self.0.with_common(set, common)
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        self.0.reconstruct(set, work, turn)
    }

    fn draw_direct(&self, work: &DirectWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        self.0.draw_direct(work, turn)
    }
}

/// Where light is expensive, images of screening are unlike those of the session, and costs are the session's.
#[test]
fn costs_of_screening_are_those_of_the_light_of_the_session() {
    let stand = Stand::new("blocks", "soft 2");
    let planning = stand.planning(0);
    let engine = SlowInOtherLight(stand.engine.clone());
    let mut prober = Prober::new(Arc::new(engine), planning.subject.clone(), Turn::of(WorkClass::Batch));
    assert_eq!(planning.subject.screening_lighting, "phong");
    let views = planning.viewpoints.first(1);
    // One camera: its image is the whole set.
    let screened = prober.probe(&planning.representations[0], Light::Screening, &views).unwrap().1;
    assert!(screened.sample_image_s >= SLOW.as_secs_f64(), "g_s is of another light: {screened:?}");
    let [in_plain, in_soft] = [Light::Screening, Light::Session].map(|light| prober.truths(light, &views).unwrap());
    assert_ne!(in_plain[0].srgb8, in_soft[0].srgb8);
}

#[test]
fn a_representation_that_the_device_refuses_is_an_answer() {
    let stand = Stand::new("blocks", "phong");
    let planning = stand.planning(0);
    let mut prober = stand.prober(&planning);
    let broken = Representation { method: "guess".to_owned(), ..planning.representations[0].clone() };
    let id = ProbeId { plan: 1, number: 1 };
    let row = 0;
    let views = vec![ProbeView::Screening(0)];
    let purpose = Purpose::Screening;
    let event = probe::answer(&mut prober, &planning.viewpoints, &[broken], Command::Probe { id, row, views, purpose })
        .unwrap();
    let Event::Failed { id: answered, reason, .. } = &event else { panic!("{event:?}") };
    assert!(*answered == id && reason.contains("guess"), "{reason}");
    event.validate().unwrap();
}

#[test]
fn the_price_on_one_node_is_the_set_shared_by_its_views_and_the_view() {
    let row = Row {
        sampling: "s".to_owned(),
        method: "m".to_owned(),
        camera_count: 4,
        place_count: 4,
        side_ratio: 1.0,
        kind: "k".to_owned(),
        rank: 0,
    };
    let costs = RowCosts { sample_image_s: 0.02, load_set_s: 0.01, reconstruct_view_s: 0.003 };
    let direct = DirectCosts { direct_view_s: 0.05, encode_view_s: 0.001 };
    let one_node = one_node(10, direct);
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    let Price { node_s, view_s } = one_node.row(&row, &costs);
    close(node_s, (4.0 * 0.02 + 0.01) / 10.0 + 0.004);
    close(view_s, 0.004);
    close(one_node.direct().node_s, 0.051);
}

/// A part of a large view is drawn and made alone, with what is around it: its errors are those of the same pixels of the whole.
#[test]
fn an_audited_part_has_the_errors_of_its_pixels_in_the_whole_view() {
    let stand = Stand::new("blocks", "phong");
    let planning = stand.planning(1);
    let subject = &planning.subject;
    let engine = stand.engine.clone();
    let turn = Turn::of(WorkClass::Batch);
    let of =
        planning.representations.iter().find(|of| of.method == "joint_carve" && of.sample_cameras.len() == 4).unwrap();
    let images = engine.sample(&subject.sample_work(engine.as_ref(), of, Light::Session).unwrap(), turn).unwrap();
    let images = SampleImage::depth_images(images).unwrap();
    let set = engine.upload(&subject.sample_set(&images, Light::Session), turn).unwrap();
    let camera = planning.viewpoints.first(3)[2].resized(UVec2::new(400, 300));
    let view = ViewWork { cameras: vec![camera], method: of.method.clone(), planes: ViewPlanes::COLOR };
    let direct = subject.direct_work(vec![camera], Light::Session, ViewPlanes::WITH_DEPTH);
    let made = engine.reconstruct(set.as_ref(), &view, turn).unwrap().remove(0);
    let truth = engine.draw_direct(&direct, turn).unwrap().remove(0);
    let set = set;
    let whole = ViewPart::whole(camera.size_px);
    for pixel in [UVec2::new(200, 150), UVec2::new(100, 150), UVec2::new(399, 200)] {
        let part = ViewPart::square_of(pixel, 128, camera.size_px);
        let mask: Vec<bool> = part.mask_within(&whole).collect();
        let expected = view_errors(&camera, &truth, &made, &images, Some(&mask)).unwrap();
        let audit = ViewAudit {
            set: Arc::clone(&set),
            sample_images: images.clone().into(),
            pinned: Box::new(()),
            view: view.clone(),
            part,
            direct: direct.clone(),
        };
        let (errors, _) = Probers::new(engine.clone()).audit(audit).unwrap();
        println!("{part:?}: {errors:?}, in the whole {expected:?}");
        assert!((errors.foreground_ratio - expected.foreground_ratio).abs() < 1e-3);
        assert!((errors.flip - expected.flip).abs() < 0.01 * expected.flip + 1e-5, "{errors:?}: {expected:?}");
        assert!((errors.disoccluded_ratio - expected.disoccluded_ratio).abs() < 1e-3);
    }
}
