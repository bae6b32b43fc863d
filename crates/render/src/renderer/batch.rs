//! One submission of the renderer: the surfaces of a few pictures, their light, their planes.

use std::{
    ops::Range,
    sync::{Arc, PoisonError},
};

use depth_image::PinholeCamera;
use glam::UVec2;
use gpu::{Frame, FrameResult, PooledBuffer, Readback};
use wgpu::BufferUsages;

use super::{DrawWork, Refinement, Renderer};
use crate::{
    Rate, RenderError,
    accumulation::{Key, Sums},
    binding::{bind_group, texture, window},
    form::{Form, Pass, ShadowRays},
    illuminate::{IlluminateWork, Illuminator},
    known::{Known, LeaveOut},
    pixel_camera::{PIXEL_CAMERA_BYTES, PIXEL_CAMERA_STRIDE, PixelCamera, uniform},
    raster::RasterWork,
    rays::{Traced, primary},
    surfaces::{SurfaceKind, Surfaces},
};

/// Of the scene's diagonal, where a lighting names no radius of occlusion.
const OCCLUSION_OF_DIAGONAL: f32 = 0.05;

/// One submission's work, once it is known how surfaces are found.
pub(super) struct Batch<'a> {
    pub(super) work: DrawWork<'a>,
    pub(super) cameras: &'a [PinholeCamera],
    pub(super) traced: Option<Arc<Traced>>,
    pub(super) by_rays: bool,
    /// Of the last pass.
    pub(super) finish: Form,
    pub(super) chain: Option<Chain<'a>>,
}

/// Images that leave out what those before them hold.
#[derive(Clone, Copy)]
pub(super) struct Chain<'a> {
    pub(super) leave_out: LeaveOut,
    pub(super) known: &'a Known,
    /// Places in the set of the images to be drawn, and which of them is the batch's first.
    pub(super) wanted: &'a [u32],
    pub(super) first: usize,
    /// Whether what the images hold is kept for those after them.
    pub(super) keep: bool,
}

impl Renderer {
    /// One submission: surfaces, light, planes.
    pub(super) fn draw(
        &self,
        batch: &Batch<'_>,
        counts: Option<&wgpu::Buffer>,
    ) -> Result<(FrameResult, Readback), RenderError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_traced_in_parts_that_leave_none_out() {
        assert_eq!(parts_of([0..0, 0..0]), [[0..0, 0..0]]);
        assert_eq!(parts_of([3..70, 0..16]), [[3..35, 0..16], [35..67, 16..16], [67..70, 16..16]]);
    }
}
