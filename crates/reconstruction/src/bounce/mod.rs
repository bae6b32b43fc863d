//! Mirror images of the scene: rays off the mirrors that a view shows are followed in images of the mirrors' surroundings or in a cube,
//! mirror after mirror, and what they find is added to the pixels.

mod curved_search;
mod glossy;
pub(crate) mod mips;
mod mirror_cells;

use bytemuck::{Pod, Zeroable};
use depth_image::{Highlight, MAX_MIRROR_CELLS};
use gpu::{
    Binding, GpuEnvironment, GpuError, PooledBuffer, ResourceTraits, ShaderVariant, highlight_name, light_slots,
    uniform_elements,
};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

pub use curved_search::CurvedSearch;
pub(crate) use curved_search::{CurvedWalk, LONGEST_STEP, MAX_WALK_STEPS};
#[cfg(test)]
pub(crate) use glossy::GpuGlossySurface;
use mirror_cells::reflectors_of_cube;
pub use mirror_cells::{MirrorCell, Mirrors};

use crate::methods::joint_carve::Carve;
use crate::pixel_list::{GpuPixelList, LIST_WORKGROUP, PixelList};
use crate::recording::nearest_first;
use crate::reflectors::{Reflectors, sample_texels};
use crate::single_pole::GpuPole;
use crate::view_work::{GpuViewCamera, GpuViewWork, ONE_VIEW, SetVariant};
use crate::{device::Device, error::ReconstructionError, recording::Recording, sample_set::SampleSet};

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
/// Lists of rays: one for each mirror cell, and one for a base.
pub(crate) const MAX_RAY_LISTS: usize = MAX_MIRROR_CELLS + 1;

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

/// The memory for the mirrored rays of a batch.
pub(crate) struct Bounces<'s> {
    /// Smallest first.
    cells: Vec<MirrorCell<'s>>,
    reflections: u32,
    glossy_rays: u32,
    /// Rough surfaces, which are to send rays, and the light that these bring, 12 bytes a pixel.
    lobes: Option<[PooledBuffer; 2]>,
    /// A `MirrorBox` for each cell.
    boxes: Buffer,
    /// A `ViewWork` for each cell.
    works: Vec<Buffer>,
    /// The `Poles` of each cell with images of single-pole cameras.
    poles: Vec<Option<Buffer>>,
    rays: [PooledBuffer; 2],
    /// Of the rays of this mirror and of the next, of those that the march leaves, and of those that stay unknown.
    listed: [PooledBuffer; 4],
    color: PooledBuffer,
    inverse_depth_per_m: PooledBuffer,
    provenance: PooledBuffer,
    /// The steps of each ray in images of single-pole cameras, where they are counted.
    steps: Option<PooledBuffer>,
}

/// Rays off one mirror: the numbers of those of each cell.
pub(crate) struct RayLists {
    /// A [`GpuPixelList`] for each cell, and one that counts all rays.
    lists: Buffer,
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
        let volume_m3 = |cell: &MirrorCell<'_>| cell.bounds.size().element_product();
        cells.sort_by(|a, b| a.is_cube().cmp(&b.is_cube()).then(volume_m3(a).total_cmp(&volume_m3(b))));
        let first_listed = |cell: usize| (cell * pixels) as u32;
        let mirror_box = |(number, cell): (usize, &MirrorCell<'_>)| GpuMirrorBox {
            min_in_world: cell.bounds.min.to_array(),
            first_listed: first_listed(number),
            max_in_world: cell.bounds.max.to_array(),
            start_m: cell.surroundings.cube.as_ref().map_or(0.0, |cube| cube.start_m),
        };
        let boxes: Vec<GpuMirrorBox> = cells.iter().enumerate().map(mirror_box).collect();
        let work = |(number, cell): (usize, &MirrorCell<'_>)| {
            let first_pixel = first_listed(number);
            let number = number as u32;
            let view = GpuViewCamera { number, first_pixel, size_px: [1; 2], ..GpuViewCamera::zeroed() };
            let work = GpuViewWork { view, volume: cell.surroundings.volume, ..GpuViewWork::zeroed() };
            let cameras = nearest_first(cell.surroundings, cell.bounds.center());
            let bytes = [bytemuck::bytes_of(&work), bytemuck::cast_slice(&cameras)].concat();
            device.gpu.buffer_with("mirror cell", &uniform_elements([bytes]), BufferUsages::UNIFORM)
        };
        let lend = |label, bytes| device.lend(label, bytes);
        let rays = || lend("mirrored rays", size_of::<GpuMirroredRay>() * pixels);
        let listed = || lend("lists of mirrored rays", 4 * pixels * cells.len());
        let plane = |label| lend(label, 4 * pixels);
        let sends = mirrors.glossy_rays > 0 && cells.iter().any(MirrorCell::is_plain_cube);
        Ok(Some(Self {
            reflections: mirrors.reflections,
            glossy_rays: mirrors.glossy_rays,
            lobes: sends.then(|| glossy::lend(device, pixels)).transpose()?,
            boxes: device.gpu.buffer_with("mirror boxes", &boxes, BufferUsages::UNIFORM),
            works: cells.iter().enumerate().map(work).collect(),
            poles: cells.iter().map(|cell| poles(device, cell, curved_search)).collect(),
            rays: [rays()?, rays()?],
            listed: [listed()?, listed()?, listed()?, listed()?],
            color: plane("mirrored colour")?,
            inverse_depth_per_m: plane("mirrored depth")?,
            provenance: plane("mirrored provenance")?,
            steps: None,
            cells,
        }))
    }

    /// Empty lists for the rays that come after those of `before`.
    pub fn next(&self, device: &Device, before: Option<&RayLists>) -> RayLists {
        let empty = GpuPixelList { workgroups: [0, 1, 1], count: 0 };
        let usage = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        let lists = device.gpu.buffer_with("mirrored rays", &vec![empty; self.cells.len() + 1], usage);
        RayLists { lists, memory: before.map_or(0, |before| 1 - before.memory) }
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

    /// Counts the steps of rays in images of single-pole cameras from now on.
    pub fn count_steps(&mut self, device: &Device, pixels: usize) -> &Buffer {
        self.steps.insert(device.buffers.lend_storage("steps", 4 * pixels as u64))
    }

    /// Colours, inverse ways and provenance of rays.
    pub fn planes(&self) -> [&Buffer; 3] {
        [&self.color, &self.inverse_depth_per_m, &self.provenance]
    }

    /// Of each ray, where they are counted.
    pub fn steps(&self) -> Option<&Buffer> {
        self.steps.as_deref()
    }

    /// What must live until the device is done.
    pub fn into_memory(self) -> Vec<PooledBuffer> {
        let planes = [self.color, self.inverse_depth_per_m, self.provenance].into_iter();
        let planes = planes.chain(self.steps).chain(self.lobes.into_iter().flatten());
        self.rays.into_iter().chain(self.listed).chain(planes).collect()
    }

    /// Mirrors that a ray meets.
    pub fn reflections(&self) -> u32 {
        self.reflections
    }

    /// Rays into the lobe of a rough surface, sent or gathered.
    pub fn glossy_rays(&self) -> u32 {
        self.glossy_rays
    }

    /// The memory for rough surfaces and for the light of their rays, where these are sent.
    pub fn lobes(&self) -> Option<[&Buffer; 2]> {
        self.lobes.as_ref().map(|[surfaces, light]| [&**surfaces, &**light])
    }

    /// The work of a cell.
    pub fn work_binding(&self, cell: usize) -> Binding<'_> {
        Binding::buffer("work", &self.works[cell])
    }

    /// The arguments of the dispatches over lists.
    pub fn lists_of<'b>(&self, lists: &'b RayLists) -> &'b Buffer {
        &lists.lists
    }

    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// What the base reflects, if there is one in which anything does.
    fn base_reflectors(&self) -> Option<&'s Reflectors> {
        self.cells.last().and_then(|cell| reflectors_of_cube(cell.surroundings))
    }

    /// The rays of a list.
    pub fn list_bindings<'b>(&'b self, lists: &'b RayLists) -> [Binding<'b>; 3] {
        [
            Binding::buffer("rays", &self.rays[lists.memory]),
            Binding::buffer("listed_pixels", &self.listed[lists.memory]),
            Binding::buffer("lists", &lists.lists),
        ]
    }

    fn pole_binding(&self, cell: usize) -> Option<Binding<'_>> {
        self.poles[cell].as_ref().map(|poles| Binding::buffer("poles", poles))
    }

    /// The resources of `surface.wgsl` for the rays of a cell, which leave some to a list.
    fn search_bindings<'b>(&'b self, cell: usize, left: &'b PixelList) -> Vec<Binding<'b>> {
        let set = self.cells[cell].surroundings;
        let mut bindings = set_bindings(set, &self.works[cell]);
        bindings.extend([
            Binding::texture("cell_colors", &set.cell_colors),
            Binding::buffer("out_color", &self.color),
            Binding::buffer("out_inverse_depth", &self.inverse_depth_per_m),
            Binding::buffer("out_provenance", &self.provenance),
            Binding::buffer("undecided_pixels", &left.pixels),
            Binding::buffer("undecided", &left.lists),
        ]);
        bindings
    }
}

/// The switches of `bounce/march.wgsl`.
#[derive(Debug)]
pub(crate) struct BounceMarch {
    set: SetVariant,
}

impl ShaderVariant for BounceMarch {
    const TEMPLATE: &'static str = "bounce/march.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! { bounced => true, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let sets = SetVariant::all().into_iter();
        sets.map(|set| Self { set }).collect()
    }
}

/// The switches of `bounce/land.wgsl`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Land {
    set: SetVariant,
    /// Mirrors among the ends of rays list the next rays; the number of lists.
    next_cells: Option<usize>,
    /// The cell's images have reflectors.
    reflects: bool,
    /// The cell's images are those of single-pole cameras.
    single_pole: bool,
    lights: usize,
    environment_map: bool,
    visibility_words: usize,
}

impl ShaderVariant for Land {
    const TEMPLATE: &'static str = "bounce/land.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            highlight => highlight_name(Highlight::Ggx),
            mirrors => self.next_cells.is_some(),
            mirror_cells => self.next_cells.unwrap_or(0),
            reflects => self.reflects,
            single_pole => self.single_pole,
            light_slots => light_slots(self.lights),
            environment_map => self.environment_map,
            visibility_words => self.visibility_words,
            sample_texels => sample_texels(self.visibility_words),
            ..self.set.context()
        }
    }

    fn all() -> Vec<Self> {
        let lights = [(0, 0), (3, 1), (255, 64)];
        let cells = [(None, false), (None, true), (Some(1), true), (Some(MAX_RAY_LISTS), true)];
        let sets = || SetVariant::all().into_iter();
        let each = move |(lights, visibility_words)| {
            cells.into_iter().flat_map(move |(next_cells, reflects)| {
                sets().flat_map(move |set| {
                    [false, true].map(|environment_map| Self {
                        set,
                        next_cells,
                        reflects,
                        single_pole: false,
                        lights,
                        environment_map,
                        visibility_words,
                    })
                })
            })
        };
        let pinholes: Vec<Self> = lights.into_iter().flat_map(each).collect();
        let single_poles = pinholes.iter().filter(|land| land.lights == 3 && !land.environment_map);
        let single_poles: Vec<Self> = single_poles.map(|land| Self { single_pole: true, ..*land }).collect();
        [pinholes, single_poles].concat()
    }
}

/// The rays of a list that are walked in a base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InBase {
    /// All: those of mirrors in no mirror cell.
    WholeList,
    /// Those whose ends the images of their mirror cell leave unknown.
    LeftByImages,
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

/// Records the passes over the rays that the view's mirrors have listed, mirror after mirror. `walk` follows rays in the base, where
/// there is one.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    first: RayLists,
    walk: impl Fn(&mut Recording<'_>, InBase, CellRays<'_>) -> Result<(), ReconstructionError>,
) -> Result<(), ReconstructionError> {
    let mut listed = Some(first);
    for reflection in 1..=bounces.reflections {
        let Some(lists) = listed else { break };
        let next = (reflection < bounces.reflections).then(|| bounces.next(recording.device, Some(&lists)));
        for (number, cell) in bounces.cells.iter().enumerate() {
            let rays = CellRays { lists: &lists, next: next.as_ref(), cell: number, reflection };
            if cell.is_cube() {
                walk(recording, InBase::WholeList, rays)?;
                continue;
            }
            follow(recording, bounces, rays)?;
            walk(recording, InBase::LeftByImages, rays)?;
            land(recording, bounces, rays)?;
        }
        listed = next;
    }
    Ok(())
}

/// Where the rays of a cell end, in its images.
pub(crate) fn follow(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    rays: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let CellRays { lists, cell, reflection, .. } = rays;
    if bounces.poles[cell].is_some() {
        return follow_curved(recording, bounces, rays);
    }
    let set = bounces.cells[cell].surroundings.variant();
    let [left, unknown] = [2, 3]
        .map(|memory| PixelList::empty(&recording.device.gpu, (*bounces.listed[memory]).clone(), bounces.cells.len()));
    let march = BounceMarch { set };
    let pass = recording.device.passes.get(&march)?;
    let mut bindings = bounces.search_bindings(cell, &left);
    bindings.extend(bounces.list_bindings(lists));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&march, &pass, &bound, &lists.lists, cell, (cell, reflection));
    let carve = Carve { set, stop_level: 0, bounced: true };
    let pass = recording.device.passes.get(&carve)?;
    let mut bindings = bounces.search_bindings(cell, &unknown);
    bindings.push(Binding::buffer("rays", &bounces.rays[lists.memory]));
    bindings.extend(left.bindings());
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&carve, &pass, &bound, &left.lists, cell, (cell, reflection));
    Ok(())
}

/// Where the rays of a cell end, in its images of single-pole cameras.
fn follow_curved(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    CellRays { lists, cell, reflection, .. }: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let set = bounces.cells[cell].surroundings.variant();
    let walk = CurvedWalk { set, count_steps: bounces.steps.is_some() };
    let unknown = PixelList::empty(&recording.device.gpu, (*bounces.listed[3]).clone(), bounces.cells.len());
    let pass = recording.device.passes.get(&walk)?;
    let mut bindings = bounces.search_bindings(cell, &unknown);
    bindings.extend(bounces.pole_binding(cell));
    bindings.extend(bounces.steps.as_ref().map(|steps| Binding::buffer("out_steps", steps)));
    bindings.extend(bounces.list_bindings(lists));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&walk, &pass, &bound, &lists.lists, cell, (cell, reflection));
    Ok(())
}

/// Adds what the rays of a cell found to their pixels.
pub(crate) fn land(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    CellRays { lists, next, cell, reflection }: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let set = bounces.cells[cell].surroundings;
    // Rays come from reflectors: of the view's images, or of the base alone.
    let view_reflectors = recording.set.reflectors.as_ref().or(bounces.base_reflectors());
    let Some(view_reflectors) = view_reflectors else { return Ok(()) };
    let is_lit_alike =
        |of: &&Reflectors| of.highlight == view_reflectors.highlight && of.lights == view_reflectors.lights;
    let reflectors = set.reflectors.as_ref().filter(is_lit_alike);
    let environment = recording.set.environment.as_deref();
    let variant = Land {
        set: set.variant(),
        next_cells: next.filter(|_| reflectors.is_some()).map(|_| bounces.cells.len()),
        reflects: reflectors.is_some(),
        single_pole: set.is_single_pole(),
        lights: view_reflectors.lights,
        environment_map: environment.is_some(),
        visibility_words: reflectors.map_or(0, |reflectors| reflectors.visibility_words),
    };
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = set_bindings(set, &bounces.works[cell]);
    bindings.extend(bounces.pole_binding(cell));
    bindings.extend([
        Binding::buffer("out_color", &recording.batch.color),
        Binding::buffer("out_provenance", &recording.batch.provenance),
        Binding::buffer("ray_color", &bounces.color),
        Binding::texture("cell_colors", &set.cell_colors),
        Binding::buffer("inverse_depth", &bounces.inverse_depth_per_m),
        Binding::buffer("provenance", &bounces.provenance),
        Binding::buffer("illumination", &view_reflectors.illumination),
    ]);
    bindings.extend(reflectors.map(|reflectors| Binding::texture("samples", &reflectors.samples)));
    bindings.extend(environment.into_iter().flat_map(GpuEnvironment::bindings));
    bindings.extend(bounces.list_bindings(lists));
    let next = next.filter(|_| variant.next_cells.is_some());
    bindings.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&variant, &pass, &bound, &lists.lists, cell, (cell, reflection));
    Ok(())
}

/// `Poles` of `single_pole.wgsl`, in the order of the cell's cameras; `None` of pinholes.
fn poles(device: &Device, cell: &MirrorCell<'_>, search: CurvedSearch) -> Option<Buffer> {
    let of = &cell.surroundings.poles;
    let sorted = nearest_first(cell.surroundings, cell.bounds.center()).into_iter();
    let sorted: Vec<GpuPole> =
        sorted.filter_map(|camera| of.get(camera.mask.trailing_zeros() as usize)).copied().collect();
    let steps = [search.coarse_px, search.fine_px, 0.0, 0.0];
    let bytes = [bytemuck::cast_slice(&steps), bytemuck::cast_slice(&sorted)].concat();
    (!sorted.is_empty()).then(|| device.gpu.buffer_with::<u8>("poles", &bytes, BufferUsages::UNIFORM))
}

/// The resources of `view_work.wgsl` and `cell.wgsl` for a mirror cell.
fn set_bindings<'b>(set: &'b SampleSet, work: &'b Buffer) -> Vec<Binding<'b>> {
    vec![
        Binding::buffer("work", work),
        Binding::texture("nodes", &set.nodes),
        Binding::texture("cell_codes", &set.cell_codes),
    ]
}
