//! Mirror images of the scene: rays off the mirrors that a view shows are followed in images of the mirrors' surroundings or in a cube,
//! mirror after mirror, and what they find is added to the pixels.

mod curved_search;
pub(crate) mod mips;
mod mirror_cells;

use std::ops::RangeInclusive;

use bytemuck::{Pod, Zeroable};
use depth_image::Highlight;
use gpu::{Binding, DynamicUniforms, GpuError, PooledBuffer, ShaderVariant, shader_variant, uniform_elements};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

pub use curved_search::CurvedSearch;
pub(crate) use curved_search::{CurvedWalk, LONGEST_STEP, MAX_WALK_STEPS};
use mirror_cells::reflectors_of_cube;
pub use mirror_cells::{MirrorCell, Mirrors};

use crate::methods::joint_carve::Carve;
use crate::pixel_list::{GpuPixelList, LIST_WORKGROUP, PixelList, empty_lists};
use crate::recording::{nearest_first, plane_bindings};
use crate::reflectors::Reflection;
use crate::single_pole::GpuPole;
use crate::view_work::{GpuSampleCamera, GpuViewCamera, GpuViewWork, ONE_VIEW, SetVariant};
use crate::{device::Device, error::ReconstructionError, recording::Recording};

/// A ray meets nothing before it is this many footprints above its mirror: the mirror's own samples lie below.
pub(crate) const START_FOOTPRINTS: f32 = 3.0;
/// A ray at grazing incidence counts as rising by this sine at least.
pub(crate) const LEAST_RISE: f32 = 0.25;
/// The coarsest level at which a mirrored ray is searched: it has no tile start.
pub(crate) const BOUNCE_LEVEL: u32 = 6;
/// A ray passes from image to image around a mirror: the times that it is marched in each.
pub(crate) const MARCH_ROUNDS: u32 = 2;
/// A ray that got to the end of its way but for this share has ended.
pub(crate) const LEAST_WAY: f32 = 1e-5;
/// The cosine between the normals of neighbouring samples below which an edge of the mirror runs between them.
pub(crate) const EDGE_COSINE: f32 = 0.7;

/// `MirrorBox` of `bounce/list.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuMirrorBox {
    pub min_in_world: [f32; 3],
    pub first_listed: u32,
    pub max_in_world: [f32; 3],
    pub start_m: f32,
}

/// `MirroredRay` of `bounce/ray.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuMirroredRay {
    pub origin_in_world: [f32; 3],
    pub pixel: u32,
    pub direction: [f32; 3],
    pub guess: u32,
    pub throughput_rgb9e5: u32,
    pub near_m: f32,
    pub width_m: f32,
    pub spread: f32,
}

/// `GlossySurface` of `bounce/glossy.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuGlossySurface {
    pub point_in_world: [f32; 3],
    pub pixel: u32,
    pub towards_eye: [f32; 3],
    pub normal_oct16: u32,
    pub throughput_linear: [f32; 3],
    pub roughness: f32,
    pub open: f32,
    pub is_mirrored: u32,
    pub padding: [u32; 2],
}

/// The memory for the mirrored rays of a batch.
pub(crate) struct Bounces<'s> {
    /// Smallest first.
    pub cells: Vec<MirrorCell<'s>>,
    /// Mirrors that a ray meets.
    pub reflections: u32,
    /// Rays into the lobe of a rough surface, sent or gathered.
    pub glossy_rays: u32,
    /// Rough surfaces, which are to send rays, and the light that these bring, 12 bytes a pixel.
    pub lobes: Option<[PooledBuffer; 2]>,
    /// A `MirrorBox` for each cell.
    boxes: Buffer,
    /// A `ViewWork` for each cell.
    pub works: Vec<Buffer>,
    /// The `Poles` of each cell with images of single-pole cameras.
    poles: Vec<Option<Buffer>>,
    rays: [PooledBuffer; 2],
    /// Of the rays of this mirror and of the next, of those that the march leaves, and of those that stay unknown.
    listed: [PooledBuffer; 4],
    /// Colours, inverse ways and provenance of rays.
    pub planes: [PooledBuffer; 3],
}

/// Rays off one mirror: the numbers of those of each cell.
pub(crate) struct RayLists {
    /// A [`GpuPixelList`] for each cell, and one that counts all rays.
    pub lists: Buffer,
    /// Which of the two memories of rays holds them.
    memory: usize,
}

impl<'s> Bounces<'s> {
    /// Lends the memory for one ray a pixel. `None` where there is nothing to follow rays in.
    pub fn lend(
        device: &Device,
        mirrors: Mirrors<'s>,
        pixels: usize,
        curved_search: CurvedSearch,
    ) -> Result<Option<Self>, ReconstructionError> {
        let mut cells = mirrors.cells.to_vec();
        if cells.is_empty() {
            return Ok(None);
        }
        let limits = device.gpu.device.limits();
        let most_rays = u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(LIST_WORKGROUP);
        GpuError::check_limit("the mirrored rays of a batch", pixels as u64, most_rays)?;
        cells.sort_by(|a, b| {
            let [a_m3, b_m3] = [a, b].map(|cell| cell.bounds.size().element_product());
            a.is_cube().cmp(&b.is_cube()).then(a_m3.total_cmp(&b_m3))
        });
        let mut boxes = Vec::with_capacity(cells.len());
        let mut works = Vec::with_capacity(cells.len());
        let mut poles = Vec::with_capacity(cells.len());
        for (number, cell) in cells.iter().enumerate() {
            let first_pixel = (number * pixels) as u32;
            boxes.push(GpuMirrorBox {
                min_in_world: cell.bounds.min.to_array(),
                first_listed: first_pixel,
                max_in_world: cell.bounds.max.to_array(),
                start_m: cell.surroundings.cube.as_ref().map_or(0.0, |cube| cube.start_m),
            });
            let view = GpuViewCamera { number: number as u32, first_pixel, size_px: [1; 2], ..GpuViewCamera::zeroed() };
            let work = GpuViewWork { view, volume: cell.surroundings.volume, ..GpuViewWork::zeroed() };
            let cameras = nearest_first(cell.surroundings, cell.bounds.center());
            let bytes = [bytemuck::bytes_of(&work), bytemuck::cast_slice(&cameras)].concat();
            works.push(device.gpu.buffer_with("mirror cell", &uniform_elements([bytes]), BufferUsages::UNIFORM));
            poles.push(poles_of(device, cell, &cameras, curved_search));
        }
        // In a light field lobes are gathered.
        let has_plain_cube =
            cells.iter().filter_map(|cell| cell.surroundings.cube.as_ref()).any(|cube| cube.light_field.is_none());
        let lobes = if mirrors.glossy_rays > 0 && has_plain_cube {
            let surfaces = device.lend("glossy surfaces", size_of::<GpuGlossySurface>() * pixels)?;
            Some([surfaces, device.lend("light of lobes", 12 * pixels)?])
        } else {
            None
        };
        let rays = || device.lend("mirrored rays", size_of::<GpuMirroredRay>() * pixels);
        let listed = || device.lend("lists of mirrored rays", 4 * pixels * cells.len());
        let plane = |label| device.lend(label, 4 * pixels);
        Ok(Some(Self {
            reflections: mirrors.reflections,
            glossy_rays: mirrors.glossy_rays,
            lobes,
            boxes: device.gpu.buffer_with("mirror boxes", &boxes, BufferUsages::UNIFORM),
            works,
            poles,
            rays: [rays()?, rays()?],
            listed: [listed()?, listed()?, listed()?, listed()?],
            planes: [plane("mirrored colour")?, plane("mirrored depth")?, plane("mirrored provenance")?],
            cells,
        }))
    }

    /// Empty lists for the rays that come after those of `before`.
    pub fn next(&self, device: &Device, before: Option<&RayLists>) -> RayLists {
        let lists = empty_lists(&device.gpu, "mirrored rays", self.cells.len() + 1);
        RayLists { lists, memory: before.map_or(0, |before| 1 - before.memory) }
    }

    /// Records what follows the rays of each cell, and those off the mirrors that they meet, mirror after mirror.
    pub fn each_mirror(
        &self,
        recording: &mut Recording<'_>,
        first: RayLists,
        reflections: RangeInclusive<u32>,
        mut follow: impl FnMut(&mut Recording<'_>, CellRays<'_>) -> Result<(), ReconstructionError>,
    ) -> Result<(), ReconstructionError> {
        let mut lists = first;
        for reflection in reflections.clone() {
            let next = (reflection < *reflections.end()).then(|| self.next(recording.device, Some(&lists)));
            for cell in 0..self.cells.len() {
                follow(recording, CellRays { lists: &lists, next: next.as_ref(), cell, reflection })?;
            }
            let Some(next) = next else { break };
            lists = next;
        }
        Ok(())
    }

    /// The resources of `bounce/list.wgsl`.
    pub fn spawn_bindings<'b>(&'b self, next: &'b RayLists) -> [Binding<'b>; 4] {
        [
            Binding::buffer("mirror_boxes", &self.boxes),
            Binding::buffer("next_rays", &self.rays[next.memory]),
            Binding::buffer("next_listed", &self.listed[next.memory]),
            Binding::buffer("next_lists", &next.lists),
        ]
    }

    /// Lists rays of the first cell.
    pub fn listing(&self, device: &Device, rays: &[GpuMirroredRay]) -> RayLists {
        let count = rays.len() as u32;
        device.gpu.queue.write_buffer(&self.rays[0], 0, bytemuck::cast_slice(rays));
        let numbers: Vec<u32> = (0..count).collect();
        device.gpu.queue.write_buffer(&self.listed[0], 0, bytemuck::cast_slice(&numbers));
        let list = GpuPixelList { workgroups: [count.div_ceil(LIST_WORKGROUP), 1, 1], count };
        let usage = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        RayLists { lists: device.gpu.buffer_with("listed rays", &[list; 2], usage), memory: 0 }
    }

    /// What must live until the device is done.
    pub fn into_memory(self) -> impl Iterator<Item = PooledBuffer> {
        let lobes = self.lobes.into_iter().flatten();
        self.rays.into_iter().chain(self.listed).chain(self.planes).chain(lobes)
    }

    /// The rays of a list.
    pub fn list_bindings<'b>(&'b self, lists: &'b RayLists) -> [Binding<'b>; 3] {
        [
            Binding::buffer("rays", &self.rays[lists.memory]),
            Binding::buffer("listed_pixels", &self.listed[lists.memory]),
            Binding::buffer("lists", &lists.lists),
        ]
    }

    /// A list of rays that one pass leaves to the next, in the memory of this number.
    fn left(&self, device: &Device, memory: usize) -> PixelList {
        PixelList::empty(&device.gpu, (*self.listed[memory]).clone(), self.cells.len())
    }

    /// The listed rays of a cell, and its images.
    fn cell_bindings<'b>(&'b self, rays: &CellRays<'b>) -> Vec<Binding<'b>> {
        let mut bindings = self.cells[rays.cell].surroundings.image_bindings();
        bindings.push(Binding::buffer("work", &self.works[rays.cell]));
        bindings.extend(self.poles[rays.cell].as_ref().map(|poles| Binding::buffer("poles", poles)));
        bindings.extend(self.list_bindings(rays.lists));
        bindings
    }
}

shader_variant!(BounceMarch(SetVariant), "bounce/march.wgsl", ONE_VIEW);

/// The switches of `bounce/land.wgsl`.
#[derive(Debug)]
pub(crate) struct Land {
    set: SetVariant,
    /// The cell's images are those of single-pole cameras.
    single_pole: bool,
    /// What the cell's images reflect, under the light of the view.
    reflection: Reflection,
}

impl ShaderVariant for Land {
    const TEMPLATE: &'static str = "bounce/land.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { single_pole => self.single_pole, ..self.reflection.context(self.set) }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for set in SetVariant::all() {
            let all_lit = Reflection::all().into_iter();
            for reflection in all_lit.filter(|lit| lit.highlight != Some(Highlight::BlinnPhong)) {
                all.extend([false, true].map(|single_pole| Self { set, single_pole, reflection }));
            }
        }
        all
    }
}

/// The listed rays of a mirror cell.
#[derive(Clone, Copy)]
pub(crate) struct CellRays<'r> {
    pub lists: &'r RayLists,
    /// Takes the rays off mirrors that these rays meet.
    pub next: Option<&'r RayLists>,
    pub cell: usize,
    /// Mirrors on the way so far.
    pub reflection: u32,
}

/// Where the rays of a cell end, in its images.
pub(crate) fn follow(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    rays: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let CellRays { lists, cell, reflection, .. } = rays;
    let set = bounces.cells[cell].surroundings.variant();
    let unknown = bounces.left(recording.device, 3);
    let mut own = bounces.cell_bindings(&rays);
    own.extend(plane_bindings(bounces.planes.each_ref().map(|plane| &**plane)));
    let found = unknown.written_bindings().into_iter().chain(own.iter().cloned());
    if bounces.poles[cell].is_some() {
        return recording.dispatch_listed(&CurvedWalk(set), found, &lists.lists, cell, (cell, reflection));
    }
    let left = bounces.left(recording.device, 2);
    let marched = left.written_bindings().into_iter().chain(own.iter().cloned());
    recording.dispatch_listed(&BounceMarch(set), marched, &lists.lists, cell, (cell, reflection))?;
    let carved = left.bindings().into_iter().chain(found);
    let carve = Carve { set, stop_level: 0, bounced: true };
    recording.dispatch_listed(&carve, carved, &left.lists, cell, (cell, reflection))
}

/// Adds what the rays of a cell found to their pixels.
pub(crate) fn land(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    rays: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let CellRays { lists, next, cell, .. } = rays;
    let set = bounces.cells[cell].surroundings;
    // Rays come from reflectors: of the view's images, or of the base alone.
    let base = bounces.cells.last().and_then(|cell| reflectors_of_cube(cell.surroundings));
    let Some(view_reflectors) = recording.set.reflectors.as_ref().or(base) else { return Ok(()) };
    let reflectors = set.reflectors.as_ref().filter(|reflectors| {
        reflectors.highlight == view_reflectors.highlight && reflectors.lights == view_reflectors.lights
    });
    let has_map = recording.set.environment.is_some();
    let mirror_cells = next.map(|_| bounces.cells.len());
    let reflection = Reflection {
        lights: view_reflectors.lights,
        environment_map: has_map,
        ..Reflection::of(reflectors, mirror_cells, None, has_map)
    };
    let variant = Land { set: set.variant(), single_pole: !set.poles.is_empty(), reflection };
    let [ray_color, inverse_depth, provenance] = &bounces.planes;
    let mut own = vec![
        Binding::buffer("ray_color", ray_color),
        Binding::buffer("inverse_depth", inverse_depth),
        Binding::buffer("provenance", provenance),
        // The first of a name counts: not the illumination of the cell's images.
        Binding::buffer("illumination", &view_reflectors.illumination),
    ];
    own.extend(bounces.cell_bindings(&rays));
    own.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    recording.dispatch_listed(&variant, own, &lists.lists, cell, (cell, rays.reflection))
}

/// `Poles` of `single_pole.wgsl`, in the order of the cell's `cameras`; `None` of pinholes.
fn poles_of(
    device: &Device,
    cell: &MirrorCell<'_>,
    cameras: &[GpuSampleCamera],
    search: CurvedSearch,
) -> Option<Buffer> {
    let poles = &cell.surroundings.poles;
    let sorted = cameras.iter().filter_map(|camera| poles.get(camera.mask.trailing_zeros() as usize)).copied();
    let sorted: Vec<GpuPole> = sorted.collect();
    let steps = [search.coarse_px, search.fine_px, 0.0, 0.0];
    let bytes = [bytemuck::cast_slice(&steps), bytemuck::cast_slice(&sorted)].concat();
    (!sorted.is_empty()).then(|| device.gpu.buffer_with::<u8>("poles", &bytes, BufferUsages::UNIFORM))
}
