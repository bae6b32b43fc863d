//! Finished pictures: surfaces by triangles or by rays, then their light, then planes on the host.

mod batch;

use std::{
    sync::{Arc, Mutex},
    time::Instant,
};

use depth_image::{Camera, DepthImage, PinholeCamera, View, ViewPlanes};
use gpu::{BufferPool, Frame, Gpu, Templates};

use self::batch::{Batch, Chain};
use crate::{
    GpuScene, Lighting, RenderError,
    accumulation::Accumulations,
    form::{ComputePipelines, Form, Pass, Shading},
    known::{KeptLayers, Known, LeaveOut, Settled},
    memory_pass::{self, MemoryPass},
    planes,
    raster::Rasterizer,
    surfaces::SurfacePool,
    visibility::{Choice, Choices, Visibility},
};

/// Pixels in one submission: bounds the memory for surfaces, light and read-back.
const PIXELS_A_SUBMISSION: usize = 1 << 20;
const CAMERAS_A_SUBMISSION: usize = 32;

/// What to draw besides the cameras.
#[derive(Clone, Copy)]
pub struct DrawWork<'a> {
    /// From where.
    pub scene: &'a GpuScene,
    /// How it is lit.
    pub lighting: Lighting,
    /// Which moment of an animated scene.
    pub scene_time_s: f32,
    /// How surfaces are found.
    pub visibility: Visibility,
    /// How far a still scene's light has been refined.
    pub refinement: Refinement,
}

/// A step on the way to all rays of a lighting; every step doubles them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Refinement {
    /// From 0.
    pub step: u32,
    /// With the last, all rays have been traced. With only one, nothing is kept from before or for later.
    pub steps: u32,
}

impl Default for Refinement {
    fn default() -> Self {
        Self { step: 0, steps: 1 }
    }
}

impl Refinement {
    /// Of `rays` in all, those that have been traced with this step.
    fn share_of(self, rays: u32) -> u32 {
        let to_go = self.steps.saturating_sub(self.step + 1).min(31);
        rays.div_ceil(1 << to_go)
    }
}

/// Optional planes of depth images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SamplePlanes {
    /// [`DepthImage::normal_oct16`].
    pub normal: bool,
    /// [`DepthImage::surface_id`].
    pub surface_id: bool,
    /// [`DepthImage::specular`], with normals, where the scene has highlights under the lighting.
    pub specular: bool,
    /// [`DepthImage::corner_inverse_depth_per_m`]: a second picture.
    pub corners: bool,
}

/// Node visits and triangle tests of rays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Visits {
    /// Of each pixel's primary ray: nodes, then triangles.
    pub of_pixel: Vec<[u32; 2]>,
}

/// Draws on one device.
pub struct Renderer {
    gpu: Arc<Gpu>,
    pool: BufferPool,
    surfaces: SurfacePool,
    rasterizer: Rasterizer,
    pipelines: ComputePipelines,
    accumulations: Accumulations,
    kept_layers: KeptLayers,
    choices: Choices,
    /// One batch at a time: the device makes no more of two, and memory holds one.
    drawing: Mutex<()>,
}

impl Renderer {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, RenderError> {
        Self::with_tests(gpu, &[])
    }

    /// With templates of tests for [`Renderer::draw_depth_images_apart`], each with its name.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn with_tests(gpu: &Arc<Gpu>, tests: &[(&'static str, &'static str)]) -> Result<Self, RenderError> {
        let templates = Arc::new(Templates::new(&[crate::SHADERS, tests].concat())?);
        Ok(Self {
            gpu: gpu.clone(),
            pool: BufferPool::new(gpu),
            surfaces: SurfacePool::new(gpu),
            rasterizer: Rasterizer::new(gpu, &templates),
            pipelines: ComputePipelines::new(gpu, &templates),
            accumulations: Accumulations::default(),
            kept_layers: KeptLayers::default(),
            choices: Choices::default(),
            drawing: Mutex::default(),
        })
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
        let form = form_of(work, SamplePlanes::default(), false);
        for cameras in batches(cameras, self.most_pixels(form)) {
            let batch = self.batch(work, cameras, form)?;
            let result = self.draw(&batch, None)?;
            result.0.with(result.1, |words: &[u32]| planes::views(words, batch.finish, cameras, planes, &mut views))?;
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
        let mut images = self.images(work, &pinholes, planes, None)?;
        if planes.corners {
            self.add_corners(work, &mut images, &pinholes, None)?;
        }
        Ok(images)
    }

    /// As [`Renderer::draw_depth_images`] for the `wanted` of `cameras`, but each image leaves out what a test says that the images before it
    /// hold, and shows what lies behind. What its rays went through is in [`DepthImage::passed`]; a texel behind
    /// whose left-out surfaces lies nothing is a hole.
    ///
    /// With what the set held at another moment, a test that settles keeps on to it.
    ///
    /// # Errors
    /// As [`Renderer::draw_depth_images`]; more images than the device's layers.
    pub fn draw_depth_images_apart(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        wanted: &[u32],
        planes: SamplePlanes,
        leave_out: LeaveOut,
        before: Option<&Settled>,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let leave_out = LeaveOut { settled: before.is_some(), ..leave_out };
        let all = pinholes(cameras);
        self.check(&all)?;
        let known = Known::of(&self.gpu, &self.kept_layers, &all, leave_out)?.after(before);
        let chain = Chain { leave_out, known: &known, wanted, first: 0, keep: !leave_out.traces_rays() };
        let pinholes: Vec<PinholeCamera> = wanted.iter().map(|&number| all[number as usize]).collect();
        let mut images = self.images(work, &pinholes, planes, Some(chain))?;
        if planes.corners {
            // Where pixels are compared with the same pixel, corners are compared with corners.
            let own = leave_out.from_one_place;
            let corners = own
                .then(|| Known::of(&self.gpu, &self.kept_layers, &corner_cameras(&pinholes), leave_out))
                .transpose()?;
            let chain = Chain { keep: own, known: corners.as_ref().unwrap_or(&known), ..chain };
            self.add_corners(work, &mut images, &pinholes, Some(chain))?;
        }
        Ok(images)
    }

    /// What all images of a set hold: samples, for a test that asks for them.
    ///
    /// # Errors
    /// As [`Renderer::draw_depth_images_apart`].
    pub fn settle(&self, work: DrawWork<'_>, cameras: &[Camera], leave_out: LeaveOut) -> Result<Settled, RenderError> {
        let cameras = pinholes(cameras);
        self.check(&cameras)?;
        let known = Known::of(&self.gpu, &self.kept_layers, &cameras, leave_out)?.keeping_all();
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let chain = Chain { leave_out, known: &known, wanted: &wanted, first: 0, keep: true };
        let work = DrawWork { lighting: Lighting::UNLIT, refinement: Refinement::default(), ..work };
        self.images(work, &cameras, SamplePlanes::default(), Some(chain))?;
        Ok(known.settle())
    }

    fn images(
        &self,
        work: DrawWork<'_>,
        cameras: &[PinholeCamera],
        planes: SamplePlanes,
        chain: Option<Chain<'_>>,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let mut images = Vec::with_capacity(cameras.len());
        let form = Form { leave_out: chain.map(|chain| chain.leave_out), ..form_of(work, planes, true) };
        for cameras in batches(cameras, self.most_pixels(form)) {
            let chain = chain.map(|chain| Chain { first: images.len(), ..chain });
            let batch = Batch { chain, ..self.batch(work, cameras, form)? };
            let (result, words) = self.draw(&batch, None)?;
            result.with(words, |words: &[u32]| planes::depth_images(words, batch.finish, cameras, &mut images))?;
        }
        Ok(images)
    }

    /// Depths at texels' corners: pictures of their own, without light.
    fn add_corners(
        &self,
        work: DrawWork<'_>,
        images: &mut [DepthImage],
        cameras: &[PinholeCamera],
        chain: Option<Chain<'_>>,
    ) -> Result<(), RenderError> {
        let work = DrawWork { lighting: Lighting::UNLIT, refinement: Refinement::default(), ..work };
        let cameras = corner_cameras(cameras);
        self.check(&cameras)?;
        let corners = self.images(work, &cameras, SamplePlanes::default(), chain)?;
        for (image, corners) in images.iter_mut().zip(corners) {
            image.corner_inverse_depth_per_m = Some(corners.inverse_depth_per_m);
        }
        Ok(())
    }

    /// How surfaces of `camera`'s kind are found where that is left to the device: measured the first time.
    ///
    /// # Errors
    /// The device's.
    pub fn choice(&self, scene: &GpuScene, camera: &PinholeCamera, scene_time_s: f32) -> Result<Choice, RenderError> {
        self.choices.get_or_measure(scene, camera.size_px, |visibility| {
            let work = DrawWork {
                scene,
                lighting: Lighting::UNLIT,
                scene_time_s,
                visibility,
                refinement: Refinement::default(),
            };
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
        let work = DrawWork { visibility: Visibility::Rays, lighting: Lighting::UNLIT, ..work };
        let cameras = [*camera];
        let batch = self.batch(work, &cameras, form_of(work, SamplePlanes::default(), false))?;
        let counts = self.pool.lend_storage("visits", 8 * camera.pixel_count() as u64);
        let (result, _) = self.draw(&batch, Some(&counts))?;
        drop(result);
        let bytes = 8 * camera.pixel_count() as u64;
        let mut frame = Frame::begin(&self.gpu, "visits");
        let read = frame.read_back(&counts, 0..bytes, self.pool.lend_host("visits", bytes));
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
        let [nodes, corners, ..] = traced.views();
        memory_pass::read(&self.gpu, &self.pool, &[nodes, corners])
    }

    fn check(&self, cameras: &[PinholeCamera]) -> Result<(), RenderError> {
        let limit = u64::from(self.gpu.device.limits().max_texture_dimension_2d);
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| RenderError::Camera { index, source })?;
            let needed = u64::from(camera.size_px.max_element());
            if needed > limit {
                return Err(gpu::GpuError::Limit { what: format!("camera {index}'s image side"), needed, limit }.into());
            }
        }
        Ok(())
    }

    fn batch<'a>(
        &self,
        work: DrawWork<'a>,
        cameras: &'a [PinholeCamera],
        form: Form,
    ) -> Result<Batch<'a>, RenderError> {
        let by_rays = match work.visibility {
            Visibility::Triangles => false,
            Visibility::Rays => true,
            Visibility::Measured if form.leave_out.is_some_and(LeaveOut::traces_rays) => true,
            // Each moment of a moving scene would need a tree that nothing else needs.
            Visibility::Measured if work.scene.is_animated() && !work.lighting.is_traced() => false,
            Visibility::Measured => self.choice(work.scene, &cameras[0], work.scene_time_s)?.rays_are_faster(),
        };
        let needs_tree = by_rays || work.lighting.is_traced();
        let traced = needs_tree.then(|| work.scene.rays.at(work.scene_time_s)).transpose()?;
        Ok(Batch { work, cameras, traced, by_rays, finish: Form { by_rays, ..form }, chain: None })
    }

    /// So many that no buffer of a batch is larger than the device binds.
    fn most_pixels(&self, form: Form) -> usize {
        let limits = self.gpu.device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) as usize;
        let [.., planes] = form.planes();
        PIXELS_A_SUBMISSION.min(bytes / (4 * planes.max(form.sum_planes())))
    }
}

fn pinholes(cameras: &[Camera]) -> Vec<PinholeCamera> {
    cameras.iter().map(|Camera::Pinhole(camera)| *camera).collect()
}

fn corner_cameras(cameras: &[PinholeCamera]) -> Vec<PinholeCamera> {
    cameras.iter().map(DepthImage::corner_camera).collect()
}

/// The last pass, but for how surfaces are found.
fn form_of(work: DrawWork<'_>, planes: SamplePlanes, samples: bool) -> Form {
    let highlight = work.lighting.highlight().filter(|&h| work.scene.has_highlights(h));
    let reflector = samples && planes.specular && highlight.is_some();
    let for_eye = !samples && highlight.is_some();
    Form {
        pass: Pass::Finish,
        shading: Shading::of(work.lighting.highlight()),
        visibility: (reflector || for_eye) && work.lighting.is_traced(),
        light_count: work.scene.light_count,
        highlight: for_eye,
        samples,
        normal: samples && (planes.normal || reflector),
        reflector,
        surface_id: samples && planes.surface_id,
        ..Form::default()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_doubles_the_rays_and_the_last_has_all() {
        let counts = |rays: u32, steps: u32| -> Vec<u32> {
            (0..steps).map(|step| Refinement { step, steps }.share_of(rays)).collect()
        };
        assert_eq!(counts(16, 5), [1, 2, 4, 8, 16]);
        assert_eq!(counts(1, 5), [1, 1, 1, 1, 1]);
        assert_eq!(counts(12, 3), [3, 6, 12]);
        assert_eq!(counts(0, 2), [0, 0]);
        assert_eq!(Refinement::default().share_of(7), 7);
    }
}
