//! One submission's work: a few pictures of a scene.

use std::{hash::Hash, ops::Range, sync::Arc};

use bytemuck::Zeroable;
use depth_image::{Antialias, Camera, ToneMapping};
use glam::Vec2;
use gpu::{
    Binding, BoundGroup, ComputePass, DispatchSize, Frame, Gpu, PassCache, PooledBuffer, ShaderVariant, WorkKind,
};

use crate::accumulation::Sums;
use crate::pixel_camera::{PixelCamera, uniform};
use crate::{RenderError, rays::Traced, work::DrawWork};
use crate::{
    grid::{grid_stride, words_a_pixel},
    known_samples::ImageSequence,
    light_samples::{CachedLight, CoveredBy},
    pieces::Piece,
    planes::Output,
};

/// The share of the scene's diagonal within which occlusion is looked for, where a lighting names no radius.
const OCCLUSION_OF_DIAGONAL: f32 = 0.05;
/// Rays to all lamps, and of ambient light, that one dispatch traces for a pixel: the software device ends all loops of an
/// invocation after 65,535 turns together, and a GPU may take a long dispatch for a hung one.
const RAYS_A_DISPATCH: u32 = 32;
const CAMERAS_A_SUBMISSION: usize = 32;
/// The rays of a slice of pictures whose cost is unknown; a pixel counts as one more.
const UNKNOWN_SLICE_RAYS: u64 = 1 << 14;

/// One submission's work, once it is known how surfaces are found.
#[derive(Clone)]
pub(crate) struct Batch<'a> {
    pub work: DrawWork<'a>,
    /// All of one model.
    pub cameras: &'a [Camera],
    /// Surfaces are found by rays.
    pub by_rays: bool,
    /// The tree, where rays are traced.
    pub traced: Option<Arc<Traced>>,
    pub output: Output,
    /// From a pixel's mean to the colour of a view. Light of equal pictures is the same in every tone, so that it is no part
    /// of the output.
    pub tone: ToneMapping,
    pub sequence: Option<ImageSequence<'a>>,
    /// The images before, which cover pixels of sample images.
    pub covered_by: Option<CoveredBy<'a>>,
    /// Light that is looked up before rays are traced.
    pub cached: Option<CachedLight<'a>>,
    /// The position within the pixels.
    pub position: Position,
}

/// Some rays of each pixel.
pub(crate) struct Part {
    /// The numbers of the rays to each lamp, of these lamps, and of the rays of ambient light.
    pub counts: [u32; 3],
    /// A uniform of the pieces.
    pub cameras: wgpu::Buffer,
}

/// A batch whose passes are being recorded.
pub(crate) struct Recording<'a> {
    pub gpu: &'a Gpu,
    pub passes: &'a PassCache,
    pub batch: &'a Batch<'a>,
    /// The pictures, as dispatches make them.
    pub pieces: Vec<Piece>,
    /// A uniform of the batch's cameras, with an element for each piece.
    pub cameras: wgpu::Buffer,
    pub sums: Sums,
    /// Which places of lamps each pixel sees, where light reads that.
    pub lamp_bits: Option<PooledBuffer>,
    pub frame: Frame<'a>,
}

/// A pass with its resources.
pub(crate) struct BoundPass {
    pass: Arc<ComputePass>,
    groups: Vec<BoundGroup>,
    kind: WorkKind,
}

/// A position within the pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Position {
    pub number: u32,
    /// From the pixels' centres.
    pub offset_px: Vec2,
}

impl<'a> Batch<'a> {
    /// Work that is not traced, and without cameras, as for listed points.
    pub fn new(work: DrawWork<'a>, output: Output) -> Self {
        let position = Position::default();
        let tone = ToneMapping::NONE;
        Self {
            work,
            cameras: &[],
            by_rays: false,
            traced: None,
            output,
            tone,
            sequence: None,
            covered_by: None,
            cached: None,
            position,
        }
    }

    /// All positions within the pixels, and the cameras whose pixels' centres are there. The centre of a depth image comes first;
    /// that of a view last, for depth alone.
    pub fn positions(&self) -> Vec<(Position, Vec<Camera>)> {
        let Output { antialias, depth, samples, .. } = self.output;
        let center = (antialias > Antialias::NONE).then_some(Vec2::ZERO);
        let first = center.filter(|_| samples);
        let last = center.filter(|_| depth && !samples);
        let all = (0..).zip(first.into_iter().chain(antialias.offsets_px()).chain(last));
        let shifted = all.map(|(number, offset_px)| {
            let cameras = self.cameras.iter().map(|camera| camera.with_offset(offset_px)).collect();
            (Position { number, offset_px }, cameras)
        });
        shifted.collect()
    }

    /// Whether its cameras are single-pole cameras.
    pub fn is_single_pole(&self) -> bool {
        matches!(self.cameras.first(), Some(Camera::SinglePole(_)))
    }

    /// Words of the bits of a pixel's rays to lamps.
    pub fn lamp_words(&self) -> usize {
        words_a_pixel(self.work.lighting.grid_side(), self.work.scene.light_count)
    }

    /// Rays into the lobe of a pixel at this position.
    pub fn glossy_rays(&self) -> u32 {
        self.at_each_position(self.work.lighting.glossy_rays())
    }

    /// Rays to each lamp, and of ambient light, at this position.
    pub fn light_rays(&self) -> [u32; 2] {
        let lighting = self.work.lighting;
        [lighting.shadow_rays(), lighting.ambient_rays()].map(|rays| self.at_each_position(rays))
    }

    /// The positions within a pixel of a view share the pixel's rays. A sample has all rays at each of its positions.
    fn at_each_position(&self, rays_a_pixel: u32) -> u32 {
        let positions = if self.output.samples { 1 } else { self.output.antialias.samples() };
        rays_a_pixel.div_ceil(positions)
    }

    /// Whether colour is wanted of this position.
    pub fn has_color(&self) -> bool {
        self.output.samples || self.position.number < self.output.antialias.samples()
    }

    /// The bytes of planes of all pixels.
    pub fn bytes(&self, planes: usize) -> u64 {
        let pixels: usize = self.cameras.iter().map(Camera::pixel_count).sum();
        4 * pixels as u64 * planes as u64
    }

    /// Equal keys are the same light of the same pixels.
    pub fn key(&self) -> String {
        let DrawWork { scene, lighting, scene_time_s, .. } = self.work;
        // The samples of a sequence's image depend on all cameras of its set, and on its place among them.
        let set = self.sequence.map(|sequence| (&sequence.known.cameras, sequence.known.variant(sequence.first)));
        let covered_by = self.covered_by.map(|set| (set.surfaces.cameras(), &set.numbers[set.first..]));
        let of_set = (set, covered_by);
        format!("{:?}", (scene.identity, lighting, scene_time_s, of_set, self.cameras, self.by_rays, self.output))
    }

    /// The family of the passes over pixels, whose costs are learned.
    pub fn family(&self) -> u64 {
        let DrawWork { scene, lighting, .. } = self.work;
        WorkKind::family(&("draw", scene.identity, format!("{lighting:?}"), self.by_rays, self.output))
    }

    /// The pixels of a slice of pictures whose cost is unknown.
    pub fn unknown_slice_px(&self) -> u64 {
        let [shadow_rays, ambient_rays] = self.light_rays();
        let rays = [shadow_rays * self.lamps(), ambient_rays * self.rays_around()];
        UNKNOWN_SLICE_RAYS / (1 + rays.map(|rays| u64::from(rays.min(RAYS_A_DISPATCH))).iter().sum::<u64>())
    }

    /// Lamps that take rays.
    fn lamps(&self) -> u32 {
        self.work.scene.traced_lamps(self.work.lighting)
    }

    /// Rays that are traced for each ray of ambient light: where it meets a surface, one goes on to a lamp; where lamps have no
    /// rays, bright texels of an environment map take as many.
    fn rays_around(&self) -> u32 {
        let DrawWork { scene, lighting, .. } = self.work;
        if lighting.is_indirect() || scene.has_bright_texels() && lighting.shadow_rays() == 0 { 2 } else { 1 }
    }

    /// A uniform of the pieces with their cameras' places in the batch's planes, for each part of the rays.
    pub fn parts(&self, gpu: &Gpu, pieces: &[Piece], sums: &Sums) -> Vec<Part> {
        let parts = parts_of(&sums.rays, self.lamps(), self.rays_around()).into_iter();
        parts.map(|rays| Part { counts: rays.counts(), cameras: self.uniform(gpu, pieces, sums, &rays) }).collect()
    }

    /// A uniform for all rays.
    pub fn uniform_of_all(&self, gpu: &Gpu, pieces: &[Piece], sums: &Sums) -> wgpu::Buffer {
        let [shadow, ambient] = sums.rays.clone();
        self.uniform(gpu, pieces, sums, &Rays { shadow, lamps: 0..self.lamps(), ambient })
    }

    /// A uniform for some rays to one lamp.
    pub fn uniform_of_lamp(
        &self,
        gpu: &Gpu,
        pieces: &[Piece],
        sums: &Sums,
        lamp: u32,
        shadow: Range<u32>,
    ) -> wgpu::Buffer {
        self.uniform(gpu, pieces, sums, &Rays { shadow, lamps: lamp..lamp + 1, ambient: 0..0 })
    }

    /// The number of the first of the pixel's rays to a lamp that this position has.
    pub fn first_shadow_ray(&self) -> u32 {
        self.light_rays()[0] * self.position.number
    }

    /// Rays of each pixel's sequences that the sums are to hold: to lamps, and of ambient light.
    pub fn wanted_rays(&self) -> [u32; 2] {
        self.light_rays().map(|rays| self.work.refinement.share_of(rays))
    }

    /// A uniform for each part of `rays`, for a list with room for `capacity` points.
    pub fn parts_of_points(&self, gpu: &Gpu, rays: &[Range<u32>; 2], capacity: u32) -> Vec<Part> {
        let list = PixelCamera { pixel_count: capacity, ..PixelCamera::zeroed() };
        let parts = parts_of(rays, self.lamps(), self.rays_around()).into_iter().map(|part| {
            let cameras = uniform(gpu, "points", std::iter::once(self.with_rays(list, &part, rays)));
            Part { counts: part.counts(), cameras }
        });
        parts.collect()
    }

    /// A recording over `count` listed points, and the parts of their rays.
    pub fn record_points<'r>(
        &'r self,
        gpu: &'r Gpu,
        passes: &'r PassCache,
        label: &'static str,
        sums: PooledBuffer,
        count: u32,
    ) -> (Recording<'r>, Vec<Part>) {
        let rays = self.wanted_rays().map(|rays| 0..rays);
        let parts = self.parts_of_points(gpu, &rays, count);
        let cameras = parts[0].cameras.clone();
        let sums = Sums { buffer: sums, rays };
        let frame = Frame::begin(gpu, label, self.work.turn);
        let recording =
            Recording { gpu, passes, batch: self, pieces: Vec::new(), cameras, sums, lamp_bits: None, frame };
        (recording, parts)
    }

    /// A camera with these rays, and those that its sums hold afterwards.
    fn with_rays(&self, camera: PixelCamera, rays: &Rays, [shadow, ambient]: &[Range<u32>; 2]) -> PixelCamera {
        let DrawWork { scene, lighting, .. } = self.work;
        let diagonal_m = scene.bounds_in_world.size().length();
        // Each position has rays of its own among those of the pixel's sequence.
        let [first_shadow_ray, first_ambient_ray] = self.light_rays().map(|rays| rays * self.position.number);
        PixelCamera {
            first_shadow_ray: first_shadow_ray + rays.shadow.start,
            shadow_rays: rays.shadow.end - rays.shadow.start,
            first_light: rays.lamps.start,
            end_light: rays.lamps.end,
            first_ambient_ray: first_ambient_ray + rays.ambient.start,
            ambient_rays: rays.ambient.end - rays.ambient.start,
            // Without rays, all light is known at once.
            shadow_rays_in_sum: shadow.end.max(1),
            ambient_rays_in_sum: ambient.end.max(1),
            grid_side: lighting.grid_side(),
            grid_count: lighting.grid_side().pow(2),
            grid_stride: grid_stride(lighting.grid_side().max(1)),
            occlusion_radius_m: lighting.occlusion_radius_m().unwrap_or(diagonal_m * OCCLUSION_OF_DIAGONAL),
            ..camera
        }
    }

    /// A uniform for these rays.
    fn uniform(&self, gpu: &Gpu, pieces: &[Piece], sums: &Sums, rays: &Rays) -> wgpu::Buffer {
        let [planes, sum_planes] = [self.output.layout().count, self.output.sums.count()].map(|count| count as u32);
        let mut first_word = 0;
        let mut first_sum = 0;
        let mut first_pixel = 0;
        let mut placed = Vec::with_capacity(self.cameras.len());
        for camera in self.cameras {
            let camera =
                PixelCamera { first_word, first_sum, first_pixel, ..PixelCamera::of(camera, self.position.offset_px) };
            first_word += camera.pixel_count * planes;
            first_sum += camera.pixel_count * sum_planes;
            first_pixel += camera.pixel_count;
            placed.push(self.with_rays(camera, rays, &sums.rays));
        }
        let all = pieces.iter().map(|&Piece { camera, first_row, end_row, .. }| PixelCamera {
            first_row,
            end_row,
            ..placed[camera]
        });
        uniform(gpu, "pixel cameras", all)
    }
}

impl Recording<'_> {
    /// The pieces of a picture.
    pub fn pieces_of(&self, camera: usize) -> Vec<Piece> {
        self.pieces.iter().copied().filter(|piece| piece.camera == camera).collect()
    }

    /// Binds a pass to resources of its own, and to those of the batch and the scene where none of its own has their name. The
    /// time of a unit of its work depends on the variant and on `detail`.
    pub fn bind<'r>(
        &'r self,
        variant: &impl ShaderVariant,
        detail: impl Hash,
        own: impl IntoIterator<Item = Binding<'r>>,
    ) -> Result<BoundPass, RenderError> {
        let Batch { work, traced, .. } = self.batch;
        let pass = self.passes.get(variant)?;
        let mut bindings: Vec<Binding<'r>> = own.into_iter().collect();
        bindings.extend([Binding::buffer("camera", &self.cameras), Binding::buffer("sums", &self.sums.buffer)]);
        bindings.extend(self.lamp_bits.iter().map(|bits| Binding::buffer("lamp_bits", bits)));
        bindings.extend(work.scene.bindings());
        bindings.extend(traced.iter().flat_map(|traced| traced.bindings()));
        let groups = pass.bind_all(&bindings)?;
        Ok(BoundPass { pass, groups, kind: WorkKind::new(self.batch.family(), &(variant.name(), detail)) })
    }

    /// Records a dispatch of a pass over all pixels of a picture.
    pub fn dispatch(&mut self, bound: &BoundPass, camera: usize) {
        for piece in self.pieces_of(camera) {
            self.dispatch_piece(bound, piece, piece.size());
        }
    }

    /// Records a dispatch of this size for a piece of a picture.
    pub fn dispatch_piece(&mut self, bound: &BoundPass, piece: Piece, size: DispatchSize<'_>) {
        self.dispatch_element(bound, piece.element, piece.pixel_count(), size);
    }

    /// Records a dispatch that sees an element of the cameras' buffer.
    pub fn dispatch_element(&mut self, bound: &BoundPass, element: u32, units: u32, size: DispatchSize<'_>) {
        let groups: Vec<&BoundGroup> = bound.groups.iter().collect();
        bound.pass.dispatch_each(&mut self.frame, &groups, element..element + 1, size);
        self.frame.cut(bound.kind, units.into());
    }
}

/// Runs of cameras of one model, bounded in number and pixels; at least one camera each.
pub(crate) fn batches(cameras: &[Camera], most_pixels: usize) -> impl Iterator<Item = &[Camera]> {
    let mut rest = cameras;
    std::iter::from_fn(move || {
        let mut pixels = 0;
        let fitting = rest.iter().take(CAMERAS_A_SUBMISSION).take_while(|camera| {
            pixels += camera.pixel_count();
            pixels <= most_pixels && camera.is_of_model(&rest[0])
        });
        let count = fitting.count().max(1).min(rest.len());
        let (batch, others) = rest.split_at(count);
        rest = others;
        (!batch.is_empty()).then_some(batch)
    })
}

/// Numbers of rays to each of some lamps, and of ambient light.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Rays {
    shadow: Range<u32>,
    lamps: Range<u32>,
    ambient: Range<u32>,
}

impl Rays {
    fn counts(&self) -> [u32; 3] {
        [&self.shadow, &self.lamps, &self.ambient].map(|range| range.len() as u32)
    }
}

/// Rays to all lamps and of ambient light, cut into parts. A part traces at most [`RAYS_A_DISPATCH`] rays to lamps and as many
/// of ambient light. Each of these counts as `rays_around` traced ones.
fn parts_of([shadow, ambient]: &[Range<u32>; 2], lamp_count: u32, rays_around: u32) -> Vec<Rays> {
    let lamps_a_part = if shadow.is_empty() { lamp_count } else { lamp_count.min(RAYS_A_DISPATCH) }.max(1);
    let lamps = ranges(&(0..lamp_count), lamps_a_part);
    let to_lamps = ranges(shadow, RAYS_A_DISPATCH / lamps_a_part.min(RAYS_A_DISPATCH));
    let to_lamps = to_lamps.iter().flat_map(|shadow| lamps.iter().map(|lamps| (shadow.clone(), lamps.clone())));
    let mut to_lamps: Vec<(Range<u32>, Range<u32>)> = to_lamps.collect();
    let mut around = ranges(ambient, RAYS_A_DISPATCH / rays_around);
    let count = to_lamps.len().max(around.len());
    to_lamps.resize(count, (shadow.end..shadow.end, 0..0));
    around.resize(count, ambient.end..ambient.end);
    to_lamps.into_iter().zip(around).map(|((shadow, lamps), ambient)| Rays { shadow, lamps, ambient }).collect()
}

/// A range in pieces of at most this length; one piece where it is empty.
fn ranges(range: &Range<u32>, most: u32) -> Vec<Range<u32>> {
    let starts = range.clone().step_by(most as usize).chain(range.is_empty().then_some(range.start));
    starts.map(|start| start..(start + most).min(range.end)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_traced_in_parts_that_cover_all_of_them() {
        let rays = |shadow, lamps, ambient| Rays { shadow, lamps, ambient };
        assert_eq!(parts_of(&[0..0, 0..0], 200, 1), [rays(0..0, 0..200, 0..0)]);
        assert_eq!(parts_of(&[0..0, 0..40], 2, 1), [rays(0..0, 0..2, 0..32), rays(0..0, 0..0, 32..40)]);
        assert_eq!(parts_of(&[0..0, 0..20], 0, 2), [rays(0..0, 0..0, 0..16), rays(0..0, 0..0, 16..20)]);
        let one_lamp = [rays(3..35, 0..1, 0..16), rays(35..67, 0..1, 16..16), rays(67..70, 0..1, 16..16)];
        assert_eq!(parts_of(&[3..70, 0..16], 1, 1), one_lamp);
        for lamp_count in [1, 3, 31, 32, 33, 200, 255] {
            let mut seen = vec![0; 64 * lamp_count as usize];
            for part in parts_of(&[0..64, 0..64], lamp_count, 1) {
                assert!(part.shadow.len() * part.lamps.len() <= RAYS_A_DISPATCH as usize, "{part:?}");
                let each = part.lamps.flat_map(|lamp| part.shadow.clone().map(move |ray| lamp * 64 + ray));
                each.for_each(|ray| seen[ray as usize] += 1);
            }
            assert!(seen.iter().all(|&times| times == 1), "{lamp_count} lamps");
        }
    }
}
