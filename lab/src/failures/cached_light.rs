//! Views whose light comes from samples, beside views that are drawn directly.

use std::sync::Arc;

use depth_image::{
    DepthImage, Environment, Illumination, Light, LightCacheQuality, PinholeCamera, ProvenanceKind, View, ViewPlanes,
    linear_from_srgb8,
};
use fixtures::{quad, unit_cube};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use render::{DrawWork, GpuScene, LightCache, Lighting, SamplePlanes, Visibility};
use sampling::{SampleWork, SamplingMethod};
use scene::{Instance, Scene};

use super::measures::{depths, is_kind, mean};
use super::stand::{Stand, pinholes, work};

/// A box with sides along the axes.
#[derive(Debug, Clone, Copy)]
pub struct Cuboid {
    pub center: Vec3,
    pub size_m: Vec3,
}

/// A scene under one lighting at one moment. Views look light up in samples where there are any.
#[derive(Clone)]
pub struct LitScene<'s> {
    stand: &'s Stand,
    scene: Arc<GpuScene>,
    lighting: Lighting,
    samples: Option<(Arc<LightCache>, LightCacheQuality)>,
    visibility: Visibility,
    pub scene_time_s: f32,
}

/// Some pixels of a view, and their true colours.
pub struct ComparedPixels {
    pub camera: PinholeCamera,
    pub truth: View,
    pub pixels: Vec<usize>,
}

/// A white floor through the origin, with boxes.
pub fn floor_with(cuboids: &[Cuboid], half_size_m: f32, illumination: Illumination) -> Scene {
    let mut scene = quad(Vec3::ZERO, half_size_m, Vec3::Y, [255; 3]);
    scene.materials[0].unlit = false;
    scene.meshes.extend(unit_cube().meshes);
    scene.instances.extend(cuboids.iter().map(|cuboid| {
        let world_from_mesh = Affine3A::from_translation(cuboid.center) * Affine3A::from_scale(cuboid.size_m);
        Instance { mesh: 1, world_from_mesh }
    }));
    Scene { illumination, ..scene }
}

/// Light from one direction, with sharp shadows, and none from the environment.
pub fn sun(towards: Vec3) -> Illumination {
    let sun = Light::Directional {
        towards_light_in_world: towards.normalize_or(Vec3::Y),
        irradiance_linear: Vec3::splat(0.8),
        angular_radius_rad: 0.0,
    };
    Illumination { lights: vec![sun], environment: Environment::uniform(Vec3::ZERO) }
}

impl<'s> LitScene<'s> {
    /// Surfaces are found by triangles.
    pub fn new(stand: &'s Stand, scene: &Scene, lighting: &str) -> anyhow::Result<Self> {
        Ok(Self {
            stand,
            scene: Arc::new(stand.upload(scene)?),
            lighting: lighting.parse()?,
            samples: None,
            visibility: Visibility::Triangles,
            scene_time_s: 0.0,
        })
    }

    /// Surfaces are found by rays if that is faster in this view.
    pub fn by_faster_way(mut self, camera: &PinholeCamera) -> anyhow::Result<Self> {
        let choice = self.stand.engine().renderer.choice(&self.scene, camera, self.scene_time_s)?;
        if choice.rays_are_faster() {
            self.visibility = Visibility::Rays;
        }
        Ok(self)
    }

    /// The scene in another light, without samples.
    pub fn in_light(&self, lighting: &str) -> anyhow::Result<Self> {
        Ok(Self { lighting: lighting.parse()?, samples: None, ..self.clone() })
    }

    /// The scene with light from samples.
    pub fn with_samples(&self, images: &[DepthImage], quality: LightCacheQuality) -> anyhow::Result<Self> {
        let work = self.work();
        let cache = self.stand.engine().renderer.upload_light(work.scene, work.lighting, images, work.turn)?;
        Ok(Self { samples: Some((Arc::new(cache), quality)), ..self.clone() })
    }

    /// The scene with light from the same samples at another quality; without samples nothing changes.
    pub fn at_quality(&self, quality: LightCacheQuality) -> Self {
        let samples = self.samples.as_ref().map(|(cache, _)| (cache.clone(), quality));
        Self { samples, ..self.clone() }
    }

    fn work(&self) -> DrawWork<'_> {
        DrawWork { scene_time_s: self.scene_time_s, visibility: self.visibility, ..work(&self.scene, self.lighting) }
    }

    /// Samples of light. They hold no reflections: what mirrors show is each view's own.
    pub fn samples(&self, cameras: &[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>> {
        self.samples_by(SamplingMethod::CONVENTIONAL, cameras)
    }

    /// Samples of light by any method.
    pub fn samples_by(&self, sampling: SamplingMethod, cameras: &[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>> {
        self.draw_samples(sampling, cameras, SamplePlanes { light: true, ..SamplePlanes::default() })
    }

    /// Samples of colour, for methods that make views from images alone.
    pub fn color_samples(&self, cameras: &[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>> {
        self.draw_samples(SamplingMethod::CONVENTIONAL, cameras, SamplePlanes::default())
    }

    fn draw_samples(
        &self,
        method: SamplingMethod,
        cameras: &[PinholeCamera],
        planes: SamplePlanes,
    ) -> anyhow::Result<Vec<DepthImage>> {
        let lighting = self.lighting.without_reflections().unwrap_or(self.lighting);
        let draw = DrawWork { lighting, ..self.work() };
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let cameras = &pinholes(cameras);
        let work = SampleWork { draw, cameras, tile_count: 1, wanted: &wanted, method, planes };
        Ok(self.stand.sampler().sample(&work)?)
    }

    pub fn views(&self, cameras: &[PinholeCamera], planes: ViewPlanes) -> anyhow::Result<Vec<View>> {
        let renderer = &self.stand.engine().renderer;
        let views = match &self.samples {
            Some((cache, quality)) => renderer.draw_cached_views(self.work(), cache, *quality, cameras, planes),
            None => renderer.draw_views(self.work(), cameras, planes),
        };
        Ok(views?)
    }

    /// A view with the light of samples where they know it.
    pub fn cached(
        &self,
        images: &[DepthImage],
        quality: LightCacheQuality,
        camera: PinholeCamera,
    ) -> anyhow::Result<View> {
        Ok(self.with_samples(images, quality)?.views(&[camera], ViewPlanes::ALL)?.remove(0))
    }

    /// A view that is lit by its own rays.
    pub fn direct(&self, camera: PinholeCamera) -> anyhow::Result<View> {
        Ok(self.views(&[camera], ViewPlanes::ALL)?.remove(0))
    }
}

impl ComparedPixels {
    /// The mean absolute difference of 8-bit colours where light comes from samples.
    pub fn error(&self, lit: &LitScene<'_>, images: &[DepthImage], quality: LightCacheQuality) -> anyhow::Result<f64> {
        Ok(color_error(&self.truth, &lit.cached(images, quality, self.camera)?, &self.pixels))
    }
}

/// The share of a view's surfaces whose light no sample knew.
pub fn unknown_share(view: &View) -> f64 {
    let [unknown, known] =
        [ProvenanceKind::LitHere, ProvenanceKind::Hit].map(|kind| is_kind(view, kind).filter(|is| *is).count() as f64);
    unknown / (unknown + known)
}

/// The pixels of a view whose surfaces are at some places in the world.
pub fn pixels_where(camera: &PinholeCamera, view: &View, is_wanted: impl Fn(Vec3) -> bool) -> Vec<usize> {
    let shown = depths(view).iter().enumerate().filter(|&(index, &depth)| {
        let place = UVec2::new(index as u32 % camera.size_px.x, index as u32 / camera.size_px.x);
        let ray = camera.ray(place.as_vec2() + Vec2::splat(0.5));
        depth > 0.0 && is_wanted(ray.at(depth.recip()))
    });
    shown.map(|(index, _)| index).collect()
}

/// The mean absolute difference of 8-bit colours over some pixels.
fn color_error(truth: &View, view: &View, pixels: &[usize]) -> f64 {
    let channels = pixels.iter().flat_map(|&pixel| 3 * pixel..3 * pixel + 3);
    mean(channels.map(|channel| f64::from(truth.srgb8[channel].abs_diff(view.srgb8[channel])))).unwrap_or(f64::NAN)
}

/// The mean linear green light of some pixels.
pub fn mean_light(view: &View, pixels: &[usize]) -> f64 {
    mean(pixels.iter().map(|&pixel| f64::from(linear_from_srgb8(view.srgb8[3 * pixel + 1])))).unwrap_or(f64::NAN)
}
