//! A scene on the device, its views, and light for them.

use std::sync::Arc;
use std::time::Instant;

use depth_image::{Antialias, Camera, LightCacheQuality, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use render::{DrawWork, GpuScene, LightCache, Lighting, Refinement, SamplePlanes, Visibility};
use scene::Scene;

use super::subjects::Viewpoints;
use crate::reference_views::encoded_and_decoded;
use crate::statistics::median;

/// Positions within a pixel.
pub const SAMPLES_A_PIXEL: u32 = 4;
/// The lighting of samples and of views that use them.
pub const LIGHTING: &str = "soft 16, occlusion 16";
/// Direct drawing with 16 rays to a lamp and of occlusion at each position.
pub const REFERENCE_LIGHTING: &str = "soft 64, occlusion 64";
/// Timed runs of every row; no more are made once they have taken this long.
const RUNS: usize = 3;
const MOST_TIMED_S: f64 = 4.0;
/// Columns and rows of the view that builds pipelines before runs are timed.
const WARM_UP_PX: UVec2 = UVec2::new(64, 36);

/// A scene on the device at a moment.
pub struct Stage {
    engine: Arc<GpuEngine>,
    scene: GpuScene,
    visibility: Visibility,
    pub viewpoints: Viewpoints,
    pub scene_time_s: f32,
}

/// How views are lit.
#[derive(Clone, Copy)]
pub enum ViewLight<'a> {
    Direct(Lighting),
    Cached { cache: &'a LightCache, lighting: Lighting, quality: LightCacheQuality },
}

/// Views without depth, and the milliseconds that each takes.
pub struct TimedViews {
    pub views: Vec<View>,
    pub ms: f64,
}

impl Stage {
    pub fn new(engine: &Arc<GpuEngine>, scene: &Scene, viewpoints: Viewpoints) -> anyhow::Result<Self> {
        let scene = GpuScene::upload(engine.renderer.gpu(), scene)?;
        // One way for all rows, so that their surfaces are equal.
        let is_by_rays = match viewpoints.views.first() {
            Some(view) => engine.renderer.choice(&scene, view, 0.0)?.rays_are_faster(),
            None => false,
        };
        let visibility = if is_by_rays { Visibility::Rays } else { Visibility::Triangles };
        Ok(Self { engine: engine.clone(), scene, visibility, viewpoints, scene_time_s: 0.0 })
    }

    fn work(&self, lighting: Lighting) -> DrawWork<'_> {
        DrawWork {
            scene: &self.scene,
            lighting,
            scene_time_s: self.scene_time_s,
            visibility: self.visibility,
            refinement: Refinement::default(),
            turn: Default::default(),
        }
    }

    /// Samples of light as compositors decode them. Views show mirrors themselves.
    pub fn cache(&self, lighting: Lighting) -> anyhow::Result<LightCache> {
        let lighting = lighting.without_reflections().unwrap_or(lighting);
        let cameras: Vec<Camera> = self.viewpoints.samples.iter().copied().map(Camera::Pinhole).collect();
        let planes = SamplePlanes { light: true, ..SamplePlanes::default() };
        let renderer = &self.engine.renderer;
        let images = renderer.draw_depth_images(self.work(lighting), &cameras, planes)?;
        let images = images.iter().map(encoded_and_decoded).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(renderer.upload_light(&self.scene, lighting, &images, Default::default())?)
    }

    pub fn draw(
        &self,
        light: ViewLight<'_>,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> anyhow::Result<Vec<View>> {
        let renderer = &self.engine.renderer;
        let views = match light {
            ViewLight::Direct(lighting) => renderer.draw_views(self.work(lighting), cameras, planes),
            ViewLight::Cached { cache, lighting, quality } => {
                renderer.draw_cached_views(self.work(lighting), cache, quality, cameras, planes)
            }
        };
        Ok(views?)
    }

    /// All views under each light, and the time of a view: the median of runs that draw all at once. The lights take turns.
    pub fn timed(&self, lights: &[ViewLight<'_>], antialias: Antialias) -> anyhow::Result<Vec<TimedViews>> {
        let cameras = &self.viewpoints.views;
        let planes = ViewPlanes { antialias, ..ViewPlanes::COLOR };
        for &light in lights {
            self.draw(light, &[cameras[0].resized(WARM_UP_PX)], planes)?;
        }
        let mut runs = vec![Vec::new(); lights.len()];
        let mut views = vec![Vec::new(); lights.len()];
        for _ in 0..RUNS {
            for (place, &light) in lights.iter().enumerate() {
                if runs[place].iter().sum::<f64>() < MOST_TIMED_S {
                    let start = Instant::now();
                    views[place] = self.draw(light, cameras, planes)?;
                    runs[place].push(start.elapsed().as_secs_f64());
                }
            }
        }
        let ms = |seconds: Vec<f64>| median(seconds) * 1e3 / cameras.len() as f64;
        Ok(runs.into_iter().zip(views).map(|(seconds, views)| TimedViews { views, ms: ms(seconds) }).collect())
    }
}

/// Positions within a pixel of the study's views.
pub fn antialias() -> Antialias {
    Antialias::of(SAMPLES_A_PIXEL).unwrap_or_default()
}
