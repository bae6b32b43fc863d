//! Validation of animations from any source.

use std::collections::HashSet;

use glam::Quat;

use crate::animation::{Animation, Channel, Influence, MovingInstance, Node, NodeTransform, Property, TransformParts};
use crate::error::{Fault, at_most};
use crate::validate::{each, ensure, is_near, require};
use crate::{Limits, Scene};

/// The error of a unit length or of a sum of weights that rounding explains.
const ROUNDING: f32 = 1e-2;

impl Scene {
    /// Checks every guarantee of the animation, and that all moments stay within [`MAX_COORDINATE_M`](crate::MAX_COORDINATE_M).
    pub(crate) fn check_animation(&self, limits: &Limits) -> Result<(), Fault> {
        let Some(animation) = &self.animation else { return Ok(()) };
        check_sizes(animation, limits)?;
        let mut nodes = (0u32..).zip(&animation.nodes);
        let are_in_order = nodes.all(|(number, node)| node.parent.is_none_or(|parent| parent < number));
        require(are_in_order, "animation, nodes", "a parent is not before its child")?;
        each("animation, node", &animation.nodes, check_node)?;
        each("clip", &animation.clips, |clip| {
            let mut channels = clip.channels.iter().enumerate();
            channels.try_for_each(|(number, channel)| {
                check_channel(channel, &animation.nodes).map_err(|why| format!("channel {number}: {why}"))
            })
        })?;
        let is_there = animation.playing.is_none_or(|playing| (playing as usize) < animation.clips.len());
        require(is_there, "animation, playing", "the clip does not exist")?;
        require(animation.world_from_source.is_finite(), "animation, world_from_source", "not finite")?;
        let instances: HashSet<u32> = animation.moving.iter().map(|moving| moving.instance).collect();
        require(instances.len() == animation.moving.len(), "animation, moving", "an instance moves twice")?;
        each("moving instance", &animation.moving, |moving| self.check_moving(moving, animation.nodes.len()))?;
        let meshes = animation.moving.iter().filter_map(|moving| self.mesh_of(moving));
        let moved = meshes.map(|mesh| mesh.vertices.len() as u64).sum();
        at_most("animation, vertices of all moving instances", moved, limits.vertices)?;
        self.check_reach(animation)
    }

    fn check_moving(&self, moving: &MovingInstance, nodes: usize) -> Result<(), String> {
        let is_there = (moving.instance as usize) < self.instances.len();
        ensure(is_there, || format!("instance {} does not exist", moving.instance))?;
        ensure(!moving.joints.is_empty(), || "it follows no joint".into())?;
        for (number, joint) in moving.joints.iter().enumerate() {
            ensure((joint.node as usize) < nodes, || format!("joint {number}: node {} does not exist", joint.node))?;
            ensure(joint.joint_from_mesh.is_finite(), || format!("joint {number}: its bind matrix is not finite"))?;
        }
        if moving.influences.is_empty() {
            return Ok(());
        }
        let vertices = self.mesh_of(moving).map_or(0, |mesh| mesh.vertices.len());
        ensure(vertices == moving.influences.len(), || {
            format!("it has joints of {} vertices, its mesh {vertices}", moving.influences.len())
        })?;
        match moving.influences.iter().position(|influence| !is_valid(influence, moving.joints.len())) {
            Some(bad) => Err(format!("vertex {bad}: its joints are out of range, or their weights")),
            None => Ok(()),
        }
    }

    /// Moments between the sampled ones are bounded by [`MovingInstance::posed`].
    fn check_reach(&self, animation: &Animation) -> Result<(), Fault> {
        // The box without points is nowhere.
        each("moving instance", &self.swept(animation), |b| {
            ensure(b.is_empty() || is_near(b.min) && is_near(b.max), || "it moves beyond 1e9 m".into())
        })
    }
}

fn check_sizes(animation: &Animation, limits: &Limits) -> Result<(), Fault> {
    let joints = animation.moving.iter().map(|moving| moving.joints.len() as u64).sum();
    let influences = animation.moving.iter().map(|moving| moving.influences.len() as u64).sum();
    let channels: u64 = animation.clips.iter().map(|clip| clip.channels.len() as u64).sum();
    let keys = animation.clips.iter().flat_map(|clip| &clip.channels).map(|channel| channel.times_s.len() as u64);
    at_most("animation, nodes", animation.nodes.len() as u64, limits.nodes)?;
    at_most("animation, joints", joints, limits.nodes)?;
    at_most("animation, vertices with joints", influences, limits.vertices)?;
    at_most("animation, clips", animation.clips.len() as u64, limits.attributes)?;
    at_most("animation, channels", channels, limits.json_objects)?;
    at_most("animation, keys", keys.sum(), limits.keys)
}

fn check_node(node: &Node) -> Result<(), String> {
    let is_rest_valid = match node.rest {
        NodeTransform::Fixed(transform) => transform.is_finite(),
        NodeTransform::Parts(TransformParts { translation, rotation, scale }) => {
            translation.is_finite() && scale.is_finite() && is_unit(rotation)
        }
    };
    ensure(is_rest_valid, || "its transform is not finite, or its rotation no unit quaternion".into())
}

/// The reason for which a channel cannot be played.
fn check_channel(channel: &Channel, nodes: &[Node]) -> Result<(), String> {
    let node = nodes.get(channel.node as usize);
    let has_parts = node.is_some_and(|node| matches!(node.rest, NodeTransform::Parts(_)));
    ensure(has_parts, || format!("node {} does not exist, or is fixed", channel.node))?;
    check_times(&channel.times_s)?;
    let stride = channel.interpolation.values_a_key();
    let expected = channel.times_s.len() * stride;
    ensure(channel.values.len() == expected, || {
        format!("{} values where its keys need {expected}", channel.values.len())
    })?;
    for (number, value) in channel.values.iter().enumerate() {
        ensure(value.is_finite(), || format!("value {number} is not finite"))?;
    }
    // Slopes of a spline have any length.
    for (number, value) in channel.values.iter().enumerate().skip(stride / 2).step_by(stride) {
        let is_valid = channel.property != Property::Rotation || is_unit(Quat::from_vec4(*value));
        ensure(is_valid, || format!("value {number} is no unit quaternion"))?;
    }
    Ok(())
}

/// The reason for which times are no keys.
pub(crate) fn check_times(times_s: &[f32]) -> Result<(), String> {
    ensure(!times_s.is_empty(), || "it has no keys".into())?;
    for (number, time) in times_s.iter().enumerate() {
        ensure(time.is_finite() && *time >= 0.0, || format!("time {number} is negative or not finite"))?;
    }
    for (number, pair) in times_s.windows(2).enumerate() {
        ensure(pair[0] <= pair[1], || format!("time {} is before the one before it", number + 1))?;
    }
    Ok(())
}

fn is_unit(rotation: Quat) -> bool {
    (rotation.length_squared() - 1.0).abs() < ROUNDING
}

fn is_valid(influence: &Influence, joints: usize) -> bool {
    influence.weights.iter().all(|weight| (0.0..=1.0 + ROUNDING).contains(weight))
        && (influence.weights.iter().sum::<f32>() - 1.0).abs() < ROUNDING
        && influence.joints.iter().all(|&joint| usize::from(joint) < joints)
}
