//! Motion of instances by nodes, joints and clips, as plain data, and the places of nodes at a moment. Vertices follow
//! joints by linear blend skinning (glTF 2.0, 3.7.3).

mod clip;
mod nodes;

use glam::DAffine3;
use serde::{Deserialize, Serialize};

pub use clip::{Channel, Clip, Interpolation, Property};
pub(crate) use nodes::is_invertible;
pub use nodes::{Node, NodeTransform, TransformParts};

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
