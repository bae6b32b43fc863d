//! Views and depth images of scenes, in as few submissions as memory allows.

use std::{collections::VecDeque, sync::Arc};

use depth_image::{
    Antialias, Camera, DepthImage, Highlight, LayeredDepthImage, LayeredLightField, LightCacheQuality,
    LightFieldCamera, LightPlanes, ParallelCamera, PinholeCamera, ProvenanceKind, View, ViewPlanes,
};
use glam::UVec2;
use gpu::{Gpu, GpuError, Pool, TablePool, Templates, Turn, WorkClass};
use parking_lot::Mutex;

use crate::batch::{Batch, batches};
use crate::grid::words_a_pixel;
use crate::known_samples::{ImageSequence, KnownSamples};
use crate::layered;
use crate::light_samples::{CachedLight, CoveredBy, LightCache, LookUpTests};
use crate::planes::{self, Output};
use crate::smooth_light::smoothed;
use crate::visibility::{Choice, Costs, Visibility};
use crate::work::{DrawWork, LayerSelection, SamplePlanes};
use crate::{
    GpuScene, GridVisibility, Lighting, RenderError,
    layers::{self, LayerKind, Layers},
    redundancy_test::RedundancyTest,
    stages::Stages,
};

/// Pixels in one submission: bounds the memory for surfaces, light and read-back.
const PIXELS_A_SUBMISSION: usize = 1 << 20;

/// Pixels of the smallest picture that is timed. Smaller ones say little about larger ones.
const LEAST_TIMED_PX: usize = 256 * 256;

/// Scenes whose costs are remembered.
const MOST_SCENES: usize = 64;

/// Draws on one device.
pub struct Renderer {
    gpu: Arc<Gpu>,
    stages: Stages,
    tables: TablePool,
    layers: Pool<LayerKind, Layers>,
    /// By scene; the one that was measured first is at the front.
    costs: Mutex<VecDeque<(u64, Costs)>>,
}

impl Renderer {
    /// Pipelines are built when first used. `templates` may hold redundancy tests for [`Renderer::draw_image_sequence`].
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>, templates: Templates) -> Self {
        let stages = Stages::new(gpu, &Arc::new(templates));
        let tables = TablePool::new(gpu);
        Self { gpu: gpu.clone(), stages, tables, layers: layers::pool(gpu), costs: Mutex::default() }
    }

    /// The device.
    #[must_use]
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// Finished views: the method `direct`. Provenance of a surface is a hit without cameras.
    ///
    /// # Errors
    /// A camera that is not valid (all are checked first), or the device.
    pub fn draw_views(
        &self,
        work: DrawWork<'_>,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> Result<Vec<View>, RenderError> {
        self.views(work, None, cameras, planes, ProvenanceKind::Hit)
    }

    /// Puts samples of the light of this scene on the device, and checks them.
    ///
    /// # Errors
    /// Samples that are not of light, not of this scene's lamps, or beyond the device's limits.
    pub fn upload_light(
        &self,
        scene: &GpuScene,
        lighting: Lighting,
        images: &[DepthImage],
        turn: Turn,
    ) -> Result<LightCache, RenderError> {
        let share_words = if lighting.is_traced() { LightPlanes::share_planes(scene.light_count) } else { 0 };
        if !lighting.is_indirect() {
            return LightCache::upload(&self.tables, images, share_words, turn);
        }
        let smooth: Vec<DepthImage> = images.iter().map(smoothed).collect();
        LightCache::upload(&self.tables, &smooth, share_words, turn)
    }

    /// Finished views: surfaces from the scene, their light from samples where these know it. `work` has the light of the
    /// samples; other points are lit by its rays, or fewer. With `exact`, and under light that traces no rays, no sample is asked:
    /// such views are those of [`Renderer::draw_views`] to the bit.
    ///
    /// # Errors
    /// As [`Renderer::draw_views`].
    pub fn draw_cached_views(
        &self,
        work: DrawWork<'_>,
        cache: &LightCache,
        quality: LightCacheQuality,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> Result<Vec<View>, RenderError> {
        let tests = LookUpTests::new(quality).filter(|_| work.lighting.is_traced());
        let cached = tests.map(|tests| CachedLight { cache, tests });
        let lighting = if cached.is_some() { work.lighting.for_unknown_points(quality) } else { work.lighting };
        self.views(DrawWork { lighting, ..work }, cached, cameras, planes, ProvenanceKind::LitHere)
    }

    /// Views, with light that is looked up first where there is any. `lit` is the provenance of surfaces without it.
    fn views(
        &self,
        work: DrawWork<'_>,
        cached: Option<CachedLight<'_>>,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
        lit: ProvenanceKind,
    ) -> Result<Vec<View>, RenderError> {
        let cameras = as_cameras(cameras);
        self.check(&cameras)?;
        let output = Output {
            antialias: planes.antialias,
            depth: planes.inverse_depth || planes.provenance,
            triangle_normal: cached.is_some(),
            provenance: cached.is_some() && planes.provenance,
            ..views_output(work)
        };
        let request = Batch { tone: planes.tone, cached, ..Batch::new(work, output) };
        self.draw(request, &cameras, |words, cameras| planes::views(words, output, cameras, planes, lit))
    }

    /// Depth images, in as few submissions as memory allows.
    ///
    /// # Errors
    /// A camera that is not valid, or the device (surface ids by triangles need its primitive index).
    pub fn draw_depth_images(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        planes: SamplePlanes,
    ) -> Result<Vec<DepthImage>, RenderError> {
        self.check(cameras)?;
        self.images(work, cameras, planes, None, [None; 2])
    }

    /// As [`Renderer::draw_depth_images`] for images of a set, but pixels become holes whose light views find in an image before: where
    /// the four texels around the places of all points within a pixel lie on the same surface, as in [`Renderer::draw_cached_views`],
    /// and are not coarser by more than half. Only the surfaces of other images are drawn. `numbers` are the places in the set of
    /// the images of `cameras`, which may show parts of them.
    ///
    /// # Errors
    /// As [`Renderer::draw_depth_images`]; cameras that are no pinholes, or more than 16.
    pub fn draw_uncovered_images(
        &self,
        work: DrawWork<'_>,
        set: &[Camera],
        numbers: &[u32],
        cameras: &[Camera],
        planes: SamplePlanes,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let before = numbers.iter().max().map_or(0, |&number| number as usize);
        if before == 0 {
            return self.draw_depth_images(work, cameras, planes);
        }
        let of_surfaces = SamplePlanes { light: true, ..SamplePlanes::default() };
        let surfaces = self.draw_depth_images(work.unlit(), &set[..before], of_surfaces)?;
        let surfaces = LightCache::upload(&self.tables, &surfaces, 0, work.turn)?;
        self.check(cameras)?;
        let planes = SamplePlanes { antialias: Antialias::NONE, ..planes };
        self.images(work, cameras, planes, Some(CoveredBy { surfaces: &surfaces, numbers, first: 0 }), [None; 2])
    }

    /// All surfaces on the lines of a parallel camera, whichever lies before another. A camera's lines are drawn in one pass, in
    /// bands of rows where they meet more than the device's buffers hold.
    ///
    /// # Errors
    /// A camera that is not valid, or the device.
    pub fn draw_layers(
        &self,
        work: DrawWork<'_>,
        camera: &ParallelCamera,
        kept: LayerSelection,
    ) -> Result<LayeredDepthImage, RenderError> {
        camera.validate().map_err(|source| RenderError::Camera { index: 0, source })?;
        let limit = u64::from(self.gpu.device.limits().max_texture_dimension_2d);
        GpuError::check_limit("a layered image's side", camera.size_px.max_element().into(), limit)?;
        layered::draw(&self.stages, work, camera, kept)
    }

    /// The light of all surfaces on the lines of many directions, with highlights and what mirrors show, towards each. The lighting has
    /// mirror images of the scene; without any, and where nothing reflects, there are no samples.
    ///
    /// # Errors
    /// A camera that is not valid, or the device.
    pub fn draw_light_field(
        &self,
        work: DrawWork<'_>,
        camera: &LightFieldCamera,
    ) -> Result<LayeredLightField, RenderError> {
        camera.validate().map_err(|source| RenderError::Camera { index: 0, source })?;
        layered::light_field::draw(&self.stages, work, camera)
    }

    /// As [`Renderer::draw_depth_images`] for the `wanted` of `cameras`, but each image omits the samples that are
    /// redundant with images before it, and shows what lies behind. Surfaces that its rays passed are in
    /// [`DepthImage::passed`]; a texel with redundant surfaces and nothing behind them is a hole.
    ///
    /// # Errors
    /// As [`Renderer::draw_depth_images`]; more images than the device's layers.
    pub fn draw_image_sequence(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        wanted: &[u32],
        planes: SamplePlanes,
        test: RedundancyTest,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let all = pinholes(cameras, "redundancy tests")?;
        self.check(cameras)?;
        let own: Vec<Camera> = wanted.iter().map(|&number| cameras[number as usize]).collect();
        let samples = KnownSamples::of(&self.gpu, &self.layers, &all, test)?;
        let sequence = ImageSequence { known: &samples, wanted, first: 0, kept: all.len().saturating_sub(1) };
        // Where pixels are compared with the same pixel, corners are compared with corners.
        let corners = (planes.corners && test.from_one_place).then(|| corner_cameras(&all));
        let corners = corners.map(|cameras| KnownSamples::of(&self.gpu, &self.layers, &cameras, test));
        let corners = corners.transpose()?;
        let of_corners = match &corners {
            Some(known) => ImageSequence { known, ..sequence },
            None => ImageSequence { kept: 0, ..sequence },
        };
        self.images(work, &own, planes, None, [Some(sequence), Some(of_corners)])
    }

    /// Depth images. Depths at texels' corners are pictures of their own, without light.
    fn images(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        planes: SamplePlanes,
        covered_by: Option<CoveredBy<'_>>,
        [sequence, of_corners]: [Option<ImageSequence<'_>>; 2],
    ) -> Result<Vec<DepthImage>, RenderError> {
        let corners = planes.corners.then(|| pinholes(cameras, "depths at corners")).transpose()?;
        let covered = covered_by.is_some();
        let triangle_normal = planes.light || covered;
        let passed = sequence.is_some();
        // Single poles have no eye that all rays of glass come from.
        let glass = !planes.light && is_seen_through(work) && cameras.iter().all(|camera| camera.pinhole().is_some());
        let output = Output { covered, triangle_normal, passed, glass, ..images_output(work, planes) };
        let request = Batch { sequence, covered_by, ..Batch::new(work, output) };
        let mut images = self.draw(request, cameras, |words, cameras| planes::depth_images(words, output, cameras))?;
        if let Some(pinholes) = corners {
            let cameras = as_cameras(&corner_cameras(&pinholes));
            self.check(&cameras)?;
            let corners = self.images(work.unlit(), &cameras, SamplePlanes::default(), None, [of_corners, None])?;
            for (image, corners) in images.iter_mut().zip(corners) {
                image.corner_inverse_depth_per_m = Some(corners.inverse_depth_per_m);
            }
        }
        Ok(images)
    }

    /// Which places of the grid on each lamp the surface of each pixel sees: [`scalar::bits_of_lamp`](crate::scalar::bits_of_lamp)
    /// reads them. No bits without a grid.
    ///
    /// # Errors
    /// As [`Renderer::draw_views`].
    pub fn draw_lamp_bits(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<Vec<u32>, RenderError> {
        let cameras = [Camera::from(*camera)];
        self.check(&cameras)?;
        let output = Output { lamp_bits: true, ..Output::of(work, false) };
        let words = camera.pixel_count() * words_a_pixel(work.lighting.grid_side(), work.scene.light_count);
        let bits =
            self.draw(Batch::new(work, output), &cameras, |read, _| vec![read[..words.min(read.len())].to_vec()])?;
        Ok(bits.concat())
    }

    /// Batch after batch; `read` makes pictures of the words of one.
    fn draw<T>(
        &self,
        request: Batch<'_>,
        cameras: &[Camera],
        read: impl Fn(&[u32], &[Camera]) -> Vec<T>,
    ) -> Result<Vec<T>, RenderError> {
        let mut pictures = Vec::with_capacity(cameras.len());
        for cameras in batches(cameras, self.most_pixels(&request)) {
            let sequence = request.sequence.map(|sequence| ImageSequence { first: pictures.len(), ..sequence });
            let covered_by = request.covered_by.map(|set| CoveredBy { first: pictures.len(), ..set });
            let batch = self.batch(Batch { sequence, covered_by, ..request.clone() }, cameras)?;
            let (result, words) = self.stages.draw(&batch)?;
            result.with(words, |words: &[u32]| pictures.extend(read(words, cameras)))?;
        }
        Ok(pictures)
    }

    /// The costs of both ways of finding surfaces for pictures of `camera`'s size: measured with the scene's first pictures,
    /// predicted for others.
    ///
    /// # Errors
    /// The device's.
    pub fn choice(&self, scene: &GpuScene, camera: &PinholeCamera, scene_time_s: f32) -> Result<Choice, RenderError> {
        let work = DrawWork { scene_time_s, ..DrawWork::new(scene, Lighting::UNLIT) };
        Ok(self.costs(work, camera)?.at(camera.pixel_count()))
    }

    /// The pixels up to which pictures of a scene find surfaces faster by rays: measured with the scene's first pictures.
    ///
    /// # Errors
    /// The device's.
    pub fn traced_pixel_count(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<u32, RenderError> {
        if is_drawn_at_each_moment(work) {
            return Ok(0);
        }
        Ok(self.costs(work, camera)?.most_traced_pixels(camera.pixel_count()))
    }

    /// Whether surfaces are found by rays. A live stream does not wait for the measurement: where there is none, it traces rays
    /// if the scene has more triangles than the picture pixels.
    fn is_by_rays(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<bool, RenderError> {
        if work.turn.class == WorkClass::Live && self.known_costs(work.scene).is_none() {
            return Ok(work.scene.triangle_count() > camera.pixel_count());
        }
        Ok(self.costs(work, camera)?.at(camera.pixel_count()).rays_are_faster())
    }

    fn known_costs(&self, scene: &GpuScene) -> Option<Costs> {
        self.costs.lock().iter().find(|(identity, _)| *identity == scene.identity).map(|(_, costs)| *costs)
    }

    /// Not under a lock: work of one class would wait for the turn of another.
    fn costs(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<Costs, RenderError> {
        if let Some(costs) = self.known_costs(work.scene) {
            return Ok(costs);
        }
        let large = at_least(camera, LEAST_TIMED_PX);
        let small = large.resized((large.size_px / 2).max(UVec2::ONE));
        let measured = Costs::through([self.measure(work, &small)?, self.measure(work, &large)?]);
        let mut costs = self.costs.lock();
        // Of several that were measured at once the first counts.
        if let Some((_, first)) = costs.iter().find(|(identity, _)| *identity == work.scene.identity) {
            return Ok(*first);
        }
        if costs.len() >= MOST_SCENES {
            costs.pop_front();
        }
        costs.push_back((work.scene.identity, measured));
        Ok(measured)
    }

    /// The pixels of a camera's pictures, and their costs.
    fn measure(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<(usize, Choice), RenderError> {
        let work = work.unlit();
        let triangles_s = self.seconds_a_view(DrawWork { visibility: Visibility::Triangles, ..work }, camera)?;
        let rays_s = self.seconds_a_view(DrawWork { visibility: Visibility::Rays, ..work }, camera)?;
        let choice = Choice { triangles_s, rays_s };
        tracing::info!(size_px = %camera.size_px, %choice, "surfaces are found by");
        Ok((camera.pixel_count(), choice))
    }

    fn seconds_a_view(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<f64, RenderError> {
        let cameras = [Camera::from(*camera)];
        self.check(&cameras)?;
        let mut least_s = f64::INFINITY;
        for number in 0..4 {
            let batch = self.batch(Batch::new(work, views_output(work)), &cameras)?;
            // Waiting for turns does not count.
            let device_s = self.stages.draw(&batch)?.0.device_s;
            // Pipelines and trees are made by the first; of the others the quickest was disturbed least.
            if number > 0 {
                least_s = least_s.min(device_s);
            }
        }
        Ok(least_s)
    }

    fn check(&self, cameras: &[Camera]) -> Result<(), RenderError> {
        let limit = u64::from(self.gpu.device.limits().max_texture_dimension_2d);
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| RenderError::Camera { index, source })?;
            let side_px = u64::from(camera.size_px().max_element());
            GpuError::check_limit(&format!("camera {index}'s image side"), side_px, limit)?;
        }
        Ok(())
    }

    fn batch<'a>(&self, request: Batch<'a>, cameras: &'a [Camera]) -> Result<Batch<'a>, RenderError> {
        let Batch { work, sequence, .. } = request;
        let by_rays = match work.visibility {
            // Triangles are drawn through one eye.
            _ if cameras[0].pinhole().is_none() => true,
            // Rays mark the pixels that show glass.
            _ if request.output.glass => true,
            _ if sequence.is_some_and(|sequence| sequence.known.test.traces_rays()) => true,
            Visibility::Triangles => false,
            Visibility::Rays => true,
            Visibility::Measured if is_drawn_at_each_moment(work) => false,
            Visibility::Measured => self.is_by_rays(work, cameras[0].reference())?,
        };
        let lighting = work.lighting;
        let is_answered = match lighting.grid_visibility() {
            GridVisibility::Rays | GridVisibility::Maps => true,
            GridVisibility::Samples => work.lamp_maps.samples.is_some(),
            GridVisibility::Cube => work.lamp_maps.cube.is_some(),
        };
        if !is_answered {
            return Err(RenderError::LampSamples { lighting: lighting.to_string() });
        }
        let needs_tree = by_rays || work.lighting.is_traced();
        let traced = needs_tree.then(|| work.scene.rays.at(work.scene_time_s)).transpose()?;
        Ok(Batch { cameras, by_rays, traced, ..request })
    }

    /// The pixels for which no buffer of a batch is larger than the device binds.
    fn most_pixels(&self, request: &Batch<'_>) -> usize {
        let output = request.output;
        let bytes = self.gpu.most_storage_bytes() as usize;
        let planes = output.layout().count.max(output.sums.count()).max(request.lamp_words());
        PIXELS_A_SUBMISSION.min(bytes / (4 * planes))
    }
}

/// Each moment of a moving scene would need a tree that nothing else needs.
fn is_drawn_at_each_moment(work: DrawWork<'_>) -> bool {
    work.scene.animated && !work.lighting.is_traced()
}

/// The camera with the same field of view and no fewer than `pixels` pixels.
fn at_least(camera: &PinholeCamera, pixels: usize) -> PinholeCamera {
    let scale = (pixels as f32 / camera.pixel_count() as f32).sqrt();
    if scale > 1.0 { camera.resized((camera.size_px.as_vec2() * scale).ceil().as_uvec2()) } else { *camera }
}

fn as_cameras(pinholes: &[PinholeCamera]) -> Vec<Camera> {
    pinholes.iter().copied().map(Camera::from).collect()
}

fn pinholes(cameras: &[Camera], what: &'static str) -> Result<Vec<PinholeCamera>, RenderError> {
    let pinholes = cameras.iter().enumerate().map(|(index, camera)| {
        camera.pinhole().copied().ok_or(RenderError::Model { index, model: camera.model_name(), what })
    });
    pinholes.collect()
}

fn corner_cameras(cameras: &[PinholeCamera]) -> Vec<PinholeCamera> {
    cameras.iter().map(DepthImage::corner_camera).collect()
}

fn views_output(work: DrawWork<'_>) -> Output {
    let highlight = work.highlight();
    let glossy = highlight.is_some() && work.lighting.glossy_rays() > 0;
    let mirrors = highlight.is_some() && work.lighting.without_reflections().is_some();
    let glass = is_seen_through(work);
    Output { highlight, mirrors, glossy, glass, ..Output::of(work, highlight.is_some()) }
}

/// Whether rays go through the glass of pictures.
fn is_seen_through(work: DrawWork<'_>) -> bool {
    work.highlight() == Some(Highlight::Ggx) && work.scene.has_glass()
}

fn images_output(work: DrawWork<'_>, planes: SamplePlanes) -> Output {
    let reflector = planes.specular && work.highlight().is_some() && !planes.light;
    let is_centre_alone = work.refinement.steps > 1 || planes.light;
    Output {
        samples: true,
        antialias: if is_centre_alone { Antialias::NONE } else { planes.antialias },
        normal: planes.normal || reflector || planes.light,
        reflector,
        surface_id: planes.surface_id,
        light: planes.light,
        ..Output::of(work, reflector || planes.light)
    }
}
