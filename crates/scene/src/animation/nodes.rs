//! The hierarchy of nodes that clips move.

use glam::{DAffine3, DQuat, DVec3, Quat, Vec3, Vec4Swizzles};
use serde::{Deserialize, Serialize};

use super::Animation;
use super::clip::Property;

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
