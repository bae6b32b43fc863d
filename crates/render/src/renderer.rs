//! Views and depth images of scenes, in as few submissions as memory allows.

use std::{sync::Arc, time::Instant};

use depth_image::{Camera, DepthImage, PinholeCamera, View, ViewPlanes};
use gpu::{Frame, Gpu, GpuError, Templates};

use crate::{
    GpuScene, RenderError,
    batch::Batch,
    finish::{FinishVariant, Output, Redundancy},
    image_sequence::ImageSequence,
    known_samples::{KnownSamples, LayerCache, TemporalReference},
    memory_pass::{self, MemoryPass},
    planes,
    redundancy_test::RedundancyTest,
    shaders::templates,
    stages::Stages,
    sums::SumPlanes,
    visibility::{Choice, Choices, Visibility},
    work::{DrawWork, SamplePlanes},
};

/// Pixels in one submission: bounds the memory for surfaces, light and read-back.
const PIXELS_A_SUBMISSION: usize = 1 << 20;
const CAMERAS_A_SUBMISSION: usize = 32;

/// Node visits and triangle tests of rays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Visits {
    /// Nodes, then triangles, of each pixel's primary ray.
    pub of_pixel: Vec<[u32; 2]>,
}

/// Draws on one device.
pub struct Renderer {
    gpu: Arc<Gpu>,
    stages: Stages,
    layer_cache: LayerCache,
    choices: Choices,
}

impl Renderer {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, RenderError> {
        Ok(Self::with_templates(gpu, templates(&[])?))
    }

    /// A renderer whose `templates` hold redundancy tests for [`Renderer::draw_image_sequence`], too.
    #[must_use]
    pub fn with_templates(gpu: &Arc<Gpu>, templates: Templates) -> Self {
        let stages = Stages::new(gpu, &Arc::new(templates));
        Self { gpu: gpu.clone(), stages, layer_cache: LayerCache::default(), choices: Choices::default() }
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
        self.check(cameras)?;
        let mut views = Vec::with_capacity(cameras.len());
        let finish = views_finish(work);
        for cameras in batches(cameras, self.most_pixels(finish)) {
            let batch = self.batch(work, cameras, finish, None)?;
            let (result, words) = self.stages.draw(&batch, None)?;
            result.with(words, |words: &[u32]| {
                planes::views(words, batch.finish.layout(), cameras, planes, &mut views);
            })?;
        }
        Ok(views)
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
        let pinholes = pinholes(cameras);
        self.check(&pinholes)?;
        let finish = images_finish(work, planes, Redundancy::None);
        let mut images = self.images(work, &pinholes, finish, None)?;
        if planes.corners {
            self.add_corners(work, &mut images, &pinholes, Redundancy::None, None)?;
        }
        Ok(images)
    }

    /// As [`Renderer::draw_depth_images`] for the `wanted` of `cameras`, but each image leaves out the samples that are
    /// redundant with images before it, and shows what lies behind. Surfaces that its rays passed are in
    /// [`DepthImage::passed`]; a texel with redundant surfaces and nothing behind them is a hole.
    ///
    /// With a temporal reference, a test that consults samples has hysteresis: samples of the reference are redundant only by
    /// a margin.
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
        reference: Option<&TemporalReference>,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let all = pinholes(cameras);
        self.check(&all)?;
        let known = KnownSamples::of(&self.gpu, &self.layer_cache, &all, test)?.after(reference);
        let redundancy = Redundancy::of(test);
        let sequence = ImageSequence { known: &known, wanted, first: 0, keeps: !test.traces_rays() };
        let pinholes: Vec<PinholeCamera> = wanted.iter().map(|&number| all[number as usize]).collect();
        let mut images = self.images(work, &pinholes, images_finish(work, planes, redundancy), Some(sequence))?;
        if planes.corners {
            // Where pixels are compared with the same pixel, corners are compared with corners.
            let keeps = test.from_one_place;
            let corners = corner_cameras(&pinholes);
            let corners = keeps.then(|| KnownSamples::of(&self.gpu, &self.layer_cache, &corners, test)).transpose()?;
            let sequence = ImageSequence { keeps, known: corners.as_ref().unwrap_or(&known), ..sequence };
            self.add_corners(work, &mut images, &pinholes, redundancy, Some(sequence))?;
        }
        Ok(images)
    }

    /// The samples of all images of a set, for a test that consults them.
    ///
    /// # Errors
    /// As [`Renderer::draw_image_sequence`].
    pub fn temporal_reference(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        test: RedundancyTest,
    ) -> Result<TemporalReference, RenderError> {
        let (work, cameras) = (work.unlit(), pinholes(cameras));
        self.check(&cameras)?;
        let known = KnownSamples::of(&self.gpu, &self.layer_cache, &cameras, test)?.keeping_all();
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let sequence = ImageSequence { known: &known, wanted: &wanted, first: 0, keeps: true };
        let finish = images_finish(work, SamplePlanes::default(), Redundancy::of(test));
        self.images(work, &cameras, finish, Some(sequence))?;
        Ok(known.into_reference())
    }

    fn images(
        &self,
        work: DrawWork<'_>,
        cameras: &[PinholeCamera],
        finish: FinishVariant,
        sequence: Option<ImageSequence<'_>>,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let mut images = Vec::with_capacity(cameras.len());
        for cameras in batches(cameras, self.most_pixels(finish)) {
            let sequence = sequence.map(|sequence| ImageSequence { first: images.len(), ..sequence });
            let batch = self.batch(work, cameras, finish, sequence)?;
            let (result, words) = self.stages.draw(&batch, None)?;
            result.with(words, |words: &[u32]| {
                planes::depth_images(words, batch.finish.layout(), cameras, &mut images);
            })?;
        }
        Ok(images)
    }

    /// Depths at texels' corners: pictures of their own, without light.
    fn add_corners(
        &self,
        work: DrawWork<'_>,
        images: &mut [DepthImage],
        cameras: &[PinholeCamera],
        redundancy: Redundancy,
        sequence: Option<ImageSequence<'_>>,
    ) -> Result<(), RenderError> {
        let (work, cameras) = (work.unlit(), corner_cameras(cameras));
        self.check(&cameras)?;
        let finish = images_finish(work, SamplePlanes::default(), redundancy);
        let corners = self.images(work, &cameras, finish, sequence)?;
        for (image, corners) in images.iter_mut().zip(corners) {
            image.corner_inverse_depth_per_m = Some(corners.inverse_depth_per_m);
        }
        Ok(())
    }

    /// The faster way of finding surfaces for pictures of `camera`'s size: measured the first time.
    ///
    /// # Errors
    /// The device's.
    pub fn choice(&self, scene: &GpuScene, camera: &PinholeCamera, scene_time_s: f32) -> Result<Choice, RenderError> {
        let lighting = crate::Lighting::UNLIT;
        self.choices.get_or_measure(scene, camera.size_px, |visibility| {
            let work = DrawWork { scene, lighting, scene_time_s, visibility, refinement: Default::default() };
            let run = || {
                let start = Instant::now();
                self.draw_views(work, &[*camera], ViewPlanes::default())?;
                Ok(start.elapsed().as_secs_f64())
            };
            // Pipelines and trees are made by the first; of the others the quickest was disturbed least.
            run()?;
            (0..3).map(|_| run()).try_fold(f64::INFINITY, |least, s: Result<f64, RenderError>| s.map(|s| least.min(s)))
        })
    }

    /// Nodes and triangles that each pixel's primary ray meets on its way; slower than drawing.
    ///
    /// # Errors
    /// A camera that is not valid, or the device.
    pub fn count_visits(&self, work: DrawWork<'_>, camera: &PinholeCamera) -> Result<Visits, RenderError> {
        self.check(std::slice::from_ref(camera))?;
        let work = DrawWork { visibility: Visibility::Rays, lighting: crate::Lighting::UNLIT, ..work };
        let cameras = [*camera];
        let batch = self.batch(work, &cameras, views_finish(work), None)?;
        let pool = &self.stages.pool;
        let bytes = 8 * camera.pixel_count() as u64;
        let counts = pool.lend_storage("visits", bytes);
        drop(self.stages.draw(&batch, Some(&counts))?);
        let mut frame = Frame::begin(&self.gpu, "visits");
        let read = frame.read_back(&counts, 0..bytes, pool.lend_host("visits", bytes));
        let result = frame.submit().wait()?;
        let of_pixel = result.with(read, |pairs: &[[u32; 2]]| pairs[..camera.pixel_count()].to_vec())?;
        Ok(Visits { of_pixel })
    }

    /// Reads the tree and triangles that rays go through once each, with nothing done but to add: what memory allows.
    ///
    /// # Errors
    /// The device's.
    pub fn read_acceleration(&self, scene: &GpuScene, scene_time_s: f32) -> Result<MemoryPass, RenderError> {
        let traced = scene.rays.at(scene_time_s)?;
        memory_pass::read(&self.gpu, &self.stages.pool, &traced.tree())
    }

    fn check(&self, cameras: &[PinholeCamera]) -> Result<(), RenderError> {
        let limit = u64::from(self.gpu.device.limits().max_texture_dimension_2d);
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| RenderError::Camera { index, source })?;
            let side_px = u64::from(camera.size_px.max_element());
            GpuError::check_limit(&format!("camera {index}'s image side"), side_px, limit)?;
        }
        Ok(())
    }

    fn batch<'a>(
        &self,
        work: DrawWork<'a>,
        cameras: &'a [PinholeCamera],
        finish: FinishVariant,
        sequence: Option<ImageSequence<'a>>,
    ) -> Result<Batch<'a>, RenderError> {
        let by_rays = match work.visibility {
            Visibility::Triangles => false,
            Visibility::Rays => true,
            Visibility::Measured if sequence.is_some_and(|sequence| sequence.known.test().traces_rays()) => true,
            // Each moment of a moving scene would need a tree that nothing else needs.
            Visibility::Measured if work.scene.is_animated() && !work.lighting.is_traced() => false,
            Visibility::Measured => self.choice(work.scene, &cameras[0], work.scene_time_s)?.rays_are_faster(),
        };
        let needs_tree = by_rays || work.lighting.is_traced();
        let traced = needs_tree.then(|| work.scene.rays.at(work.scene_time_s)).transpose()?;
        Ok(Batch { work, cameras, traced, finish: FinishVariant { by_rays, ..finish }, sequence })
    }

    /// The pixels for which no buffer of a batch is larger than the device binds.
    fn most_pixels(&self, finish: FinishVariant) -> usize {
        let limits = self.gpu.device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) as usize;
        PIXELS_A_SUBMISSION.min(bytes / (4 * finish.layout().count.max(finish.sums.count())))
    }
}

fn pinholes(cameras: &[Camera]) -> Vec<PinholeCamera> {
    cameras.iter().map(|Camera::Pinhole(camera)| *camera).collect()
}

fn corner_cameras(cameras: &[PinholeCamera]) -> Vec<PinholeCamera> {
    cameras.iter().map(DepthImage::corner_camera).collect()
}

/// The last pass of views; how surfaces are found is not known yet.
fn views_finish(work: DrawWork<'_>) -> FinishVariant {
    let highlight = work.lighting.highlight().filter(|&highlight| work.scene.has_highlights(highlight));
    finish(work, highlight.is_some(), Output::View { highlight })
}

/// The last pass of depth images; how surfaces are found is not known yet.
fn images_finish(work: DrawWork<'_>, planes: SamplePlanes, redundancy: Redundancy) -> FinishVariant {
    let highlight = work.lighting.highlight().filter(|&highlight| work.scene.has_highlights(highlight));
    let reflector = planes.specular && highlight.is_some();
    let (normal, surface_id) = (planes.normal || reflector, planes.surface_id);
    finish(work, reflector, Output::DepthImage { normal, reflector, surface_id, redundancy })
}

fn finish(work: DrawWork<'_>, reflects: bool, output: Output) -> FinishVariant {
    let visibility = reflects && work.lighting.is_traced();
    let sums = SumPlanes { light_count: work.scene.light_count, visibility };
    FinishVariant { by_rays: false, lit: work.lighting.is_lit(), sums, output }
}

/// Runs of cameras, bounded in number and pixels; at least one camera each.
fn batches(cameras: &[PinholeCamera], most_pixels: usize) -> impl Iterator<Item = &[PinholeCamera]> {
    let mut rest = cameras;
    std::iter::from_fn(move || {
        let mut pixels = 0;
        let fits = |camera: &&PinholeCamera| {
            pixels += camera.pixel_count();
            pixels <= most_pixels
        };
        let count = rest.iter().take(CAMERAS_A_SUBMISSION).take_while(fits).count().max(1).min(rest.len());
        let (batch, others) = rest.split_at(count);
        rest = others;
        (!batch.is_empty()).then_some(batch)
    })
}
