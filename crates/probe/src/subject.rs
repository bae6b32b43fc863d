//! The scene, and the viewpoints for which representations are measured.

use cluster::Refinement;
use depth_image::{
    Aabb, Camera, DepthImage, Environment, Illumination, PinholeCamera, SampleCamera, SampleImages, ViewCell,
    ViewPlanes,
};
use glam::{UVec2, Vec2};
use node::{DirectWork, Engine, EngineError, SampleSet, SampleWork};
use planner::ProbeView;

/// A row of a ladder, resolved for one scene and one size of views: how views are made, in terms that a node understands.
#[derive(Debug, Clone, PartialEq)]
pub struct Representation {
    /// The sampling method with its setting, as on the command line.
    pub sampling: String,
    /// The reconstruction method with its setting, as on the command line.
    pub method: String,
    /// The sample cameras, in the order in which images are taken.
    pub sample_cameras: Vec<Camera>,
}

/// A scene that is loaded on the device, and the way in which views of it are made.
#[derive(Debug, Clone, PartialEq)]
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
    /// How a view's colour is sampled.
    pub planes: ViewPlanes,
}

/// The viewpoints that are planned for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoints {
    /// The cell of the views: all places of its middle rectangle are equally likely.
    pub cell: ViewCell,
    /// Columns and rows of the views.
    pub view_px: UVec2,
    /// The seed of views that are drawn at random.
    pub seed: u64,
}

impl Viewpoints {
    /// The cameras of views.
    #[must_use]
    pub fn cameras(&self, views: &[ProbeView]) -> Vec<PinholeCamera> {
        let places = views.iter().map(|view| view.place(self.seed));
        places.map(|[x, y, _]| self.cell.camera_at(Vec2::new(x as f32, y as f32) * 2.0 - 1.0, self.view_px)).collect()
    }

    /// The cameras of the first common views.
    #[must_use]
    pub fn first(&self, count: usize) -> Vec<PinholeCamera> {
        self.cameras(&(0..count as u32).map(ProbeView::Screening).collect::<Vec<_>>())
    }
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
    /// All images of a representation's set, with the planes of its method.
    ///
    /// # Errors
    /// The engine does not know the method.
    pub fn sample_work(
        &self,
        engine: &dyn Engine,
        of: &Representation,
        light: Light,
    ) -> Result<SampleWork, EngineError> {
        Ok(SampleWork {
            scene_hash: self.scene_hash.clone(),
            cameras: of.sample_cameras.iter().copied().map(SampleCamera::Depth).collect(),
            tile_count: 1,
            wanted: (0..of.sample_cameras.len() as u32).collect(),
            sampling: of.sampling.clone(),
            planes: engine.sample_planes(&of.method)?,
            lighting: self.lighting(light).to_owned(),
            scene_time_s: self.scene_time_s,
            refinement: Refinement::default(),
            surfaces_by_rays: None,
        })
    }

    /// A set of these images.
    #[must_use]
    pub fn sample_set(&self, images: &[DepthImage], light: Light) -> SampleSet {
        SampleSet {
            scene_hash: self.scene_hash.clone(),
            images: SampleImages::Depth(images.to_vec()),
            volume: self.volume,
            background: self.background,
            illumination: self.illumination.clone(),
            lighting: self.lighting(light).to_owned(),
            scene_time_s: self.scene_time_s,
            traced_pixel_count: None,
            is_common: false,
        }
    }

    /// Views that are drawn from the scene.
    #[must_use]
    pub fn direct_work(&self, cameras: Vec<PinholeCamera>, light: Light, planes: ViewPlanes) -> DirectWork {
        DirectWork {
            scene_hash: self.scene_hash.clone(),
            cameras,
            lighting: self.lighting(light).to_owned(),
            scene_time_s: self.scene_time_s,
            planes,
            surfaces_by_rays: None,
        }
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
