//! Motion of instances by nodes, joints and clips, as plain data, and the places of nodes at a moment.

mod clip;
mod nodes;
mod skin;

use glam::DAffine3;
use serde::{Deserialize, Serialize};

pub use clip::{Channel, Clip, Interpolation, Property};
pub(crate) use nodes::is_invertible;
pub use nodes::{Node, NodeTransform, TransformParts};
pub use skin::{Influence, Joint, MovingInstance};

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
