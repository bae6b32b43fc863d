//! Motion of instances by nodes, joints and clips, as plain data, and the places of nodes at a moment. Vertices follow
//! joints by linear blend skinning (glTF 2.0, 3.7.3).

mod clip;

use glam::{DAffine3, DQuat, DVec3, Quat, Vec3, Vec4Swizzles};
use serde::{Deserialize, Serialize};

pub use clip::{Channel, Clip, Interpolation, Property};

/// The moving part of a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// Parents come before their children.
    pub nodes: Vec<Node>,
    /// Places the nodes without a parent.
    pub world_from_source: DAffine3,
    /// All clips of the source.
    pub clips: Vec<Clip>,
    /// Index into `clips` of the one that plays. Without one, all nodes are at rest.
    pub playing: Option<u32>,
    /// Instances that follow nodes, each once.
    pub moving: Vec<MovingInstance>,
}

/// A clip that is not there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is no clip of the scene, which has {}", if clips.is_empty() { "none".into() } else { clips.join(", ") })]
pub struct UnknownClip {
    /// The name asked for.
    pub name: String,
    /// The names of the scene's clips.
    pub clips: Vec<String>,
}

impl Animation {
    /// The clip that plays.
    #[must_use]
    pub fn clip(&self) -> Option<&Clip> {
        self.clips.get(self.playing? as usize)
    }

    /// The period of the motion, seconds; `None` where nothing moves.
    #[must_use]
    pub fn period_s(&self) -> Option<f32> {
        self.clip().map(Clip::duration_s).filter(|&duration_s| duration_s > 0.0 && !self.moving.is_empty())
    }
}

/// An instance that follows nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MovingInstance {
    /// Index into [`Scene::instances`](crate::Scene::instances); its own transform is that of rest.
    pub instance: u32,
    /// The nodes that it follows; never empty.
    pub joints: Vec<Joint>,
    /// The joints of each vertex of its mesh. Without any, all of the mesh follows the first joint.
    pub influences: Vec<Influence>,
}

impl MovingInstance {
    /// Keeps the instance in place after its mesh's coordinates changed.
    pub(crate) fn follow_mesh(&mut self, old_from_new: &DAffine3) {
        self.joints.iter_mut().for_each(|joint| joint.joint_from_mesh *= *old_from_new);
    }
}

/// A node, and where a mesh is bound to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Index into [`Animation::nodes`].
    pub node: u32,
    /// The inverse bind matrix; finite. One without an inverse hides what follows it.
    pub joint_from_mesh: DAffine3,
}

/// The joints that a vertex follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Influence {
    /// Indices into [`MovingInstance::joints`].
    pub joints: [u16; 4],
    /// Their shares, from 0 to 1; the sum is 1.
    pub weights: [f32; 4],
}

impl Influence {
    /// A vertex that follows nothing; no valid scene has one.
    pub(crate) const NONE: Self = Self { joints: [0; 4], weights: [0.0; 4] };

    /// Joints, and their shares above 0.
    pub(crate) fn shares(&self) -> impl Iterator<Item = (usize, f32)> {
        let all = self.joints.into_iter().map(usize::from).zip(self.weights);
        all.filter(|(_, weight)| *weight > 0.0)
    }
}

/// A place that moves with its parent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// A node before this one.
    pub parent: Option<u32>,
    /// The transform to its parent, or to the source's space, while no channel moves it.
    pub rest: NodeTransform,
}

/// A node's transform to its parent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum NodeTransform {
    /// No channel moves it.
    Fixed(DAffine3),
    /// Channels replace the parts.
    Parts(TransformParts),
}

/// A transform that scales, then rotates, then translates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TransformParts {
    /// Metres.
    pub translation: Vec3,
    /// Unit quaternion.
    pub rotation: Quat,
    /// Factors along the node's axes.
    pub scale: Vec3,
}

impl TransformParts {
    /// The transform as a matrix. Rotations between keys of a spline are made unit here.
    #[must_use]
    pub fn parent_from_node(&self) -> DAffine3 {
        let rotation = self.rotation.as_dquat();
        let length = self.rotation.as_dquat().length();
        let rotation = if length > 1e-6 && length.is_finite() { rotation / length } else { DQuat::IDENTITY };
        DAffine3::from_scale_rotation_translation(self.scale.as_dvec3(), rotation, self.translation.as_dvec3())
    }

    /// The parts of a matrix without shear.
    #[must_use]
    pub fn of(parent_from_node: &DAffine3) -> Self {
        let (scale, rotation, translation): (DVec3, DQuat, DVec3) = parent_from_node.to_scale_rotation_translation();
        Self { translation: translation.as_vec3(), rotation: rotation.as_quat(), scale: scale.as_vec3() }
    }
}

impl NodeTransform {
    fn parent_from_node(&self) -> DAffine3 {
        match self {
            Self::Fixed(parent_from_node) => *parent_from_node,
            Self::Parts(parts) => parts.parent_from_node(),
        }
    }
}

impl Animation {
    /// The transforms of all nodes at a scene time. The clip that plays repeats.
    #[must_use]
    pub fn world_from_nodes(&self, scene_time_s: f32) -> Vec<DAffine3> {
        let mut transforms: Vec<NodeTransform> = self.nodes.iter().map(|node| node.rest).collect();
        if let Some(clip) = self.clip() {
            let clip_time_s = clip.time_s(scene_time_s);
            for channel in &clip.channels {
                if let Some(NodeTransform::Parts(parts)) = transforms.get_mut(channel.node as usize) {
                    let value = channel.value_at(clip_time_s);
                    match channel.property {
                        Property::Translation => parts.translation = value.xyz(),
                        Property::Rotation => parts.rotation = Quat::from_vec4(value),
                        Property::Scale => parts.scale = value.xyz(),
                    }
                }
            }
        }
        let mut placed: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for (node, transform) in self.nodes.iter().zip(&transforms) {
            let parent = node.parent.and_then(|parent| placed.get(parent as usize));
            placed.push(*parent.unwrap_or(&self.world_from_source) * transform.parent_from_node());
        }
        placed
    }
}

/// Whether a transform has an inverse, by the share of its determinant in the cube of its longest column.
pub(crate) fn is_invertible(transform: &DAffine3) -> bool {
    let largest = (0..3).fold(0f64, |most, i| most.max(transform.matrix3.col(i).length()));
    transform.is_finite() && (transform.matrix3 * largest.recip()).determinant().abs() > 1e-12
}
