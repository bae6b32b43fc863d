//! The scene, and the views for which representations are measured.

use codec::FrameCodec;
use depth_image::{Aabb, Environment, Illumination, PinholeCamera, ViewCell, ViewPlanes};
use glam::{UVec2, Vec2};
use planner::ProbeView;

/// What is measured: a scene that is loaded on the device, and views of it.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The scene.
    pub scene_hash: String,
    /// The bounds of reconstruction.
    pub volume: Aabb,
    /// Radiance of rays that leave the scene.
    pub background: Environment,
    /// The scene's lamps and environment.
    pub illumination: Illumination,
    /// The light of the session, as on the command line.
    pub lighting: String,
    /// The light of screening: cheap, since geometry decides.
    pub screening_lighting: String,
    /// The moment.
    pub scene_time_s: f32,
    /// The cell of the views.
    pub cell: ViewCell,
    /// Columns and rows of the views.
    pub view_px: UVec2,
    /// How a view's colour is sampled.
    pub planes: ViewPlanes,
    /// The codec of delivered views; its loss does not count.
    pub codec: FrameCodec,
    /// The seed of views that are drawn at random.
    pub seed: u64,
}

/// The light of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Light {
    /// That of screening.
    Screening,
    /// The session's.
    Session,
}

impl Subject {
    /// The camera of a view: all places of the cell are equally likely.
    #[must_use]
    pub fn camera(&self, view: ProbeView) -> PinholeCamera {
        let [x, y, _] = view.place(self.seed);
        self.cell.camera_at(Vec2::new(x as f32, y as f32) * 2.0 - 1.0, self.view_px)
    }

    /// The light as on the command line.
    #[must_use]
    pub fn lighting(&self, light: Light) -> &str {
        match light {
            Light::Screening => &self.screening_lighting,
            Light::Session => &self.lighting,
        }
    }
}
