//! Finished pictures: surfaces by triangles or by rays, then their light, then planes on the host.

use std::{
    ops::Range,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use depth_image::{Camera, DepthImage, PinholeCamera, View, ViewPlanes};
use glam::UVec2;
use gpu::{BufferPool, Frame, FrameResult, Gpu, PooledBuffer, Readback, Templates};
use wgpu::BufferUsages;

use crate::{
    GpuScene, Lighting, Rate, RenderError,
    accumulation::{Accumulations, Key, Sums},
    binding::{bind_group, texture, window},
    form::{ComputePipelines, Form, Pass, Shading, ShadowRays},
    illuminate::{IlluminateWork, Illuminator},
    known::{KeptLayers, Known, LeaveOut, Settled},
    memory_pass::{self, MemoryPass},
    pixel_camera::{PIXEL_CAMERA_BYTES, PIXEL_CAMERA_STRIDE, PixelCamera, uniform},
    planes,
    raster::{RasterWork, Rasterizer},
    rays::{Traced, primary},
    surfaces::{SurfaceKind, SurfacePool, Surfaces},
    visibility::{Choice, Choices, Visibility},
};

/// Pixels in one submission: bounds the memory for surfaces, light and read-back.
const PIXELS_A_SUBMISSION: usize = 1 << 20;
const CAMERAS_A_SUBMISSION: usize = 32;
/// Of the scene's diagonal, where a lighting names no radius of occlusion.
const OCCLUSION_OF_DIAGONAL: f32 = 0.05;

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

/// One submission's work, once it is known how surfaces are found.
struct Batch<'a> {
    work: DrawWork<'a>,
    cameras: &'a [PinholeCamera],
    traced: Option<Arc<Traced>>,
    by_rays: bool,
    /// Of the last pass.
    finish: Form,
    chain: Option<Chain<'a>>,
}

/// Images that leave out what those before them hold.
#[derive(Clone, Copy)]
struct Chain<'a> {
    leave_out: LeaveOut,
    known: &'a Known,
    /// Places in the set of the images to be drawn, and which of them is the batch's first.
    wanted: &'a [u32],
    first: usize,
    /// Whether what the images hold is kept for those after them.
    keep: bool,
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

    /// One submission: surfaces, light, planes.
    fn draw(&self, batch: &Batch<'_>, counts: Option<&wgpu::Buffer>) -> Result<(FrameResult, Readback), RenderError> {
        let _one = self.drawing.lock().unwrap_or_else(PoisonError::into_inner);
        let [.., planes] = batch.finish.planes();
        let pixels: u64 = batch.cameras.iter().map(|camera| camera.pixel_count() as u64).sum();
        let sum_planes = if batch.work.lighting.is_lit() { batch.finish.sum_planes() } else { 0 };
        let sums_bytes = 4 * pixels * sum_planes as u64;
        let words_bytes = 4 * pixels * planes as u64;
        self.gpu.check_storage_bytes("the light of a batch (bytes)", sums_bytes)?;
        self.gpu.check_storage_bytes("the planes of a batch (bytes)", words_bytes)?;
        let sums = self.sums(batch, sums_bytes);
        let cameras = uniform(&self.gpu, &pixel_cameras(batch, &sums, sums.ranges(), planes));
        let surfaces: Vec<Surfaces> =
            (0..).zip(batch.cameras).map(|(place, camera)| self.lend(batch, place, camera)).collect();
        let mut frame = Frame::begin(&self.gpu, "draw");
        match batch.chain {
            Some(chain) => self.record_chain(&mut frame, batch, chain, &cameras, &surfaces)?,
            None => self.record_surfaces(&mut frame, batch, &cameras, &surfaces, counts)?,
        }
        let mut lent = Vec::new();
        if batch.work.lighting.is_lit() {
            lent = self.record_light(&mut frame, batch, &surfaces, &sums, planes)?;
        }
        let words = self.pool.lend_storage("planes", words_bytes.max(4));
        self.record_finish(&mut frame, batch, &cameras, &surfaces, (&sums.buffer, &words))?;
        let host = self.pool.lend_host("planes read-back", words_bytes.max(4));
        let read = frame.read_back(&words, 0..words_bytes, host);
        let result = frame.submit().wait()?;
        drop((surfaces, lent, words));
        self.keep(batch, sums);
        Ok((result, read))
    }

    fn lend(&self, batch: &Batch<'_>, place: usize, camera: &PinholeCamera) -> Surfaces {
        let kind = SurfaceKind {
            size_px: camera.size_px,
            by_rays: batch.by_rays,
            surface_id: batch.finish.surface_id,
            front: batch.chain.is_some_and(|chain| chain.number(place) > 0),
        };
        match batch.chain.and_then(|chain| chain.surface_ids(place)) {
            Some((ids, size_px)) => {
                self.surfaces.lend(SurfaceKind { size_px, surface_id: false, ..kind }).with_ids(ids)
            }
            None => self.surfaces.lend(kind),
        }
    }

    fn record_surfaces(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        cameras: &wgpu::Buffer,
        surfaces: &[Surfaces],
        counts: Option<&wgpu::Buffer>,
    ) -> Result<(), RenderError> {
        let (shading, surface_id) = (batch.finish.shading, batch.finish.surface_id);
        match &batch.traced {
            Some(traced) if batch.by_rays => {
                let work =
                    primary::PrimaryWork { traced, shading, surface_id, counts, first: 0, leave_out: None, earlier: 0 };
                primary::record(&self.gpu, &self.pipelines, frame, work, cameras, surfaces)
            }
            _ => {
                let DrawWork { scene, scene_time_s, .. } = batch.work;
                let work = RasterWork { scene, shading, scene_time_s, surface_id, leave_out: None, earlier: 0 };
                self.rasterizer.record(frame, work, batch.cameras, surfaces)
            }
        }
    }

    /// Image after image: each needs to know what those before it hold.
    fn record_chain(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        chain: Chain<'_>,
        cameras: &wgpu::Buffer,
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        let shading = batch.finish.shading;
        for (place, (camera, target)) in batch.cameras.iter().zip(surfaces).enumerate() {
            let earlier = chain.number(place);
            let surface_id = target.ids().is_some();
            let target = std::slice::from_ref(target);
            let leaves_out = earlier > 0;
            match &batch.traced {
                Some(traced) if batch.by_rays => {
                    let first = place as u32;
                    let leave_out = leaves_out.then_some((chain.leave_out, chain.known, camera));
                    let work =
                        primary::PrimaryWork { traced, shading, surface_id, counts: None, first, leave_out, earlier };
                    primary::record(&self.gpu, &self.pipelines, frame, work, cameras, target)?;
                }
                _ => {
                    let DrawWork { scene, scene_time_s, .. } = batch.work;
                    let leave_out = leaves_out.then_some((chain.leave_out, chain.known));
                    let work = RasterWork { scene, shading, scene_time_s, surface_id, leave_out, earlier };
                    self.rasterizer.record(frame, work, std::slice::from_ref(camera), target)?;
                }
            }
            if chain.keep {
                let image = (&target[0], batch.by_rays);
                chain.known.keep(&self.gpu, &self.pipelines, frame, (earlier, place as u32), image, cameras)?;
            }
        }
        Ok(())
    }

    fn record_light(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        surfaces: &[Surfaces],
        sums: &Sums,
        planes: usize,
    ) -> Result<Vec<PooledBuffer>, RenderError> {
        let parts = parts_of(sums.ranges());
        let cameras: Vec<_> =
            parts.into_iter().map(|part| uniform(&self.gpu, &pixel_cameras(batch, sums, part, planes))).collect();
        let lighting = batch.work.lighting;
        let stack = batch.traced.as_deref().map(Form::traced).unwrap_or_default();
        let form = Form {
            pass: Pass::Illuminate,
            by_rays: batch.by_rays,
            shadow_rays: match lighting.shadow_rays() {
                0 => ShadowRays::None,
                1 if matches!(lighting.direct, crate::Direct::Shadows) => ShadowRays::One,
                _ => ShadowRays::Many,
            },
            occluded: lighting.occlusion.is_some(),
            continued: sums.rays_before() > 0,
            visibility: batch.finish.visibility,
            light_count: batch.finish.light_count,
            ..if lighting.is_traced() { stack } else { Form::default() }
        };
        let illuminator = Illuminator { gpu: &self.gpu, pool: &self.pool, pipelines: &self.pipelines };
        let work = IlluminateWork {
            form,
            traced: batch.traced.as_deref().filter(|_| lighting.is_traced()),
            illumination: &batch.work.scene.illumination,
            cameras: &cameras,
            sums: &sums.buffer,
            adaptive: lighting.rate != Rate::Full,
        };
        illuminator.record(frame, work, surfaces)
    }

    fn record_finish(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        cameras: &wgpu::Buffer,
        surfaces: &[Surfaces],
        (sums, words): (&wgpu::Buffer, &wgpu::Buffer),
    ) -> Result<(), RenderError> {
        let pipeline = self.pipelines.get(batch.finish)?;
        let [r, g, b] = batch.work.scene.background_linear.to_array();
        let view_cell_m = batch.chain.map_or(0.0, |chain| chain.known.view_cell_m);
        let finish = self.gpu.buffer_with("finish", &[r, g, b, view_cell_m], BufferUsages::UNIFORM);
        for (number, target) in (0..).zip(surfaces) {
            let mut resources = vec![
                window(cameras, PIXEL_CAMERA_BYTES),
                texture(&target.surface),
                texture(&target.depth),
                words.as_entire_binding(),
                sums.as_entire_binding(),
                finish.as_entire_binding(),
                batch.work.scene.illumination.as_entire_binding(),
            ];
            resources.extend(target.ids().filter(|_| batch.finish.surface_id).map(texture));
            resources.extend(batch.finish.leave_out.map(|_| texture(target.front())));
            let own = bind_group(&self.gpu, &pipeline.get_bind_group_layout(0), resources);
            let groups = target.size_px().map(|side| side.div_ceil(8));
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &own, &[number * PIXEL_CAMERA_STRIDE]);
            pass.dispatch_workgroups(groups.x, groups.y, 1);
        }
        Ok(())
    }

    /// Sums to add to: those of the step before, or new ones.
    fn sums(&self, batch: &Batch<'_>, bytes: u64) -> Sums {
        let DrawWork { lighting, refinement, .. } = batch.work;
        let wanted = [lighting.shadow_rays(), lighting.occlusion_rays()].map(|rays| refinement.share_of(rays));
        let kept = (refinement.steps > 1).then(|| self.accumulations.take(&batch.key(), wanted)).flatten();
        kept.unwrap_or_else(|| Sums::new(self.pool.lend_storage("light", bytes.max(4)), wanted))
    }

    fn keep(&self, batch: &Batch<'_>, sums: Sums) {
        let Refinement { step, steps } = batch.work.refinement;
        if step + 1 < steps {
            self.accumulations.put(batch.key(), sums);
        }
    }
}

impl Chain<'_> {
    /// In its set, of the image at this place of the batch: how many others it may leave out what they hold of.
    fn number(&self, place: usize) -> usize {
        self.wanted[self.first + place] as usize
    }

    /// Where its surface ids are drawn, for images after it to ask; and what is drawn with them is as large.
    fn surface_ids(&self, place: usize) -> Option<(wgpu::TextureView, UVec2)> {
        let ids = self.keep.then(|| self.known.surface_ids(self.number(place))).flatten();
        ids.map(|ids| (ids.clone(), self.known.size_px()))
    }
}

impl Batch<'_> {
    fn key(&self) -> Key {
        let DrawWork { scene, lighting, scene_time_s, .. } = self.work;
        // What a chain's image shows depends on all cameras of its set, and on its place among them.
        let (of_set, earlier) = self.chain.map_or((&[][..], 0), |chain| (&chain.known.cameras[..], chain.first));
        let cameras = [of_set, self.cameras].concat();
        Key::of(scene, lighting, scene_time_s, &cameras, Form { earlier, ..self.finish })
    }

    fn occlusion_radius_m(&self) -> f32 {
        let diagonal_m = self.work.scene.bounds_in_world().size().length();
        let named = self.work.lighting.occlusion.and_then(|occlusion| occlusion.radius_m);
        named.unwrap_or(diagonal_m * OCCLUSION_OF_DIAGONAL)
    }
}

/// Rays of each kind that one dispatch traces for a pixel: the software device ends all loops of an invocation after
/// 65,535 turns together, and a GPU may take a long dispatch for a hung one.
const RAYS_A_DISPATCH: u32 = 32;

/// Ranges of rays, cut into parts of that many.
fn parts_of(ranges: [Range<u32>; 2]) -> Vec<[Range<u32>; 2]> {
    let most = ranges.iter().map(|range| range.len().div_ceil(RAYS_A_DISPATCH as usize)).max().unwrap_or(0).max(1);
    let part = |range: &Range<u32>, number: u32| {
        let at = |number: u32| (range.start + number * RAYS_A_DISPATCH).min(range.end);
        at(number)..at(number + 1)
    };
    (0..most as u32).map(|number| ranges.each_ref().map(|range| part(range, number))).collect()
}

/// The cameras as shaders see them, with their places in the batch's planes and the rays to be traced.
fn pixel_cameras(
    batch: &Batch<'_>,
    sums: &Sums,
    [shadow, occlusion]: [Range<u32>; 2],
    planes: usize,
) -> Vec<PixelCamera> {
    let [all_shadow, all_occlusion] = sums.ranges();
    let tolerance = match batch.work.lighting.rate {
        Rate::Full => 0.0,
        Rate::Adaptive { tolerance } => tolerance,
    };
    let (mut first_word, mut first_sum) = (0, 0);
    let place = |camera: &PinholeCamera| {
        let placed = PixelCamera {
            first_word,
            first_sum,
            first_shadow_ray: shadow.start,
            shadow_rays: shadow.end - shadow.start,
            first_occlusion_ray: occlusion.start,
            occlusion_rays: occlusion.end - occlusion.start,
            // Without rays, what arrives is known at once.
            shadow_rays_in_sum: all_shadow.end.max(1),
            occlusion_rays_in_sum: all_occlusion.end.max(1),
            occlusion_radius_m: batch.occlusion_radius_m(),
            tolerance,
            ..PixelCamera::of(camera)
        };
        first_word += placed.pixel_count * planes as u32;
        first_sum += placed.pixel_count * batch.finish.sum_planes() as u32;
        placed
    };
    batch.cameras.iter().map(place).collect()
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
    fn rays_are_traced_in_parts_that_leave_none_out() {
        assert_eq!(parts_of([0..0, 0..0]), [[0..0, 0..0]]);
        assert_eq!(parts_of([3..70, 0..16]), [[3..35, 0..16], [35..67, 16..16], [67..70, 16..16]]);
    }

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
