//! Mirror images of the scene: rays off the mirrors that a view shows are followed in images of the mirrors' surroundings or in a cube,
//! mirror after mirror, and what they find is added to the pixels.

mod curved_search;
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
use mirror_cells::reflectors_of_cube;
pub use mirror_cells::{MirrorCell, Mirrors};

use crate::methods::joint_carve::Carve;
use crate::pixel_list::{GpuPixelList, LIST_WORKGROUP, PixelList, empty_lists};
use crate::recording::nearest_first;
use crate::reflectors::sample_texels;
use crate::single_pole::GpuPole;
use crate::surface::found_bindings;
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

    /// The images of a cell: the resources of `view_work.wgsl`, `cell.wgsl`, `colors.wgsl` and `single_pole.wgsl`.
    fn image_bindings(&self, cell: usize) -> Vec<Binding<'_>> {
        let set = self.cells[cell].surroundings;
        let mut bindings = vec![
            Binding::buffer("work", &self.works[cell]),
            Binding::texture("nodes", &set.nodes),
            Binding::texture("cell_codes", &set.cell_codes),
            Binding::texture("cell_colors", &set.cell_colors),
        ];
        bindings.extend(self.poles[cell].as_ref().map(|poles| Binding::buffer("poles", poles)));
        bindings
    }

    /// A list of rays that one pass leaves to the next, in the memory of this number.
    fn left(&self, device: &Device, memory: usize) -> PixelList {
        PixelList::empty(&device.gpu, (*self.listed[memory]).clone(), self.cells.len())
    }

    /// The resources of `surface.wgsl` for the rays of a cell, which leave some to a list.
    fn search_bindings<'b>(&'b self, cell: usize, left: &'b PixelList) -> Vec<Binding<'b>> {
        let mut bindings = self.image_bindings(cell);
        bindings.extend(found_bindings(self.planes.each_ref().map(|plane| &**plane), left));
        bindings
    }
}

/// The switches of `bounce/march.wgsl`.
#[derive(Debug)]
pub(crate) struct BounceMarch(SetVariant);

impl ShaderVariant for BounceMarch {
    const TEMPLATE: &'static str = "bounce/march.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! { bounced => true, ..self.0.context() }
    }

    fn all() -> Vec<Self> {
        SetVariant::all().into_iter().map(Self).collect()
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
        let cells = [(None, false), (None, true), (Some(1), true), (Some(MAX_RAY_LISTS), true)];
        let mut all = Vec::new();
        for set in SetVariant::all() {
            for (next_cells, reflects) in cells {
                for (lights, visibility_words) in [(0, 0), (3, 1), (255, 64)] {
                    all.extend([false, true].map(|environment_map| Self {
                        set,
                        next_cells,
                        reflects,
                        single_pole: false,
                        lights,
                        environment_map,
                        visibility_words,
                    }));
                }
            }
        }
        let single_poles = all.clone().into_iter().filter(|land| land.lights == 3 && !land.environment_map);
        all.extend(single_poles.map(|land| Self { single_pole: true, ..land }));
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
    let mut bindings = bounces.search_bindings(cell, &unknown);
    if bounces.poles[cell].is_some() {
        bindings.extend(bounces.list_bindings(lists));
        let walk = recording.bind(&CurvedWalk(set), bindings)?;
        recording.dispatch_listed(&walk, &lists.lists, cell, (cell, reflection));
        return Ok(());
    }
    let left = bounces.left(recording.device, 2);
    let march_bindings = bounces.search_bindings(cell, &left).into_iter().chain(bounces.list_bindings(lists));
    let march = recording.bind(&BounceMarch(set), march_bindings)?;
    recording.dispatch_listed(&march, &lists.lists, cell, (cell, reflection));
    bindings.push(Binding::buffer("rays", &bounces.rays[lists.memory]));
    bindings.extend(left.bindings());
    let carve = recording.bind(&Carve { set, stop_level: 0, bounced: true }, bindings)?;
    recording.dispatch_listed(&carve, &left.lists, cell, (cell, reflection));
    Ok(())
}

/// Adds what the rays of a cell found to their pixels.
pub(crate) fn land(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    rays: CellRays<'_>,
) -> Result<(), ReconstructionError> {
    let CellRays { lists, next, cell, reflection } = rays;
    let set = bounces.cells[cell].surroundings;
    // Rays come from reflectors: of the view's images, or of the base alone.
    let base = bounces.cells.last().and_then(|cell| reflectors_of_cube(cell.surroundings));
    let Some(view_reflectors) = recording.set.reflectors.as_ref().or(base) else { return Ok(()) };
    let reflectors = set.reflectors.as_ref().filter(|reflectors| {
        reflectors.highlight == view_reflectors.highlight && reflectors.lights == view_reflectors.lights
    });
    let environment = recording.set.environment.as_deref();
    let variant = Land {
        set: set.variant(),
        next_cells: next.filter(|_| reflectors.is_some()).map(|_| bounces.cells.len()),
        reflects: reflectors.is_some(),
        single_pole: !set.poles.is_empty(),
        lights: view_reflectors.lights,
        environment_map: environment.is_some(),
        visibility_words: reflectors.map_or(0, |reflectors| reflectors.visibility_words),
    };
    let [ray_color, inverse_depth, provenance] = &bounces.planes;
    let mut bindings = bounces.image_bindings(cell);
    bindings.extend([
        Binding::buffer("out_color", &recording.batch.color),
        Binding::buffer("out_provenance", &recording.batch.provenance),
        Binding::buffer("ray_color", ray_color),
        Binding::buffer("inverse_depth", inverse_depth),
        Binding::buffer("provenance", provenance),
        Binding::buffer("illumination", &view_reflectors.illumination),
    ]);
    bindings.extend(reflectors.map(|reflectors| Binding::texture("samples", &reflectors.samples)));
    bindings.extend(environment.into_iter().flat_map(GpuEnvironment::bindings));
    bindings.extend(bounces.list_bindings(lists));
    let next = next.filter(|_| variant.next_cells.is_some());
    bindings.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_listed(&pass, &lists.lists, cell, (cell, reflection));
    Ok(())
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
