//! Bad messages are refused with the field's name; good ones come back as they were.

use std::num::NonZeroU32;

use depth_image::{Aabb, Camera, Environment, Illumination, Light, PinholeCamera, ViewPlanes};
use glam::{UVec2, Vec3};

use crate::geometry::pinhole_to;
use crate::*;

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

fn illumination() -> Illumination {
    let (position_in_world, intensity_linear) = (Vec3::new(0.0, 4.0, 1.0), Vec3::new(3.0, 2.0, 1.0));
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
    Illumination { lights, environment: Environment { zenith_linear: Vec3::ONE, nadir_linear: Vec3::splat(0.1) } }
}

pub(crate) fn workload() -> Workload {
    Workload {
        scene: SceneRef { hash: SceneHash::of(b"scene"), package_bytes: 5 },
        sample_cameras: vec![Camera::Pinhole(camera()); 2],
        cell_first_indices: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "phong".to_owned(),
        method: "joint_carve".to_owned(),
        codec: "raw".to_owned(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background_linear: Vec3::splat(0.2),
        timeline: Timeline { start_s: 1.0, step_s: 0.5, set_count: 3 },
        illumination: illumination(),
        refinement_steps: 1,
    }
}

fn assignment() -> Assignment {
    Assignment {
        plan_epoch: 4,
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
    }
}

fn request() -> SessionRequest {
    SessionRequest {
        scene: None,
        method: "joint_carve".to_owned(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        codec: "raw".to_owned(),
        sample_cameras: vec![Camera::Pinhole(camera())],
        sample_size_px: Some(UVec2::new(8, 8)),
        volume: None,
        typical_view: camera(),
        views_per_set: 12,
        planes: ViewPlanes { inverse_depth: true, provenance: false },
        timeline: Timeline::still(0.0),
        policy: PolicyChoice::Auto,
        forced_sampler_count: None,
        refinement_steps: 4,
        frames_per_s: 25.0,
        fallbacks: vec![Quality {
            lighting: "unlit".to_owned(),
            method: "joint_carve:1".to_owned(),
            sample_side_ratio: 0.5,
            frame_rate_ratio: 1.0,
        }],
        forced_tile_count: Some(2),
        viewpoints: vec![camera(); 2],
    }
}

fn views() -> RenderViews {
    RenderViews {
        plan_epoch: 4,
        set_index: 1,
        method: "joint_carve".to_owned(),
        codec: FrameCodec::Lz4,
        planes: ViewPlanes::default(),
        views: vec![RequestedView { frame: 9, camera: camera() }],
        live: None,
    }
}

#[test]
fn messages_come_back() {
    assert_eq!(Assignment::try_from(proto::Assignment::from(assignment())), Ok(assignment()));
    assert_eq!(SessionRequest::try_from(proto::OpenSessionRequest::from(request())), Ok(request()));
    assert_eq!(RenderViews::try_from(proto::RenderViewsRequest::from(views())), Ok(views()));
    let live =
        RenderViews { live: Some(LiveRequest { acknowledged_frame: 8, client_id: 5 }), views: Vec::new(), ..views() };
    assert_eq!(RenderViews::try_from(proto::RenderViewsRequest::from(live.clone())), Ok(live));
    let plan = SessionEvent::Plan(Box::new(SessionPlan {
        assignment: assignment(),
        costs: Costs {
            sample_image_s: 0.1,
            direct_view_s: 0.2,
            reconstruct_view_s: 0.01,
            load_set_s: 0.02,
            encode_view_s: 0.001,
            in_order: true,
            sample_overhead_s: 0.03,
            sample_row_shares: [0.1, 0.2, 0.3, 0.4],
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
        fallback_number: 1,
        frame_rate_ratio: 0.5,
    }));
    assert_eq!(SessionEvent::try_from(proto::OpenSessionResponse::from(plan.clone())), Ok(plan.clone()));
    let SessionEvent::Plan(plan) = plan else { panic!("{plan:?}") };
    let condition = NodeCondition {
        node_name: "a".to_owned(),
        is_ready: true,
        costs: plan.costs,
        views: 3,
        dropped_views: 1,
        busy_ratio: 0.7,
    };
    let status = ClusterStatus {
        plan_epoch: 4,
        plan: Some(plan),
        session_count: 2,
        views_per_set: 70,
        conditions: vec![condition],
        achieved: vec![AchievedTime { policy: Policy::TimeShare, busy_s: 0.3 }],
        utilisation: 0.6,
        ..ClusterStatus::default()
    };
    assert_eq!(ClusterStatus::try_from(proto::GetStatusResponse::from(status.clone())), Ok(status));
    let report = SamplerReport {
        plan_epoch: 4,
        compositor: "b".to_owned(),
        sampler: "a".to_owned(),
        reason: "corrupt".to_owned(),
    };
    assert_eq!(SamplerReport::try_from(proto::ReportSamplerRequest::from(report.clone())), Ok(report));
    assert_eq!(Workload::from_bytes(&workload().to_bytes()), Ok(workload()));
    let opened = SessionEvent::Opened { session: 7 };
    assert_eq!(SessionEvent::try_from(proto::OpenSessionResponse::from(opened.clone())), Ok(opened));
    let change = ChangeSession { session: 7, views_per_set: 0, frames_per_s: 12.5, viewpoints: vec![camera()] };
    assert_eq!(ChangeSession::try_from(proto::ChangeSessionRequest::from(change.clone())), Ok(change));
    assert_eq!(WorkReport::try_from(proto::ReportWorkRequest::from(work_report())), Ok(work_report()));
}

fn work_report() -> WorkReport {
    let costs = MeasuredCosts { sample_image_s: Some(0.1), image_bytes: Some(1e5), ..MeasuredCosts::default() };
    WorkReport { node_name: "a".to_owned(), plan_epoch: 4, costs, busy_s: 0.9, views: 3, dropped_views: 1 }
}

#[test]
fn bad_reports_and_demands_are_refused() {
    let spoilt = |spoil: &dyn Fn(&mut proto::ReportWorkRequest)| {
        let mut message = proto::ReportWorkRequest::from(work_report());
        spoil(&mut message);
        refusal::<_, WorkReport>(message)
    };
    assert!(spoilt(&|m| m.node_name.clear()).contains("node_name is missing"));
    assert!(spoilt(&|m| m.busy_s = f64::NAN).contains("busy_s is NaN"));
    assert!(spoilt(&|m| m.load_set_s = Some(-1.0)).contains("load_set_s is -1"));
    let change = proto::ChangeSessionRequest { session_number: 1, frames_per_s: 1.0, ..Default::default() };
    let many = proto::ChangeSessionRequest { views_per_set_count: 1_000_000_000, ..change.clone() };
    assert!(refusal::<_, ChangeSession>(many).contains("views_per_set_count is 1000000000"));
    let viewpoint = pinhole_to(&camera());
    let crowd = proto::ChangeSessionRequest { viewpoints: vec![viewpoint; 257], ..change.clone() };
    assert!(refusal::<_, ChangeSession>(crowd).contains("viewpoints has 257"));
    let nowhere = proto::PinholeCamera { near_m: f32::NAN, ..viewpoint };
    let lost = proto::ChangeSessionRequest { viewpoints: vec![nowhere], ..change };
    assert!(refusal::<_, ChangeSession>(lost).contains("viewpoints: camera near_m"));
}

#[test]
fn tiles_are_images_of_their_own_to_samplers() {
    let mut cut = Assignment { tile_count: 2, ..assignment() };
    cut.samplers[0].image_indices = vec![0, 3];
    let other = SamplerShare { node_name: "c".to_owned(), image_indices: vec![1, 2], ..cut.samplers[0].clone() };
    cut.samplers.push(other);
    assert_eq!(Assignment::try_from(proto::Assignment::from(cut.clone())), Ok(cut.clone()));
    let heights: Vec<u32> = cut.sampled_cameras().iter().map(|Camera::Pinhole(c)| c.size_px.y).collect();
    assert_eq!((heights.len(), heights[0] + heights[1]), (4, camera().size_px.y));
    assert_eq!(cut.sets_at_once(), 1);
    assert_eq!(cut.set_content(0), assignment().set_content(0), "a set shows the same however it is cut");
    let lost = Assignment { tile_count: 4, ..cut.clone() };
    assert!(refusal::<_, Assignment>(proto::Assignment::from(lost)).contains("image_indices"));
    assert!(refusal::<_, Assignment>(proto::Assignment { tile_count: 17, ..cut.into() }).contains("tile_count is 17"));
}

#[test]
fn a_refusal_names_the_plan_in_force() {
    let refusal = assignment().refusal("plan_epoch 3 is not in force".to_owned());
    assert_eq!((refusal.code(), Assignment::told_by(&refusal)), (tonic::Code::FailedPrecondition, Some(assignment())));
    let mut large = assignment();
    large.workload.sample_cameras = vec![Camera::Pinhole(camera()); 16];
    large.workload.illumination.lights = vec![illumination().lights[1]; 255];
    let refusal = large.refusal(String::new());
    assert!(Assignment::told_by(&refusal).is_none_or(|told| told == large), "whole or not at all");
    assert_eq!(Assignment::told_by(&tonic::Status::failed_precondition("of something else")), None);
}

#[test]
fn relays_reach_every_compositor() {
    for fanout in [None, NonZeroU32::new(1), NonZeroU32::new(2), NonZeroU32::new(3)] {
        let compositor = |i: u32| CompositorShare { node_name: format!("c{i}"), ..assignment().compositors[0].clone() };
        let plan = Assignment { compositors: (0..10).map(compositor).collect(), relay_fanout: fanout, ..assignment() };
        assert_eq!(Assignment::try_from(proto::Assignment::from(plan.clone())), Ok(plan.clone()));
        let mut asked = std::collections::HashMap::new();
        for i in 0..10 {
            let (mut steps, mut at) = (0, format!("c{i}"));
            while let Some(relay) = plan.relay_of(&at) {
                (steps, at) = (steps + 1, relay.node_name.clone());
            }
            assert!(steps < 10, "the way ends at the samplers");
            if let Some(relay) = plan.relay_of(&format!("c{i}")) {
                assert!(plan.relays(&relay.node_name));
                *asked.entry(relay.node_name.clone()).or_insert(0) += 1;
            }
        }
        assert!(asked.values().all(|&count| count <= fanout.map_or(0, NonZeroU32::get)));
        assert_eq!(asked.values().sum::<u32>(), 10 - fanout.map_or(10, NonZeroU32::get));
    }
}

#[test]
fn policies_have_names() {
    for choice in [PolicyChoice::Auto, PolicyChoice::Pipeline, PolicyChoice::Direct, PolicyChoice::TimeShare] {
        assert_eq!(choice.to_string().parse(), Ok(choice));
        let asked = SessionRequest { policy: choice, ..request() };
        assert_eq!(SessionRequest::try_from(proto::OpenSessionRequest::from(asked.clone())), Ok(asked));
    }
    let unknown = "best".parse::<PolicyChoice>().unwrap_err().to_string();
    assert!(unknown.contains("\"best\"") && unknown.contains("time-share"), "{unknown}");
}

fn refusal<P, D: TryFrom<P, Error = WireError>>(message: P) -> String {
    D::try_from(message).err().expect("refused").to_string()
}

fn spoilt_views(spoil: impl FnOnce(&mut proto::RenderViewsRequest)) -> String {
    let mut message = proto::RenderViewsRequest::from(views());
    spoil(&mut message);
    refusal::<_, RenderViews>(message)
}

fn spoilt_camera(spoil: impl FnOnce(&mut proto::PinholeCamera)) -> String {
    spoilt_views(|message| spoil(message.views[0].camera.as_mut().unwrap()))
}

#[test]
fn bad_cameras_are_refused() {
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
fn bad_counts_are_refused() {
    assert!(spoilt_views(|m| m.views.clear()).contains("views is missing"));
    assert!(spoilt_views(|m| m.views = vec![proto::RequestedView::default(); 1_000_000]).contains("views has 1000000"));
    assert!(spoilt_views(|m| m.frame_codec = "x".repeat(300)).contains("frame_codec"));
    assert!(spoilt_views(|m| m.reconstruction_method.clear()).contains("reconstruction_method"));
    let spoilt = |spoil: &dyn Fn(&mut proto::OpenSessionRequest)| {
        let mut message = proto::OpenSessionRequest::from(request());
        spoil(&mut message);
        refusal::<_, SessionRequest>(message)
    };
    assert!(spoilt(&|m| m.sample_cameras = vec![proto::Camera::default(); 17]).contains("sample_cameras has 17"));
    assert!(spoilt(&|m| m.views_per_set_count = 0).contains("views_per_set_count"));
    assert!(spoilt(&|m| m.views_per_set_count = 1_000_000).contains("views_per_set_count is 1000000"));
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().set_count = 0).contains("set_count"));
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().step_s = f64::NAN).contains("step_s"));
    assert!(spoilt(&|m| m.timeline = None).contains("timeline"));
    assert!(spoilt(&|m| m.scene_hash = "../scene".to_owned()).contains("scene_hash"));
    assert!(spoilt(&|m| m.frames_per_s = f64::NAN).contains("frames_per_s is NaN"));
    assert!(spoilt(&|m| m.frames_per_s = 1e9).contains("frames_per_s is 1000000000"));
    assert!(spoilt(&|m| m.forced_tile_count = 17).contains("tile_count is 17"));
    assert!(spoilt(&|m| m.fallbacks = vec![m.fallbacks[0].clone(); 17]).contains("fallbacks has 17"));
    assert!(spoilt(&|m| m.fallbacks[0].sample_side_ratio = 1.5).contains("fallbacks.sample_side_ratio is 1.5"));
    assert!(spoilt(&|m| m.fallbacks[0].frame_rate_ratio = 0.0).contains("fallbacks.frame_rate_ratio is 0"));
    assert!(spoilt(&|m| m.refinement_step_count = 65).contains("refinement_step_count is 65"));
}

#[test]
fn other_versions_are_refused_before_anything_else() {
    for version in [0, PROTOCOL_VERSION + 1] {
        let message = proto::OpenSessionRequest { protocol_version: version, ..proto::OpenSessionRequest::default() };
        assert!(refusal::<_, SessionRequest>(message).contains(&format!("protocol_version is {version}, must be 1")));
        let message = proto::JoinClusterRequest { protocol_version: version, ..proto::JoinClusterRequest::default() };
        assert!(refusal::<_, JoinCluster>(message).contains(&format!("protocol_version is {version}, must be 1")));
    }
    let error = JoinCluster::try_from(proto::JoinClusterRequest::default()).unwrap_err();
    assert_eq!(tonic::Status::from(error).code(), tonic::Code::FailedPrecondition);
}

#[test]
fn without_a_wish_every_set_is_finished() {
    let message = proto::OpenSessionRequest { refinement_step_count: 0, ..request().into() };
    assert_eq!(SessionRequest::try_from(message).map(|request| request.refinement_steps), Ok(1));
}

fn spoilt_workload(spoil: impl FnOnce(&mut proto::Workload)) -> String {
    let mut message = proto::Workload::from(workload());
    spoil(&mut message);
    refusal::<_, Workload>(message)
}

fn spoilt_light(place: usize, spoil: impl FnOnce(&mut proto::light::Kind)) -> String {
    spoilt_workload(|w| spoil(w.illumination.as_mut().unwrap().lights[place].kind.as_mut().unwrap()))
}

#[test]
fn bad_lights_are_refused() {
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
fn as_many_lights_as_have_a_plane_come_back() {
    let light = illumination().lights[1];
    let most = Illumination { lights: vec![light; limits::MAX_LIGHTS], ..illumination() };
    assert_eq!(limits::MAX_VISIBILITY_PLANES, 64);
    assert_eq!(Illumination::try_from(proto::Illumination::from(most.clone())), Ok(most));
}

#[test]
fn a_still_picture_is_refined_set_by_set_and_a_moving_one_is_finished() {
    let steps = |refinement_steps, step_s| {
        let timeline = Timeline { start_s: 0.0, step_s, set_count: 8 };
        let workload = Workload { refinement_steps, timeline, ..workload() };
        (0..8).map(|set_index| workload.refinement(set_index)).collect::<Vec<_>>()
    };
    let of_4 = |step| Refinement { step, steps: 4 };
    assert_eq!(steps(4, 0.0), [0, 1, 2, 3, 3, 3, 3, 3].map(of_4));
    assert_eq!(steps(4, 0.1), [of_4(3); 8]);
    assert_eq!(steps(1, 0.0), [Refinement::default(); 8]);
    assert!(of_4(3).is_last() && !of_4(2).is_last() && Refinement::default().is_last());
}

#[test]
fn unknown_enums_and_empty_oneofs_are_refused() {
    for value in [0, 77, -1] {
        let mut message = proto::OpenSessionRequest::from(request());
        message.policy_choice = value;
        assert!(refusal::<_, SessionRequest>(message).contains("policy_choice"));
        let mut message = proto::Assignment::from(assignment());
        message.policy = value;
        assert!(refusal::<_, Assignment>(message).contains("policy"));
    }
    assert!(refusal::<_, SessionEvent>(proto::OpenSessionResponse { event: None }).contains("event"));
    let mut message = proto::OpenSessionRequest::from(request());
    message.sample_cameras = vec![proto::Camera { model: None }];
    assert!(refusal::<_, SessionRequest>(message).contains("camera.model"));
}

#[test]
fn plans_sample_each_image_once() {
    let spoilt = |indices: &[u32]| {
        let mut message = proto::Assignment::from(assignment());
        message.samplers[0].image_indices = indices.to_vec();
        refusal::<_, Assignment>(message)
    };
    for indices in [&[0][..], &[0, 0], &[0, 1, 1], &[0, 2], &[u32::MAX]] {
        assert!(spoilt(indices).contains("image_indices"), "{indices:?}");
    }
    let mut message = proto::Assignment::from(assignment());
    message.compositors.clear();
    assert!(refusal::<_, Assignment>(message).contains("compositors"));
}

#[test]
fn set_content_names_what_a_set_shows() {
    let id = |change: &dyn Fn(&mut Assignment)| {
        let mut assignment = assignment();
        change(&mut assignment);
        assignment.set_content(1).unwrap()
    };
    let same = id(&|_| ());
    assert_eq!(id(&|a| a.plan_epoch = 9), same, "the plan is not what a set shows");
    assert_ne!(id(&|a| a.workload.timeline.step_s = 0.6), same);
    assert_ne!(id(&|a| a.workload.lighting = "unlit".to_owned()), same);
    assert_ne!(id(&|a| a.workload.sample_cameras.truncate(1)), same);
    assert_ne!(id(&|a| a.workload.refinement_steps = 2), same);
    assert_ne!(id(&|a| a.workload.illumination.lights.truncate(3)), same);
    assert_ne!(id(&|a| a.workload.illumination.environment = Environment::default()), same);
    assert_eq!((assignment().set_content(3), assignment().sample_set_id(3)), (None, None));
    let still = |index| {
        Assignment {
            workload: Workload { timeline: Timeline { step_s: 0.0, ..workload().timeline }, ..workload() },
            ..assignment()
        }
        .set_content(index)
    };
    assert_eq!(still(0), still(2), "a static scene has one set");
    let timeline = Timeline { step_s: 0.0, set_count: 8, ..workload().timeline };
    let refined = Assignment { workload: Workload { timeline, refinement_steps: 4, ..workload() }, ..assignment() };
    let contents: Vec<_> = (0..8).map(|set_index| refined.set_content(set_index).unwrap()).collect();
    assert!((0..3).all(|i| !contents[i + 1..].contains(&contents[i])), "each step is another");
    assert!(contents[3..].iter().all(|content| *content == contents[3]), "the last stays");
}

#[test]
fn errors_become_statuses() {
    let refused = tonic::Status::from(WireError::Missing { field: "views" });
    assert_eq!((refused.code(), refused.message()), (tonic::Code::InvalidArgument, "views is missing"));
    assert_eq!(tonic::Status::from(WireError::corrupt("data", "x")).code(), tonic::Code::DataLoss);
}

/// Three cells of 1, 2 and 1 cameras in four tiles' plan of two samplers.
fn of_cells() -> Assignment {
    let looking = |x: f32| {
        let eye = Vec3::new(x, 0.0, 9.0);
        Camera::Pinhole(PinholeCamera { eye_in_world: eye, ..camera() })
    };
    let workload = Workload {
        sample_cameras: [0.0, 10.0, 11.0, 30.0].map(looking).to_vec(),
        cell_first_indices: vec![0, 1, 3],
        ..workload()
    };
    let share = |name: &str, image_indices: Vec<u32>| SamplerShare {
        node_name: name.to_owned(),
        address: "http://127.0.0.1:1".to_owned(),
        image_indices,
    };
    let samplers = vec![share("a", vec![0, 1, 2]), share("c", vec![3, 4, 5, 6, 7])];
    Assignment { workload, samplers, tile_count: 2, ..assignment() }
}

#[test]
fn a_cells_plan_has_its_images_and_no_others() {
    let plan = of_cells();
    assert_eq!(Assignment::try_from(proto::Assignment::from(plan.clone())), Ok(plan.clone()));
    let of = |cell: u32| {
        let of_cell = plan.of_cell(cell).unwrap();
        let shares: Vec<_> = of_cell.samplers.iter().map(|s| (s.node_name.clone(), s.image_indices.clone())).collect();
        assert_eq!(Assignment::try_from(proto::Assignment::from(of_cell.clone())), Ok(of_cell.clone()));
        (of_cell.workload.sample_cameras.len(), shares)
    };
    let share = |name: &str, images: &[u32]| (name.to_owned(), images.to_vec());
    assert_eq!(of(0), (1, vec![share("a", &[0, 1])]));
    assert_eq!(of(1), (2, vec![share("a", &[0]), share("c", &[1, 2, 3])]));
    assert_eq!(of(2), (1, vec![share("c", &[0, 1])]));
    assert_eq!(plan.of_cell(3), None);
    let one = assignment();
    assert_eq!((one.of_cell(0), one.of_cell(1)), (Some(one.clone()), None));
}

#[test]
fn a_view_is_of_the_nearest_cell_and_what_a_cell_shows_is_its_own() {
    let plan = of_cells();
    let view = |x: f32| PinholeCamera { eye_in_world: Vec3::new(x, 0.0, 9.0), ..camera() };
    assert_eq!([-3.0, 4.0, 6.0, 10.5, 17.0, 40.0].map(|x| plan.cell_of(&view(x))), [0, 0, 1, 1, 1, 2]);
    assert_eq!(Assignment { policy: Policy::Direct, ..plan.clone() }.cell_of(&view(40.0)), 0);
    let content = |plan: &Assignment, cell: u32| plan.of_cell(cell).unwrap().set_content(0);
    let mut fewer = plan.clone();
    fewer.workload.sample_cameras.pop();
    fewer.workload.cell_first_indices.pop();
    fewer.plan_epoch += 1;
    assert_eq!([0, 1].map(|cell| content(&fewer, cell)), [0, 1].map(|cell| content(&plan, cell)));
    assert_ne!(content(&plan, 0), content(&plan, 1));
}

#[test]
fn cells_that_cannot_be_are_refused() {
    let spoilt = |firsts: Vec<u32>| {
        let mut message = proto::Assignment::from(of_cells());
        message.workload.as_mut().unwrap().cell_first_indices = firsts;
        refusal::<_, Assignment>(message)
    };
    for firsts in [vec![1, 2], vec![0, 0, 3], vec![0, 3, 1], vec![0, 4], vec![0, u32::MAX]] {
        let text = spoilt(firsts);
        assert!(text.contains("cell_first_indices is ") && text.contains("of 4 sample_cameras"), "{text}");
    }
    assert!(spoilt(vec![0; 65]).contains("cell_first_indices has 65"));
}
