//! Vertices that follow joints: linear blend skinning (glTF 2.0, 3.7.3).

use glam::DAffine3;
use serde::{Deserialize, Serialize};

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
    /// Index into [`Animation::nodes`](super::Animation::nodes).
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
