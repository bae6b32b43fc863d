//! One submission: surfaces, their light, their planes.

use std::sync::Arc;

use gpu::{BufferPool, Frame, FrameResult, Gpu, PooledBuffer, Readback, Templates};
use parking_lot::Mutex;

use crate::{
    Direct, RenderError,
    accumulation::{Accumulations, Sums},
    batch::Batch,
    finish::{Finish, FinishWork},
    illuminate::{Domain, IlluminateVariant, IlluminateWork, ShadowRays},
    image_sequence::{ImageSequence, Predecessors},
    keep::Keep,
    light::Light,
    pixel_camera::uniform,
    pixel_list::PixelList,
    raster::{Raster, RasterWork},
    rays::{
        Traversal,
        primary::{Primary, PrimaryWork},
    },
    surfaces::{SurfaceKind, SurfacePool, Surfaces},
};

/// The passes of drawing, and the memory that they share.
pub(crate) struct Stages {
    gpu: Arc<Gpu>,
    pub pool: BufferPool,
    surfaces: SurfacePool,
    accumulations: Accumulations,
    raster: Raster,
    primary: Primary,
    keep: Keep,
    light: Light,
    finish: Finish,
    /// One batch at a time: the device makes no more of two, and memory holds one.
    drawing: Mutex<()>,
}

impl Stages {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self {
            gpu: gpu.clone(),
            pool: BufferPool::new(gpu),
            surfaces: SurfacePool::new(gpu),
            accumulations: Accumulations::default(),
            raster: Raster::new(gpu, templates),
            primary: Primary::new(gpu, templates),
            keep: Keep::new(gpu, templates),
            light: Light::new(gpu, templates),
            finish: Finish::new(gpu, templates),
            drawing: Mutex::default(),
        }
    }

    /// Draws a batch; the words that come back are its planes. `visit_counts` receives node visits and triangle tests.
    pub fn draw(
        &self,
        batch: &Batch<'_>,
        visit_counts: Option<&wgpu::Buffer>,
    ) -> Result<(FrameResult, Readback), RenderError> {
        let _one = self.drawing.lock();
        let [_, bytes] = batch.bytes();
        let sums = self.sums(batch)?;
        let cameras = uniform(&self.gpu, &batch.pixel_cameras(&sums, sums.ranges()));
        let mut frame = Frame::begin(&self.gpu, "draw");
        let surfaces = self.find_surfaces(&mut frame, batch, &cameras, visit_counts)?;
        let lists = self.light(&mut frame, batch, &surfaces, &sums)?;
        let words = self.finish(&mut frame, batch, &surfaces, &cameras, &sums)?;
        let host = self.pool.lend_host("planes read-back", bytes.max(4));
        let read = frame.read_back(&words, 0..bytes, host);
        let result = frame.submit().wait()?;
        drop((surfaces, lists, words));
        if batch.work.refinement.goes_on() {
            self.accumulations.put(batch.key(), sums);
        }
        Ok((result, read))
    }

    /// Sums to add to: those of the step before, or new ones.
    fn sums(&self, batch: &Batch<'_>) -> Result<Sums, RenderError> {
        let [bytes, _] = batch.bytes();
        self.gpu.check_storage_bytes("the light of a batch (bytes)", bytes)?;
        let (lighting, refinement) = (batch.lighting(), batch.work.refinement);
        let wanted = [lighting.shadow_rays(), lighting.occlusion_rays()].map(|rays| refinement.share_of(rays));
        let kept = (refinement.steps > 1).then(|| self.accumulations.take(&batch.key(), wanted)).flatten();
        Ok(kept.unwrap_or_else(|| Sums::new(self.pool.lend_storage("light", bytes.max(4)), wanted)))
    }

    /// Records which surface each pixel shows.
    fn find_surfaces(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        cameras: &wgpu::Buffer,
        visit_counts: Option<&wgpu::Buffer>,
    ) -> Result<Vec<Surfaces>, RenderError> {
        let surfaces: Vec<Surfaces> = (0..batch.cameras.len()).map(|place| self.lend(batch, place)).collect();
        match batch.sequence {
            Some(sequence) => self.find_in_sequence(frame, batch, sequence, cameras, &surfaces)?,
            None => self.find(frame, batch, (0, &surfaces), cameras, None, visit_counts)?,
        }
        Ok(surfaces)
    }

    /// Image after image: each consults those before it.
    fn find_in_sequence(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        sequence: ImageSequence<'_>,
        cameras: &wgpu::Buffer,
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        for (place, (camera, target)) in batch.cameras.iter().zip(surfaces).enumerate() {
            let predecessors = sequence.predecessors(place, camera);
            self.find(frame, batch, (place, std::slice::from_ref(target)), cameras, predecessors, None)?;
            if let Some(held) = sequence.samples(place) {
                self.keep.record(frame, (cameras, place as u32), (target, batch.finish.by_rays), held)?;
            }
        }
        Ok(())
    }

    /// The surfaces of the cameras from the `first` on.
    fn find(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        (first, surfaces): (usize, &[Surfaces]),
        cameras: &wgpu::Buffer,
        predecessors: Option<Predecessors<'_>>,
        visit_counts: Option<&wgpu::Buffer>,
    ) -> Result<(), RenderError> {
        let shading = batch.lighting().highlight();
        let surface_id = surfaces.iter().any(|target| target.surface_ids().is_some());
        if let Some(traced) = batch.primary_rays() {
            let first = first as u32;
            let work = PrimaryWork { traced, shading, surface_id, cameras, first, visit_counts, predecessors };
            return self.primary.record(frame, work, surfaces);
        }
        let (scene, scene_time_s) = (batch.scene(), batch.work.scene_time_s);
        let work = RasterWork { scene, shading, scene_time_s, surface_id, predecessors };
        self.raster.record(frame, work, &batch.cameras[first..][..surfaces.len()], surfaces)
    }

    fn lend(&self, batch: &Batch<'_>, place: usize) -> Surfaces {
        let kind = SurfaceKind {
            size_px: batch.cameras[place].size_px,
            by_rays: batch.finish.by_rays,
            surface_id: batch.finish.layout().surface_id.is_some(),
            front: batch.sequence.is_some_and(|sequence| sequence.number(place) > 0),
        };
        match batch.sequence.and_then(|sequence| sequence.surface_ids(place)) {
            Some((ids, size_px)) => {
                self.surfaces.lend(SurfaceKind { size_px, surface_id: false, ..kind }).with_ids(ids)
            }
            None => self.surfaces.lend(kind),
        }
    }

    /// Records the light that arrives at surfaces; the lists must live until the frame is done.
    fn light(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        surfaces: &[Surfaces],
        sums: &Sums,
    ) -> Result<Vec<PixelList>, RenderError> {
        let lighting = batch.lighting();
        if !lighting.is_lit() {
            return Ok(Vec::new());
        }
        let cameras: Vec<_> = batch.parts(sums).iter().map(|part| uniform(&self.gpu, part)).collect();
        let traced = batch.light_rays();
        let variant = IlluminateVariant {
            by_rays: batch.finish.by_rays,
            domain: Domain::All,
            shadow_rays: match (lighting.direct, lighting.shadow_rays()) {
                (_, 0) => ShadowRays::None,
                (Direct::Shadows, _) => ShadowRays::One,
                _ => ShadowRays::Many,
            },
            occluded: lighting.occlusion.is_some(),
            continued: sums.rays_before() > 0,
            sums: batch.finish.sums,
            traversal: traced.map(Traversal::of),
        };
        let illumination = &batch.scene().illumination;
        let work = IlluminateWork { variant, traced, illumination, cameras: &cameras, sums: &sums.buffer };
        self.light.record(frame, &self.pool, work, lighting.rate, surfaces)
    }

    /// Records the finished planes of all cameras.
    fn finish(
        &self,
        frame: &mut Frame<'_>,
        batch: &Batch<'_>,
        surfaces: &[Surfaces],
        cameras: &wgpu::Buffer,
        sums: &Sums,
    ) -> Result<PooledBuffer, RenderError> {
        let [_, bytes] = batch.bytes();
        self.gpu.check_storage_bytes("the planes of a batch (bytes)", bytes)?;
        let words = self.pool.lend_storage("planes", bytes.max(4));
        let (variant, scene, view_cell_m) = (batch.finish, batch.scene(), batch.view_cell_m());
        let work = FinishWork { variant, scene, view_cell_m, cameras, sums: &sums.buffer, words: &words };
        self.finish.record(frame, work, surfaces)?;
        Ok(words)
    }
}
