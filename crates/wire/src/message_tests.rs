//! Bad messages are refused with the field's name; good ones come back as they were.

use depth_image::{Aabb, Camera, PinholeCamera, ViewPlanes};
use glam::{UVec2, Vec3};

use crate::*;

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

fn workload() -> Workload {
    Workload {
        scene: SceneRef { hash: SceneHash::of(b"scene"), package_bytes: 5 },
        sample_cameras: vec![Camera::Pinhole(camera()); 2],
        sampling: "conventional".to_owned(),
        lighting: "phong".to_owned(),
        method: "joint_carve".to_owned(),
        codec: "raw".to_owned(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background_linear: Vec3::splat(0.2),
        timeline: Timeline { start_s: 1.0, step_s: 0.5, set_count: 3 },
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
        compositors: vec![CompositorShare { node_name: "b".to_owned(), address: "http://127.0.0.1:2".to_owned() }],
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
    }
}

#[test]
fn messages_come_back() {
    assert_eq!(Assignment::try_from(proto::Assignment::from(assignment())), Ok(assignment()));
    assert_eq!(SessionRequest::try_from(proto::OpenSessionRequest::from(request())), Ok(request()));
    assert_eq!(RenderViews::try_from(proto::RenderViewsRequest::from(views())), Ok(views()));
    let plan = SessionEvent::Plan(Box::new(SessionPlan {
        assignment: assignment(),
        costs: Costs {
            sample_image_s: 0.1,
            direct_view_s: 0.2,
            reconstruct_view_s: 0.01,
            load_set_s: 0.02,
            encode_view_s: 0.001,
        },
        reason: "because".to_owned(),
        predicted_pipeline_s: 0.1,
        predicted_direct_s: 0.2,
        scene_load_s: 0.0,
    }));
    assert_eq!(SessionEvent::try_from(proto::OpenSessionResponse::from(plan.clone())), Ok(plan));
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
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().set_count = 0).contains("set_count"));
    assert!(spoilt(&|m| m.timeline.as_mut().unwrap().step_s = f64::NAN).contains("step_s"));
    assert!(spoilt(&|m| m.timeline = None).contains("timeline"));
    assert!(spoilt(&|m| m.scene_hash = "../scene".to_owned()).contains("scene_hash"));
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
    assert_eq!((assignment().set_content(3), assignment().sample_set_id(3)), (None, None));
    let still = |index| {
        Assignment {
            workload: Workload { timeline: Timeline { step_s: 0.0, ..workload().timeline }, ..workload() },
            ..assignment()
        }
        .set_content(index)
    };
    assert_eq!(still(0), still(2), "a static scene has one set");
}

#[test]
fn errors_become_statuses() {
    let refused = tonic::Status::from(WireError::Missing { field: "views" });
    assert_eq!((refused.code(), refused.message()), (tonic::Code::InvalidArgument, "views is missing"));
    assert_eq!(tonic::Status::from(WireError::corrupt("data", "x")).code(), tonic::Code::DataLoss);
}
