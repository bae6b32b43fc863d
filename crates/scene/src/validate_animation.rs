//! Validation of animations from any source.

use std::collections::HashSet;

use glam::{Quat, Vec4};

use crate::animation::{
    Animation, Channel, Clip, Influence, Interpolation, MovingInstance, Node, NodeTransform, Property, TransformParts,
};
use crate::error::{Fault, at_most};
use crate::limits::MAX_COORDINATE_M;
use crate::validate::{each, ensure, require};
use crate::{Limits, Scene};

/// The error of a unit length or of a sum of weights that rounding explains.
const ROUNDING: f32 = 1e-2;

impl Scene {
    /// Checks every guarantee of the animation, and that all moments stay within [`MAX_COORDINATE_M`].
    pub(crate) fn check_animation(&self, limits: &Limits) -> Result<(), Fault> {
        let Some(animation) = &self.animation else { return Ok(()) };
        check_sizes(animation, limits)?;
        let follows = |(number, node): (usize, &Node)| node.parent.is_none_or(|parent| (parent as usize) < number);
        let are_in_order = animation.nodes.iter().enumerate().all(follows);
        require(are_in_order, "animation, nodes", "a parent is not before its child")?;
        each("animation, node", &animation.nodes, check_node)?;
        each("clip", &animation.clips, |clip| check_clip(clip, &animation.nodes))?;
        let is_there = animation.playing.is_none_or(|playing| (playing as usize) < animation.clips.len());
        require(is_there, "animation, playing", "the clip does not exist")?;
        require(animation.world_from_source.is_finite(), "animation, world_from_source", "not finite")?;
        let instances: HashSet<u32> = animation.moving.iter().map(|moving| moving.instance).collect();
        require(instances.len() == animation.moving.len(), "animation, moving", "an instance moves twice")?;
        each("moving instance", &animation.moving, |moving| self.check_moving(moving, animation.nodes.len()))?;
        let mesh = |moving: &MovingInstance| self.meshes.get(self.instances[moving.instance as usize].mesh as usize);
        let moved = animation.moving.iter().filter_map(mesh).map(|mesh| mesh.vertices.len() as u64).sum();
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
        let mesh = self.instances.get(moving.instance as usize).and_then(|i| self.meshes.get(i.mesh as usize));
        let vertices = mesh.map_or(0, |mesh| mesh.vertices.len());
        ensure(vertices == moving.influences.len(), || {
            format!("it has joints of {} vertices, its mesh {vertices}", moving.influences.len())
        })?;
        let bad = moving.influences.iter().position(|influence| !is_valid(influence, moving.joints.len()));
        ensure(bad.is_none(), || format!("vertex {}: its joints are out of range, or their weights", bad.unwrap_or(0)))
    }

    /// Moments between the sampled ones are bounded by [`Animation::posed`].
    fn check_reach(&self, animation: &Animation) -> Result<(), Fault> {
        let is_near = |b: &depth_image::Aabb| {
            // A comparison with NaN is false. The box without points is nowhere.
            b.is_empty() || [b.min, b.max].iter().all(|corner| corner.abs().max_element() <= MAX_COORDINATE_M)
        };
        let far = self.swept(animation).iter().position(|b| !is_near(b));
        let why = "it moves beyond 1e9 m";
        far.map_or(Ok(()), |number| Err(Fault::malformed(format_args!("moving instance {number}"), why)))
    }
}

fn check_sizes(animation: &Animation, limits: &Limits) -> Result<(), Fault> {
    let joints = animation.moving.iter().map(|moving| moving.joints.len() as u64).sum();
    let influences = animation.moving.iter().map(|moving| moving.influences.len() as u64).sum();
    let channels = || animation.clips.iter().flat_map(|clip| &clip.channels);
    at_most("animation, nodes", animation.nodes.len() as u64, limits.nodes)?;
    at_most("animation, joints", joints, limits.nodes)?;
    at_most("animation, vertices with joints", influences, limits.vertices)?;
    at_most("animation, clips", animation.clips.len() as u64, limits.attributes)?;
    at_most("animation, channels", channels().count() as u64, limits.json_objects)?;
    at_most("animation, keys", channels().map(|channel| channel.times_s.len() as u64).sum(), limits.keys)
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

fn check_clip(clip: &Clip, nodes: &[Node]) -> Result<(), String> {
    for (number, channel) in clip.channels.iter().enumerate() {
        check_channel(channel, nodes).map_err(|why| format!("channel {number}: {why}"))?;
    }
    Ok(())
}

/// The reason for which a channel cannot be played.
pub(crate) fn check_channel(channel: &Channel, nodes: &[Node]) -> Result<(), String> {
    let has_parts = |node: &Node| matches!(node.rest, NodeTransform::Parts(_));
    ensure(nodes.get(channel.node as usize).is_some_and(has_parts), || {
        format!("node {} does not exist, or is fixed", channel.node)
    })?;
    check_times(&channel.times_s)?;
    let expected = channel.times_s.len() * channel.interpolation.values_a_key();
    ensure(channel.values.len() == expected, || {
        format!("{} values where its keys need {expected}", channel.values.len())
    })?;
    let bad = channel.values.iter().position(|value| !value.is_finite());
    ensure(bad.is_none(), || format!("value {} is not finite", bad.unwrap_or(0)))?;
    let turns = channel.property == Property::Rotation;
    let of_keys = |i: &usize| channel.interpolation != Interpolation::CubicSpline || i % 3 == 1;
    let is_turn = |value: &Vec4| is_unit(Quat::from_vec4(*value));
    let bad = (0..channel.values.len()).filter(of_keys).find(|&i| turns && !is_turn(&channel.values[i]));
    ensure(bad.is_none(), || format!("value {} is no unit quaternion", bad.unwrap_or(0)))
}

/// The reason for which times are no keys.
pub(crate) fn check_times(times_s: &[f32]) -> Result<(), String> {
    ensure(!times_s.is_empty(), || "it has no keys".into())?;
    let bad = times_s.iter().position(|time| !(time.is_finite() && *time >= 0.0));
    ensure(bad.is_none(), || format!("time {} is negative or not finite", bad.unwrap_or(0)))?;
    let falls = times_s.windows(2).position(|pair| pair[1] < pair[0]);
    ensure(falls.is_none(), || format!("time {} is before the one before it", falls.unwrap_or(0) + 1))
}

fn is_unit(rotation: Quat) -> bool {
    (rotation.length_squared() - 1.0).abs() < ROUNDING
}

fn is_valid(influence: &Influence, joints: usize) -> bool {
    let are_weights = influence.weights.iter().all(|weight| (0.0..=1.0 + ROUNDING).contains(weight));
    are_weights
        && (influence.weights.iter().sum::<f32>() - 1.0).abs() < ROUNDING
        && influence.joints.iter().all(|&joint| usize::from(joint) < joints)
}
