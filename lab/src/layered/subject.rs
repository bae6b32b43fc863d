//! A scene with its views, and cubes of it.

use std::time::Instant;

use anyhow::Context as _;
use codec::encode_layered_image;
use depth_image::{
    Aabb, CubeGrid, CubeImages, LayeredDepthImage, LayeredLightField, LightDirections, LightFieldCamera, PinholeCamera,
    View, ViewPlanes,
};
use reconstruction::SampleSet;
use render::{GpuScene, LayerSelection, Lighting};
use scene::{Limits, MissingTextures, Scene};

use super::paper::LightField;
use crate::failures::stand::{Stand, description, work};

/// A scene on the device, and views around it, drawn directly.
pub struct Subject<'s> {
    pub stand: &'s Stand,
    pub name: &'static str,
    pub scene: Scene,
    pub on_device: GpuScene,
    pub lighting: Lighting,
    pub views: Vec<PinholeCamera>,
    pub truths: Vec<View>,
}

/// A layered depth cube of a scene, and the seconds that it took.
pub struct Cube {
    pub grid: CubeGrid,
    pub images: [LayeredDepthImage; 3],
    pub sample_s: f64,
}

impl<'s> Subject<'s> {
    /// Loads a built-in scene and draws views of it, which its bounds place.
    ///
    /// # Errors
    /// The device fails.
    pub fn of_views(
        stand: &'s Stand,
        name: &'static str,
        lighting: Lighting,
        views: impl Fn(&Aabb) -> Vec<PinholeCamera>,
    ) -> anyhow::Result<Self> {
        let scene = fixtures::spec(name)?.load(&Limits::default(), MissingTextures::Refuse)?;
        let on_device = stand.upload(&scene)?;
        let views = views(&scene.bounds());
        let truths = stand.views(&on_device, lighting, &views, ViewPlanes::WITH_DEPTH)?;
        Ok(Self { stand, name, scene, on_device, lighting, views, truths })
    }

    /// Samples and lights a cube; the fastest of several times counts.
    ///
    /// # Errors
    /// The device fails.
    pub fn cube(&self, side: u32, kept: LayerSelection, lighting: Lighting, times: usize) -> anyhow::Result<Cube> {
        let grid = CubeGrid::around(&self.scene.bounds(), side)?;
        let renderer = &self.stand.engine().renderer;
        let mut all = Vec::new();
        for _ in 0..times {
            let start = Instant::now();
            let [x, y, z] =
                [0, 1, 2].map(|axis| renderer.draw_layers(work(&self.on_device, lighting), &grid.camera(axis), kept));
            all.push(Cube { grid, images: [x?, y?, z?], sample_s: start.elapsed().as_secs_f64() });
        }
        all.into_iter().min_by(|a, b| a.sample_s.total_cmp(&b.sample_s)).context("a cube")
    }

    /// A light field of the scene with as many lines as the paper's, and the seconds that it takes.
    ///
    /// # Errors
    /// The device fails.
    pub fn light_field(
        &self,
        directions: LightDirections,
        lighting: Lighting,
    ) -> anyhow::Result<(LayeredLightField, f64)> {
        let camera = LightFieldCamera::around(self.scene.bounds(), directions, LightField::LINES);
        let start = Instant::now();
        let field = self.stand.engine().renderer.draw_light_field(work(&self.on_device, lighting), &camera)?;
        Ok((field, start.elapsed().as_secs_f64()))
    }

    /// Puts a cube on the device, with a light field if there is one. Gives also the seconds.
    ///
    /// # Errors
    /// The device fails.
    pub fn upload(&self, cube: &Cube, light_field: Option<LayeredLightField>) -> anyhow::Result<(SampleSet, f64)> {
        let images = CubeImages { grid: cube.grid, images: cube.images.clone(), light_field };
        let start = Instant::now();
        let description = description(&self.scene, self.lighting.highlight());
        let set = self.stand.reconstructor().upload_cube(&images, &description, Default::default())?;
        Ok((set, start.elapsed().as_secs_f64()))
    }
}

impl Cube {
    /// Bytes of all three images as samplers send them.
    ///
    /// # Errors
    /// Planes that do not belong together.
    pub fn encoded_bytes(&self) -> anyhow::Result<usize> {
        self.images.iter().map(|image| Ok(encode_layered_image(image)?.payload.len())).sum()
    }
}
