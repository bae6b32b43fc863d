//! Bad messages are refused with the field's name; good ones come back as they were.

use std::num::NonZeroU32;

use cluster::limits::{MAX_BATCH, MAX_JOINING_EPOCH};
use cluster::{
    AchievedTime, ApplyPlan, Assignment, AuditOrder, AuditReport, AuditSummary, AuditedView, BudgetRequest,
    ChangeSession, ClusterStatus, CommonCell, CommonKind, CompositorShare, Costs, ErrorInterval, InvalidField,
    JoinCluster, LiveRequest, MeasureCosts, Measured, MeasuredCosts, NodeCondition, NodeStatus, OfferSettings,
    OfferStatus, Policy, PolicyChoice, Promise, PromiseState, Quality, RenderViews, RequestedView, SamplePlanes,
    SamplerReport, SamplerShare, SceneHash, SceneRef, SessionEvent, SessionPlan, SessionRequest, SharedLightCosts,
    TileCosts, Timeline, ViewErrors, WorkReport, Workload, WorkloadStatus,
};
use codec::{
    FrameCodec, FrameHeader, ImageHeader, InverseDepthRange, MAX_LIGHT_SHARE_PLANES, MAX_VISIBILITY_PLANES,
    PlaneHeader, PlaneKind, SampleSetId, StageTimes,
};
use depth_image::{
    Aabb, Antialias, Camera, CubeGrid, Environment, ExposureEv, Illumination, Light, LightDirections, LightFieldCamera,
    MAX_LIGHTS, PinholeCamera, SourceSpace, ToneCurve, ToneMapping, ViewPlanes,
};
use glam::{DVec3, UVec2, Vec3};

use crate::convert::Convert;
use crate::{PROTOCOL_VERSION, WireError, plan_in_force, proto, refuse_plan};

pub(super) fn read<D: Convert<P>, P>(message: P) -> Result<D, WireError> {
    D::read(message, "")
}

pub(super) fn to_message<P, D: Convert<P>>(value: D) -> P {
    value.write()
}

pub(super) fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

fn illumination() -> Illumination {
    let position_in_world = Vec3::new(0.0, 4.0, 1.0);
    let intensity_linear = Vec3::new(3.0, 2.0, 1.0);
    let lights = vec![
        Light::Directional {
            towards_light_in_world: Vec3::Y,
            irradiance_linear: Vec3::splat(0.5),
            angular_radius_rad: 0.01,
        },
        Light::Point { position_in_world, intensity_linear, radius_m: 0.0 },
        Light::Spot {
            position_in_world,
            forward_in_world: Vec3::NEG_Y,
            intensity_linear,
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.2,
            radius_m: 0.3,
        },
        Light::Rectangle {
            center_in_world: position_in_world,
            half_edges_in_world: [Vec3::X, Vec3::Z * 2.0],
            radiance_linear: Vec3::ONE,
        },
    ];
    Illumination { lights, environment: Environment::gradient(Vec3::ONE, Vec3::splat(0.1)) }
}

pub(super) fn workload() -> Workload {
    Workload {
        scene: SceneRef { hash: SceneHash::of(b"scene"), package_bytes: 5 },
        sample_cameras: vec![camera().into(); 2],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "phong".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::uniform(Vec3::splat(0.2)),
        timeline: Timeline { start_s: 1.0, step_s: 0.5, set_count: 3 },
        illumination: illumination(),
        refinement_steps: 1,
        traced_pixel_count: Some(640 * 360),
    }
}

pub(super) fn assignment() -> Assignment {
    Assignment {
        plan_epoch: 4,
        workload_number: 3,
        policy: Policy::Pipeline,
        workload: workload(),
        samplers: vec![SamplerShare {
            node_name: "a".to_owned(),
            address: "http://127.0.0.1:1".to_owned(),
            image_indices: vec![0, 1],
        }],
        compositors: vec![CompositorShare {
            node_name: "b".to_owned(),
            address: "http://127.0.0.1:2".to_owned(),
            view_weight: 7,
        }],
        tile_count: 1,
        relay_fanout: None,
        method: Some("joint_carve:1".to_owned()),
        audit: Some(AuditOrder {
            time_ratio: 0.01,
            antialias: Antialias::of(4).unwrap(),
            planned_pixel_count: 30_000,
            truth_lighting: "soft 16".to_owned(),
        }),
    }
}

fn tone() -> ToneMapping {
    ToneMapping { exposure: ExposureEv::new(-2.5).unwrap(), curve: ToneCurve::KhronosNeutral }
}

fn request() -> SessionRequest {
    SessionRequest {
        scene: None,
        method: "joint_carve".to_owned(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        follows_mirrors: true,
        takes_light: true,
        codec: "raw".to_owned(),
        sample_cameras: vec![Camera::Pinhole(camera())],
        sample_size_px: Some(UVec2::new(8, 8)),
        volume: None,
        typical_view: camera(),
        views_per_set: 12,
        planes: ViewPlanes { antialias: Antialias::MOST, tone: tone(), ..ViewPlanes::WITH_DEPTH },
        auto_exposure: true,
        timeline: Timeline::still(0.0),
        policy: PolicyChoice::Auto,
        forced_sampler_count: None,
        refinement_steps: 4,
        frames_per_s: Some(25.0),
        fallbacks: vec![Quality {
            lighting: "unlit".to_owned(),
            method: "joint_carve:1".to_owned(),
            sample_side_ratio: 0.5,
            frame_rate_ratio: 1.0,
        }],
        forced_tile_count: Some(2),
        viewpoints: vec![camera(); 2],
        budget: BudgetRequest { budget: Some("flip 0.05".to_owned()), names_method: true },
    }
}

fn promise() -> Promise {
    Promise {
        budget: "flip 0.05".to_owned(),
        state: PromiseState::Kept,
        representation: "conventional, S = 4".to_owned(),
        expected_ratio: 0.03,
        bound_ratio: 0.04,
        probe_view_count: 64,
        reason: "it is the cheapest".to_owned(),
        audit: Some(AuditSummary {
            audited_views: 20,
            covered_views: 5_000,
            uncovered_views: 30,
            error: Some(ErrorInterval { low: 0.02, mean: 0.03, high: 0.05 }),
        }),
    }
}

fn views() -> RenderViews {
    RenderViews {
        plan_epoch: 4,
        workload_number: 3,
        set_index: 1,
        method: "joint_carve".to_owned(),
        codec: FrameCodec::Lz4,
        planes: ViewPlanes { tone: tone(), ..ViewPlanes::default() },
        views: vec![RequestedView { frame: 9, camera: camera() }],
        live: None,
    }
}

#[test]
fn planes_of_samples_survive_the_round_trip() {
    for [normals, corner_inverse_depths, light] in [[true, false, false], [false, true, false], [true, false, true]] {
        let mut with_planes = assignment();
        with_planes.workload.planes = SamplePlanes { normals, corner_inverse_depths, light };
        assert_eq!(read::<Assignment, _>(to_message::<proto::Assignment, _>(with_planes.clone())), Ok(with_planes));
    }
}

#[test]
fn a_plan_of_a_cube_survives_the_round_trip() {
    let mut cube = assignment();
    let grid = CubeGrid::around(&cube.workload.volume, 64).unwrap();
    cube.workload.sample_cameras = [0, 1, 2].map(|axis| grid.camera(axis).into()).to_vec();
    cube.workload.timeline = Timeline::still(0.0);
    cube.samplers[0].image_indices = vec![0, 1, 2];
    let mut with_light_field = cube.clone();
    let field = LightFieldCamera::around(cube.workload.volume, LightDirections::D66, 16);
    with_light_field.workload.sample_cameras.push(field.into());
    with_light_field.samplers[0].image_indices.push(3);
    for plan in [cube, with_light_field] {
        assert_eq!(read::<Assignment, _>(to_message::<proto::Assignment, _>(plan.clone())), Ok(plan));
    }
}

#[test]
fn messages_survive_the_round_trip() {
    assert_eq!(read::<Assignment, _>(to_message::<proto::Assignment, _>(assignment())), Ok(assignment()));
    let mut cells = Assignment { tile_count: 2, relay_fanout: NonZeroU32::new(3), ..assignment() };
    cells.workload.cell_first_indices = vec![0, 1];
    cells.samplers[0].image_indices = vec![3, 1, 2, 0];
    assert_eq!(read::<Assignment, _>(to_message::<proto::Assignment, _>(cells.clone())), Ok(cells));
    let mut mirrors = assignment();
    let cell = CommonCell { kind: CommonKind::Mirrors, bounds: mirrors.workload.volume, sampling: "all".to_owned() };
    mirrors.workload = mirrors.workload.with_common_cells(vec![(cell, vec![camera().into()])]);
    mirrors.samplers[0].image_indices = vec![0, 1, 2];
    assert_eq!(read::<Assignment, _>(to_message::<proto::Assignment, _>(mirrors.clone())), Ok(mirrors));
    let apply = ApplyPlan { assignment: assignment(), open_workloads: vec![3, 1] };
    assert_eq!(read::<ApplyPlan, _>(to_message::<proto::ApplyAssignmentRequest, _>(apply.clone())), Ok(apply));
    assert_eq!(read::<SessionRequest, _>(to_message::<proto::OpenSessionRequest, _>(request())), Ok(request()));
    assert_eq!(read::<RenderViews, _>(to_message::<proto::RenderViewsRequest, _>(views())), Ok(views()));
    let live = LiveRequest { acknowledged_frame: 8, client_id: 5, waits_for_set: true };
    let live = RenderViews { live: Some(live), views: Vec::new(), ..views() };
    assert_eq!(read::<RenderViews, _>(to_message::<proto::RenderViewsRequest, _>(live.clone())), Ok(live));
    let plan = SessionEvent::Plan(Box::new(session_plan()));
    assert_eq!(read::<SessionEvent, _>(to_message::<proto::OpenSessionResponse, _>(plan.clone())), Ok(plan));
    let condition = NodeCondition {
        node_name: "a".to_owned(),
        is_ready: true,
        costs: session_plan().costs,
        views: 3,
        dropped_views: 1,
        busy_ratio: 0.7,
    };
    let workload = WorkloadStatus {
        number: 3,
        plan: Some(session_plan()),
        session_count: 2,
        viewer_count: 1,
        views_per_set: 70,
        conditions: vec![condition],
        achieved: vec![AchievedTime { policy: Policy::TimeShare, busy_s: 0.3 }],
        utilisation: Some(0.6),
        promise: Some(promise()),
        shared_light: Some(SharedLightCosts { known_ratio: 0.9, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.3 }),
        one_more_viewer: 0.02,
    };
    let waiting = WorkloadStatus { number: 4, ..WorkloadStatus::default() };
    let status = ClusterStatus { plan_epoch: 4, workloads: vec![workload, waiting], ..ClusterStatus::default() };
    assert_eq!(read::<ClusterStatus, _>(to_message::<proto::GetStatusResponse, _>(status.clone())), Ok(status));
    let report = SamplerReport {
        plan_epoch: 4,
        compositor: "b".to_owned(),
        sampler: "a".to_owned(),
        reason: "corrupt".to_owned(),
    };
    assert_eq!(read::<SamplerReport, _>(to_message::<proto::ReportSamplerRequest, _>(report.clone())), Ok(report));
    let promised = SessionEvent::Promise(promise());
    assert_eq!(read::<SessionEvent, _>(to_message::<proto::OpenSessionResponse, _>(promised.clone())), Ok(promised));
    let opened = SessionEvent::Opened { session: 7 };
    assert_eq!(read::<SessionEvent, _>(to_message::<proto::OpenSessionResponse, _>(opened.clone())), Ok(opened));
    let change =
        ChangeSession { session: 7, views_per_set: 0, frames_per_s: Some(12.5), viewpoints: Some(vec![camera()]) };
    assert_eq!(read::<ChangeSession, _>(to_message::<proto::ChangeSessionRequest, _>(change.clone())), Ok(change));
    assert_eq!(read::<WorkReport, _>(to_message::<proto::ReportWorkRequest, _>(work_report())), Ok(work_report()));
}

pub(super) fn session_plan() -> SessionPlan {
    SessionPlan {
        assignment: assignment(),
        costs: Costs {
            sample_image_s: 0.1,
            direct_view_s: 0.2,
            reconstruct_view_s: 0.01,
            load_set_s: 0.02,
            encode_view_s: 0.001,
            in_order: true,
            tiles: Some(TileCosts { overhead_s: 0.03, row_shares: Some([0.1, 0.2, 0.3, 0.4]) }),
        },
        reason: "because".to_owned(),
        predicted_pipeline_s: 0.1,
        predicted_direct_s: 0.2,
        predicted_time_share_s: 0.3,
        k_fd_sampler_count: 1,
        predicted_k_fd_s: 0.4,
        enumerated_sampler_count: 2,
        predicted_enumerated_s: 0.5,
        scene_load_s: 0.0,
        fallback: NonZeroU32::new(1),
        method: "joint_carve:1".to_owned(),
        frame_rate_ratio: 0.5,
        auto_exposure: ExposureEv::new(1.25).unwrap(),
    }
}

pub(super) fn probed_view() -> ViewErrors {
    ViewErrors { foreground_ratio: 0.5, flip: 0.1, mean_square: 0.01 }
}

pub(super) fn work_report() -> WorkReport {
    let costs = MeasuredCosts { sample_image_s: Some(0.1), image_bytes: Some(1e5), ..MeasuredCosts::default() };
    WorkReport {
        node_name: "a".to_owned(),
        plan_epoch: 4,
        workload_number: 3,
        costs,
        busy_s: 0.9,
        views: 3,
        dropped_views: 1,
        viewpoints: vec![camera()],
        audit: Some(AuditReport {
            views: vec![AuditedView { plan_epoch: 4, errors: probed_view(), is_part: true }],
            covered_views: 40,
            uncovered_views: 2,
        }),
    }
}

#[test]
fn bad_reports_and_changes_are_refused_by_field() {
    let spoilt = |spoil: &dyn Fn(&mut proto::ReportWorkRequest)| {
        let mut message = to_message::<proto::ReportWorkRequest, _>(work_report());
        spoil(&mut message);
        refusal::<_, WorkReport>(message)
    };
    assert!(spoilt(&|m| m.node_name.clear()).contains("node_name is missing"));
    assert!(spoilt(&|m| m.busy_s = f64::NAN).contains("busy_s is NaN"));
    assert!(spoilt(&|m| m.load_set_s = Some(-1.0)).contains("load_set_s is -1"));
    assert!(spoilt(&|m| m.viewpoints = vec![m.viewpoints[0]; 257]).contains("viewpoints has 257"));
    assert!(spoilt(&|m| m.viewpoints[0].near_m = f32::NAN).contains("viewpoints: camera near_m"));
    let change = proto::ChangeSessionRequest { session_number: 1, frames_per_s: 1.0, ..Default::default() };
    let many = proto::ChangeSessionRequest { views_per_set_count: 1_000_000_000, ..change.clone() };
    assert!(refusal::<_, ChangeSession>(many).contains("views_per_set_count is 1000000000"));
    let viewpoint = to_message::<proto::PinholeCamera, _>(camera());
    let too_many = proto::ChangeSessionRequest { viewpoints: vec![viewpoint; 257], ..change.clone() };
    assert!(refusal::<_, ChangeSession>(too_many).contains("viewpoints has 257"));
    let nowhere = proto::PinholeCamera { near_m: f32::NAN, ..viewpoint };
    let lost = proto::ChangeSessionRequest { viewpoints: vec![nowhere], ..change };
    assert!(refusal::<_, ChangeSession>(lost).contains("viewpoints: camera near_m"));
}

#[test]
fn a_refusal_names_the_plan_in_force() {
    let refusal = refuse_plan(&assignment(), "plan_epoch 3 is not in force".to_owned());
    assert_eq!((refusal.code(), plan_in_force(&refusal)), (tonic::Code::FailedPrecondition, Some(assignment())));
    let mut large = assignment();
    large.workload.sample_cameras = vec![camera().into(); 16];
    large.workload.illumination.lights = vec![illumination().lights[1]; 255];
    let refusal = refuse_plan(&large, String::new());
    assert!(plan_in_force(&refusal).is_none_or(|named| named == large), "whole or not at all");
    assert_eq!(plan_in_force(&tonic::Status::failed_precondition("of something else")), None);
}

pub(super) fn refusal<P, D: Convert<P>>(message: P) -> String {
    D::read(message, "").err().expect("refused").to_string()
}

fn spoilt_views(spoil: impl FnOnce(&mut proto::RenderViewsRequest)) -> String {
    let mut message = to_message::<proto::RenderViewsRequest, _>(views());
    spoil(&mut message);
    refusal::<_, RenderViews>(message)
}

fn spoilt_camera(spoil: impl FnOnce(&mut proto::PinholeCamera)) -> String {
    spoilt_views(|message| spoil(message.views[0].camera.as_mut().unwrap()))
}

#[test]
fn bad_cameras_are_refused_by_field() {
    assert!(spoilt_camera(|c| c.eye_in_world_m = None).contains("eye_in_world_m"));
    assert!(spoilt_camera(|c| c.eye_in_world_m.as_mut().unwrap().x = f32::NAN).contains("eye_in_world"));
    assert!(
        spoilt_camera(|c| c.world_from_camera_unit = Some(proto::Quaternion::default())).contains("world_from_camera")
    );
    assert!(spoilt_camera(|c| c.focal_px.as_mut().unwrap().x = 0.0).contains("focal_px"));
    assert!(spoilt_camera(|c| c.near_m = -1.0).contains("near_m"));
    assert!(spoilt_camera(|c| c.width_px = 0).contains("size_px"));
    assert!(spoilt_camera(|c| (c.width_px, c.height_px) = (65_535, 65_535)).contains("size_px"));
    assert!(spoilt_views(|m| m.views[0].camera = None).contains("views.camera"));
}

#[test]
fn bad_counts_are_refused_by_field() {
    assert!(spoilt_views(|m| m.views.clear()).contains("views is missing"));
    assert!(spoilt_views(|m| m.views = vec![proto::RequestedView::default(); 1_000_000]).contains("views has 1000000"));
    assert!(spoilt_views(|m| m.frame_codec = "x".repeat(300)).contains("frame_codec"));
    assert!(spoilt_views(|m| m.antialias_sample_count = 3).contains("antialias_sample_count is 3"));
    assert!(spoilt_views(|m| m.reconstruction_method.clear()).contains("reconstruction_method"));
    assert!(spoilt_views(|m| m.exposure_ev = f32::NAN).contains("exposure_ev is NaN"));
    assert!(spoilt_views(|m| m.exposure_ev = 99.0).contains("exposure_ev is 99"));
    assert!(spoilt_views(|m| m.tone_curve = 7).contains("tone_curve"));
    let spoilt = |spoil: &dyn Fn(&mut proto::OpenSessionRequest)| {
        let mut message = to_message::<proto::OpenSessionRequest, _>(request());
        spoil(&mut message);
        refusal::<_, SessionRequest>(message)
    };
    assert!(spoilt(&|m| m.sample_cameras = vec![proto::Camera::default(); 17]).contains("sample_cameras has 17"));
    assert!(spoilt(&|m| m.views_per_set_count = 0).contains("views_per_set_count"));
    assert!(spoilt(&|m| m.views_per_set_count = 1_000_000).contains("views_per_set_count is 1000000"));
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().set_count = 0).contains("set_count"));
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().step_s = f64::NAN).contains("step_s"));
    assert!(spoilt(&|m| m.timeline = None).contains("timeline"));
    assert!(spoilt(&|m| m.scene = "x".repeat(300)).contains("scene has 300"));
    assert!(spoilt(&|m| m.frames_per_s = f64::NAN).contains("frames_per_s is NaN"));
    assert!(spoilt(&|m| m.frames_per_s = 1e9).contains("frames_per_s is 1000000000"));
    assert!(spoilt(&|m| m.forced_tile_count = 17).contains("tile_count is 17"));
    assert!(spoilt(&|m| m.fallbacks = vec![m.fallbacks[0].clone(); 17]).contains("fallbacks has 17"));
    assert!(spoilt(&|m| m.fallbacks[0].sample_side_ratio = 1.5).contains("fallbacks.sample_side_ratio is 1.5"));
    assert!(spoilt(&|m| m.fallbacks[0].frame_rate_ratio = 0.0).contains("fallbacks.frame_rate_ratio is 0"));
    assert!(spoilt(&|m| m.exposure_ev = f32::NEG_INFINITY).contains("exposure_ev is -inf"));
    assert!(spoilt(&|m| m.antialias_sample_count = 32).contains("antialias_sample_count is 32"));
    assert!(spoilt(&|m| m.refinement_step_count = 65).contains("refinement_step_count is 65"));
}

#[test]
fn other_versions_are_refused_before_anything_else() {
    for version in [0, PROTOCOL_VERSION + 1] {
        let message = proto::OpenSessionRequest { protocol_version: version, ..proto::OpenSessionRequest::default() };
        assert!(
            refusal::<_, SessionRequest>(message)
                .contains(&format!("protocol_version is {version}, must be {PROTOCOL_VERSION}"))
        );
        let message = proto::JoinClusterRequest { protocol_version: version, ..proto::JoinClusterRequest::default() };
        assert!(
            refusal::<_, JoinCluster>(message)
                .contains(&format!("protocol_version is {version}, must be {PROTOCOL_VERSION}"))
        );
    }
    let error = read::<JoinCluster, _>(proto::JoinClusterRequest::default()).unwrap_err();
    assert_eq!(tonic::Status::from(error).code(), tonic::Code::FailedPrecondition);
}

#[test]
fn a_request_without_refinement_steps_has_one() {
    let message = proto::OpenSessionRequest { refinement_step_count: 0, ..request().write() };
    assert_eq!(read::<SessionRequest, _>(message).map(|request| request.refinement_steps), Ok(1));
}

fn spoilt_workload(spoil: impl FnOnce(&mut proto::Workload)) -> String {
    let mut message = to_message::<proto::Workload, _>(workload());
    spoil(&mut message);
    refusal::<_, Workload>(message)
}

fn spoilt_light(place: usize, spoil: impl FnOnce(&mut proto::light::Kind)) -> String {
    spoilt_workload(|w| spoil(w.illumination.as_mut().unwrap().lights[place].kind.as_mut().unwrap()))
}

#[test]
fn bad_lights_are_refused_by_field() {
    use proto::light::Kind;

    assert!(spoilt_workload(|w| w.illumination = None).contains("workload.illumination is missing"));
    assert!(spoilt_workload(|w| w.refinement_step_count = 0).contains("refinement_step_count is 0"));
    let spoilt = |spoil: fn(&mut proto::Illumination)| spoilt_workload(|w| spoil(w.illumination.as_mut().unwrap()));
    assert!(spoilt(|i| i.environment = None).contains("illumination.environment is missing"));
    assert!(spoilt(|i| i.lights = vec![i.lights[0]; 256]).contains("illumination.lights has 256"));
    assert!(spoilt(|i| i.lights[2].kind = None).contains("light.kind is missing"));
    let zenith = |x| {
        spoilt_workload(|w| {
            let environment = w.illumination.as_mut().unwrap().environment.as_mut().unwrap();
            environment.zenith_linear_rgb.as_mut().unwrap().x = x;
        })
    };
    assert!(zenith(f32::NAN).contains("zenith_linear_rgb"));
    let mapped = spoilt(|i| i.environment.as_mut().unwrap().is_mapped = true);
    assert!(mapped.contains("illumination.environment: zenith: a gradient beside a map"), "{mapped}");
    assert!(zenith(-1.0).contains("illumination.environment: zenith: negative"));
    let directional = |spoil: fn(&mut proto::DirectionalLight)| {
        spoilt_light(0, |kind| match kind {
            Kind::Directional(light) => spoil(light),
            other => panic!("{other:?}"),
        })
    };
    assert!(directional(|l| l.irradiance_linear_rgb = None).contains("irradiance_linear_rgb is missing"));
    assert!(directional(|l| l.angular_radius_rad = 2.0).contains("light.directional: angular_radius"));
    assert!(
        directional(|l| l.towards_light_in_world_unit.as_mut().unwrap().x = 1.0)
            .contains("light.directional: towards_light: not a unit vector")
    );
    let spot = spoilt_light(2, |kind| match kind {
        Kind::Spot(light) => light.inner_cone_rad = f32::NAN,
        other => panic!("{other:?}"),
    });
    assert!(spot.contains("light.spot: inner_cone"), "{spot}");
}

#[test]
fn the_largest_number_of_lights_survives_the_round_trip() {
    let light = illumination().lights[1];
    let most = Illumination { lights: vec![light; MAX_LIGHTS], ..illumination() };
    assert_eq!(MAX_VISIBILITY_PLANES, 64);
    assert_eq!(read::<Illumination, _>(to_message::<proto::Illumination, _>(most.clone())), Ok(most));
}

#[test]
fn bad_mirror_cells_are_refused_by_field() {
    let spoilt = |cells: Vec<proto::CommonCell>| {
        let message = to_message::<proto::Assignment, _>(assignment());
        let workload = message.workload.map(|workload| proto::Workload { common_cells: cells, ..workload });
        refusal::<_, Assignment>(proto::Assignment { workload, ..message })
    };
    let cell = proto::CommonCell { bounds: None, sampling_method: "all".to_owned(), kind: 1 };
    assert!(spoilt(vec![cell.clone()]).contains("common_cells.bounds is missing"));
    assert!(spoilt(vec![proto::CommonCell { kind: 0, ..cell.clone() }]).contains("common_cells.kind"));
    assert!(spoilt(vec![cell; 65]).contains("common_cells has 65"));
}

#[test]
fn unknown_enums_and_empty_oneofs_are_refused() {
    for value in [0, 77, -1] {
        let mut message = to_message::<proto::OpenSessionRequest, _>(request());
        message.policy_choice = value;
        assert!(refusal::<_, SessionRequest>(message).contains("policy_choice"));
        let mut message = to_message::<proto::Assignment, _>(assignment());
        message.policy = value;
        assert!(refusal::<_, Assignment>(message).contains("policy"));
    }
    assert!(refusal::<_, SessionEvent>(proto::OpenSessionResponse { event: None }).contains("event"));
    let mut message = to_message::<proto::OpenSessionRequest, _>(request());
    message.sample_cameras = vec![proto::Camera { model: None }];
    assert!(refusal::<_, SessionRequest>(message).contains("camera.model"));
}

#[test]
fn errors_become_statuses() {
    let refused = tonic::Status::from(WireError::from(InvalidField::Missing { field: "views" }));
    assert_eq!((refused.code(), refused.message()), (tonic::Code::InvalidArgument, "views is missing"));
}

#[test]
fn image_headers_with_light_survive_and_their_kinds_keep_their_numbers() {
    let first = [
        PlaneKind::InverseDepth,
        PlaneKind::TriangleNormalOct16,
        PlaneKind::NormalOct16,
        PlaneKind::LampsRgb9e5,
        PlaneKind::EnvironmentRgb9e5,
    ];
    let kinds = first.into_iter().chain([PlaneKind::LightShare8; MAX_LIGHT_SHARE_PLANES]).chain([PlaneKind::Passed1]);
    let plane = |kind: PlaneKind| PlaneHeader { kind, encoding: kind.encoding(), raw_bytes: 7, packed_bytes: 5 };
    let header = ImageHeader {
        width: 4,
        height: 3,
        inverse_depth_range: InverseDepthRange { least_per_m: 0.1, greatest_per_m: 2.0 },
        layered: None,
        planes: kinds.map(plane).collect(),
    };
    let message = to_message::<proto::ImageHeader, _>(header.clone());
    let numbers: Vec<i32> = message.planes.iter().map(|plane| plane.kind).collect();
    assert_eq!(numbers, [1, 12, 3, 13, 14, 15, 15, 15, 15, 15, 7]);
    assert_eq!(read::<ImageHeader, _>(message), Ok(header));
}

fn header() -> FrameHeader {
    FrameHeader {
        sample_set_id: SampleSetId { plan_epoch: 1, index: 0 },
        cell: 0,
        is_neighbour_cell: false,
        camera: camera(),
        size_px: camera().size_px,
        antialias: Antialias::MOST,
        tone: tone(),
        codec: FrameCodec::Lz4,
        color_bytes: 4,
        inverse_depth_bytes: 0,
        provenance_bytes: 0,
        crc32: 0x1234,
        stage_times: StageTimes { queue_s: 0.3, batch_count: 2, ..StageTimes::default() },
    }
}

#[test]
fn frame_headers_survive_with_their_camera() {
    let header = header();
    assert_eq!(read::<FrameHeader, _>(to_message::<proto::FrameHeader, _>(header.clone())), Ok(header));
}

#[test]
fn frame_headers_that_claim_too_much_are_refused() {
    let spoil = |change: &dyn Fn(&mut proto::FrameHeader)| {
        let mut message = to_message::<proto::FrameHeader, _>(header());
        change(&mut message);
        read::<FrameHeader, _>(message).expect_err("refused").to_string()
    };
    assert!(spoil(&|h| h.color_bytes = u64::MAX).contains("total_bytes"));
    assert!(spoil(&|h| (h.width_px, h.height_px) = (65_535, 65_535)).contains("size_px"));
    assert!(spoil(&|h| h.width_px = 0).contains("size_px"));
    assert!(spoil(&|h| h.frame_codec = "zip".to_owned()).contains("frame_codec"));
    assert!(spoil(&|h| h.stage_times = None).contains("stage_times"));
    assert!(spoil(&|h| h.camera = None).contains("header.camera is missing"));
    assert!(spoil(&|h| h.camera.as_mut().unwrap().near_m = -1.0).contains("header.camera"));
    assert!(spoil(&|h| h.camera.as_mut().unwrap().width_px = 9).contains("header.camera.size_px"));
}

#[test]
fn impossible_stage_times_are_refused_by_field() {
    let spoil = |change: &dyn Fn(&mut proto::StageTimes)| {
        let mut message = to_message::<proto::StageTimes, _>(StageTimes::default());
        change(&mut message);
        read::<StageTimes, _>(message).unwrap_err().to_string()
    };
    assert!(spoil(&|t| t.compositor_s = f64::NAN).contains("compositor_s"));
    assert!(spoil(&|t| t.send_wait_s = -1.0).contains("send_wait_s"));
    assert!(spoil(&|t| t.set_age_s = f64::INFINITY).contains("set_age_s"));
}

#[test]
fn zeros_and_empty_texts_of_the_wire_become_none() {
    let asked = SessionRequest { frames_per_s: None, forced_tile_count: None, ..request() };
    let message = to_message::<proto::OpenSessionRequest, _>(asked.clone());
    assert_eq!((message.frames_per_s, message.forced_tile_count), (0.0, 0));
    assert_eq!(read::<SessionRequest, _>(message), Ok(asked));
    let settings = OfferSettings { lighting: Some("unlit".to_owned()), ..OfferSettings::default() };
    let Workload { scene, volume, .. } = workload();
    let sample_cameras = vec![Camera::Pinhole(camera()); 2];
    let name = "scene".to_owned();
    let source_space = SourceSpace { origin_in_source: DVec3::X, metres_per_unit: 0.5 };
    let period_s = Some(2.5);
    let offer = OfferStatus { name, scene, sample_cameras, volume, source_space, settings, period_s };
    let message = to_message::<proto::SceneOffer, _>(offer.clone());
    assert_eq!((message.sampling_method.as_str(), message.lighting.as_str()), ("", "unlit"));
    assert_eq!(read::<OfferStatus, _>(message), Ok(offer));
    let even =
        Costs { tiles: Some(TileCosts { overhead_s: 0.1, row_shares: None }), sample_image_s: 0.5, ..Costs::default() };
    let whole = Costs { tiles: None, ..even };
    for (costs, overhead_s) in [(even, 0.1), (whole, 0.5)] {
        let message = to_message::<proto::Costs, _>(costs);
        assert_eq!(message.sample_overhead_s, overhead_s);
        assert_eq!(message.sample_row_shares, Some(proto::RowShares::default()));
        assert_eq!(read::<Costs, _>(message), Ok(costs));
    }
}

#[test]
fn a_member_that_leaves_no_room_for_later_plans_is_refused() {
    let node = NodeStatus {
        node_name: "n".to_owned(),
        address: "http://127.0.0.1:1".to_owned(),
        device_name: "d".to_owned(),
        is_software: true,
    };
    let join = |plan_epoch| to_message::<proto::JoinClusterRequest, _>(JoinCluster { node: node.clone(), plan_epoch });
    assert!(read::<JoinCluster, _>(join(MAX_JOINING_EPOCH)).is_ok());
    assert!(refusal::<_, JoinCluster>(join(u64::MAX)).contains("plan_epoch is 18446744073709551615"));
}

#[test]
fn typical_views_of_several_sizes_or_none_are_refused() {
    let view = |size_px: u32| PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(size_px));
    let measure = |typical_views: Vec<PinholeCamera>| MeasureCosts {
        workload: workload(),
        method: "joint_carve".to_owned(),
        codec: "lz4".to_owned(),
        typical_views,
        batch_count: 5,
        planes: ViewPlanes::default(),
        in_background: true,
        budget: None,
    };
    let sent = |measure: MeasureCosts| read::<MeasureCosts, _>(to_message::<proto::MeasureCostsRequest, _>(measure));
    let three = measure(vec![view(8); 3]);
    assert_eq!(sent(three.clone()), Ok(three));
    let other = PinholeCamera { eye_in_world: Vec3::X, ..view(8) };
    assert_eq!(measure(vec![view(8), other]).views(3), [view(8), other, view(8)]);
    for views in [vec![], vec![view(8), view(9)], vec![view(8); MAX_BATCH as usize + 1]] {
        assert!(sent(measure(views)).unwrap_err().to_string().contains("typical_views"));
    }
}

#[test]
fn a_measured_exposure_survives_within_its_limits() {
    let auto_exposure = ExposureEv::new(-3.25).unwrap();
    let planes = SamplePlanes { light: true, ..SamplePlanes::default() };
    let traced_pixel_count = Some(1 << 20);
    let shared_light = Some(SharedLightCosts { known_ratio: 0.9, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.3 });
    let costs = session_plan().costs;
    let measured = Measured { costs, planes, auto_exposure, traced_pixel_count, shared_light, ..Measured::default() };
    let message = to_message::<proto::MeasureCostsResponse, _>(measured.clone());
    assert_eq!(read::<Measured, _>(message.clone()), Ok(measured));
    let spoilt = proto::MeasureCostsResponse { auto_exposure_ev: f32::NAN, ..message };
    assert!(refusal::<_, Measured>(spoilt).contains("auto_exposure_ev is NaN"));
    let plan = to_message::<proto::SessionPlan, _>(session_plan());
    let spoilt = proto::SessionPlan { auto_exposure_ev: 17.0, ..plan };
    assert!(refusal::<_, SessionPlan>(spoilt).contains("auto_exposure_ev is 17"));
}

#[test]
fn a_peer_that_names_no_tone_gets_light_as_it_is() {
    let planes = ViewPlanes { tone: ToneMapping::NONE, ..request().planes };
    let message = to_message::<proto::OpenSessionRequest, _>(request());
    let silent = proto::OpenSessionRequest { exposure_ev: 0.0, tone_curve: 0, with_auto_exposure: false, ..message };
    let expected = SessionRequest { planes, auto_exposure: false, ..request() };
    assert_eq!(read::<SessionRequest, _>(silent), Ok(expected));
}
