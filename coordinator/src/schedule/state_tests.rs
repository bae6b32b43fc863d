use depth_image::{Aabb, Camera, Illumination, PinholeCamera};
use glam::{UVec2, Vec3};
use wire::{SceneHash, SceneRef, Timeline};

use super::*;

fn join(name: &str, incarnation: u64, plan_epoch: u64) -> Event {
    let node = NodeStatus {
        node_name: name.to_owned(),
        address: format!("http://{name}"),
        device_name: "cpu".to_owned(),
        is_software: true,
    };
    Event::Joined { incarnation, join: JoinCluster { node, plan_epoch } }
}

fn opening(session: u64, policy: PolicyChoice) -> Event {
    let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
    let workload = Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: vec![Camera::Pinhole(camera); 4],
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        method: "joint_carve".to_owned(),
        codec: "lz4".to_owned(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background_linear: Vec3::ZERO,
        timeline: Timeline::still(0.0),
        illumination: Illumination::default(),
        refinement_steps: 1,
    };
    let costs = Costs {
        sample_image_s: 0.1,
        direct_view_s: 0.1,
        reconstruct_view_s: 0.01,
        load_set_s: 0.0,
        encode_view_s: 0.0,
        in_order: false,
    };
    Event::Opened(Box::new(Opening { session, workload, views_per_set: 40, policy, forced_samplers: None, costs }))
}

fn cluster(nodes: u64) -> ClusterState {
    let mut state = ClusterState::default();
    for i in 0..nodes {
        assert_eq!(state.step(join(&format!("n{i}"), i, 0)), []);
    }
    state
}

fn applied(commands: &[Command]) -> &Assignment {
    match commands.last() {
        Some(Command::Apply { plan, .. }) => &plan.assignment,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_member_has_a_role() {
    let mut state = cluster(5);
    let commands = state.step(opening(1, PolicyChoice::Pipeline));
    let plan = applied(&commands);
    assert_eq!(plan.samplers.len() + plan.compositors.len(), 5);
    let images: usize = plan.samplers.iter().map(|share| share.image_indices.len()).sum();
    assert_eq!(images, 4);
    let commands = state.step(opening(2, PolicyChoice::Direct));
    let plan = applied(&commands);
    assert_eq!((plan.samplers.len(), plan.compositors.len()), (0, 5));
}

#[test]
fn one_node_has_both_roles() {
    let commands = cluster(1).step(opening(1, PolicyChoice::Pipeline));
    let plan = applied(&commands);
    assert_eq!((plan.images_of("n0", 0).len(), plan.composites("n0")), (4, true));
}

#[test]
fn epochs_rise_above_what_any_node_has_seen() {
    let mut state = cluster(2);
    assert_eq!(applied(&state.step(opening(1, PolicyChoice::Auto))).plan_epoch, 1);
    state.step(join("late", 9, 41));
    assert_eq!(applied(&state.step(opening(2, PolicyChoice::Auto))).plan_epoch, 42);
}

#[test]
fn a_session_ends_when_a_member_leaves_or_another_opens() {
    let mut state = cluster(2);
    state.step(opening(1, PolicyChoice::Auto));
    let commands = state.step(opening(2, PolicyChoice::Auto));
    assert!(matches!(&commands[0], Command::End { session: 1, .. }));
    let ended = state.step(Event::Left { incarnation: 1, node_name: "n1".to_owned() });
    assert_eq!(ended, [Command::End { session: 2, reason: "node n1 left the cluster".to_owned() }]);
    assert_eq!(state.status().nodes.len(), 1);
}

#[test]
fn of_two_processes_with_one_name_the_later_counts() {
    let mut state = cluster(1);
    state.step(opening(1, PolicyChoice::Auto));
    assert!(matches!(&state.step(join("n0", 7, 1))[..], [Command::End { session: 1, .. }]));
    state.step(opening(2, PolicyChoice::Auto));
    assert_eq!(state.step(Event::Left { incarnation: 0, node_name: "n0".to_owned() }), [], "the earlier one's end");
    assert_eq!(state.status().nodes.len(), 1);
}

#[test]
fn without_nodes_a_session_is_refused_and_closed_ones_are_forgotten() {
    let refused = ClusterState::default().step(opening(1, PolicyChoice::Auto));
    assert_eq!(refused, [Command::Refuse { session: 1, error: ChoiceError::NoNodes }]);
    let mut state = cluster(1);
    state.step(opening(1, PolicyChoice::Auto));
    state.step(Event::Closed { session: 1 });
    assert_eq!(state.step(Event::Left { incarnation: 0, node_name: "n0".to_owned() }), []);
}
