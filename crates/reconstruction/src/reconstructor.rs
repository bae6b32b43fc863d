//! Views from sample sets, in batches, in one submission each: tile starts, then the method, the fill and highlights for
//! each position within the pixels, and their mean.

use std::sync::Arc;

use depth_image::{Antialias, CubeImages, DepthImage, PinholeCamera, View, ViewPlanes};
use glam::Vec2;
use gpu::{BufferPool, Frame, Gpu, JobLimit, PassCache, Submitted, TablePool, Turn, WorkKind};

use crate::antialias::{self, Sums};
use crate::blocks;
use crate::bounce::{self, Bounces, CurvedSearch, Mirrors, RayLists};
use crate::cube::Cube;
use crate::in_flight::{BatchViews, submit};
use crate::lobes::GlossyList;
use crate::methods::layered::{self, Ends, Walked};
use crate::pixel_list::PixelList;
use crate::quads::{self, Mesh, MeshStatistics, Quad, QuadDrawing};
use crate::recording::{
    MIRRORED_PIXELS_A_BATCH, MIRRORED_PIXELS_A_SLICE, PIXELS_A_BATCH, Recording, VisitedBlocks, batches,
};
use crate::reflectors::LobeLight;
use crate::sample_set::{self, SampleSet};
use crate::{device::Device, error::ReconstructionError, methods::ReconstructionMethod};
use crate::{fill, set_description::SetDescription, shaders::templates, specular, tile_start};

/// Calls of one class that are under way at once: each holds the memory of two batches.
const CALLS_OF_A_CLASS: usize = 4;

/// Passes for every method and number of cameras that has been asked for.
pub struct Reconstructor {
    pub(crate) device: Device,
    tables: TablePool,
    drawing: QuadDrawing,
    calls: JobLimit,
}

/// The quads of a set, cut.
pub struct DepthQuads {
    set: Arc<SampleSet>,
    mesh: Arc<Mesh>,
}

/// Sets that views are made from beside their own.
#[derive(Clone, Copy, Default)]
pub struct CommonSets<'s> {
    /// What mirrors show.
    pub mirrors: Mirrors<'s>,
    /// A layered cube of the whole scene, in which is walked what the view's images, or those of a mirror cell, leave unknown, and what
    /// rough surfaces and mirrors in no mirror cell show.
    pub base: Option<&'s SampleSet>,
    /// The blocks of a scene, cells of one grid, each with images of its own: rays visit them front to back, before the view's own images.
    /// They take neither mirror cells nor a base, and are for methods that follow rays.
    pub blocks: &'s [&'s SampleSet],
}

impl<'s> From<Mirrors<'s>> for CommonSets<'s> {
    fn from(mirrors: Mirrors<'s>) -> Self {
        Self { mirrors, ..Self::default() }
    }
}

/// Views to reconstruct from one sample set.
#[derive(Clone, Copy)]
pub struct ReconstructRequest<'r> {
    /// The images or the cube.
    pub set: &'r SampleSet,
    /// Sets of mirror cells, and a base. A layered cube needs none: its mirrors show the cube.
    pub common: CommonSets<'r>,
    /// One view is made for each camera.
    pub cameras: &'r [PinholeCamera],
    /// Whether it draws, follows rays or walks a cube.
    pub method: ReconstructionMethod,
    /// The planes beside colour, and how colour is sampled.
    pub planes: ViewPlanes,
    /// The place in the device's order.
    pub turn: Turn,
}

impl<'r> ReconstructRequest<'r> {
    /// A request for colour alone, without common sets.
    #[must_use]
    pub fn new(set: &'r SampleSet, cameras: &'r [PinholeCamera], method: ReconstructionMethod) -> Self {
        Self { set, common: CommonSets::default(), cameras, method, planes: ViewPlanes::COLOR, turn: Turn::default() }
    }
}

/// A checked request with everything that its batches share.
#[derive(Clone, Copy)]
struct Prepared<'r> {
    request: ReconstructRequest<'r>,
    /// Rays off mirrors, and those into lobes that are walked in the base, with those off the mirrors that they meet.
    followed: [Mirrors<'r>; 2],
    base: Option<&'r Cube>,
    /// The memory for rays off mirrors, and for those into lobes, while a batch is recorded.
    bounces: [Option<&'r Bounces<'r>>; 2],
    /// The quads of the set, where the method draws them.
    mesh: Option<&'r Mesh>,
}

impl Reconstructor {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, ReconstructionError> {
        let templates = Arc::new(templates()?);
        Ok(Self {
            tables: TablePool::new(gpu),
            drawing: QuadDrawing::new(gpu, &templates),
            calls: JobLimit::of(CALLS_OF_A_CLASS),
            device: Device { gpu: gpu.clone(), buffers: BufferPool::new(gpu), passes: PassCache::new(gpu, &templates) },
        })
    }

    /// Puts a sample set on the device: builds pyramids and uploads everything.
    ///
    /// # Errors
    /// Too many images, images, cameras or a volume that cannot be used, light in place of colour, or the device's limits.
    pub fn upload(
        &self,
        images: &[DepthImage],
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<SampleSet, ReconstructionError> {
        sample_set::check(&self.tables, images, set)?;
        SampleSet::of_images(&self.tables, images, set, turn)
    }

    /// Puts a layered depth cube on the device, with its light field if it has one.
    ///
    /// # Errors
    /// Images that are not those of the grid's lines, a light field or a volume that cannot be used, or the device's limits.
    pub fn upload_cube(
        &self,
        cube: &CubeImages,
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<SampleSet, ReconstructionError> {
        sample_set::check_volume(&set.volume)?;
        let without_images = SampleSet::of_images(&self.tables, &[], set, turn)?;
        Ok(SampleSet { cube: Some(Arc::new(Cube::upload(&self.tables, cube, set, turn)?)), ..without_images })
    }

    /// One view a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid (all are checked first), a set without the samples that the method needs, too many mirror
    /// cells, a cell without depth images, a base without a cube, or the device.
    pub fn reconstruct(&self, request: ReconstructRequest<'_>) -> Result<Vec<View>, ReconstructionError> {
        let ReconstructRequest { set, common, cameras, method, turn, .. } = request;
        let CommonSets { mirrors, base, blocks } = common;
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| ReconstructionError::Camera { index, source })?;
        }
        check_samples(set, method)?;
        check_blocks(common, method)?;
        // All mirrors of a cube show the cube, whatever cells there are.
        let (mirrors, cube, base) = match method.walks_cube() {
            true => (Mirrors { cells: &[], ..mirrors }, Some(set), None),
            false => (mirrors, base, base.map(cube_of_base).transpose()?),
        };
        let followed = mirrors.checked_for(set, cube)?.split(base.is_some());
        let cells = followed.map(|mirrors| mirrors.cells_with(cube));
        let followed = [0, 1].map(|number| Mirrors { cells: &cells[number], ..followed[number] });
        let _call = self.calls.begin(turn.class);
        // First of all: a batch in flight holds the device, and cutting a mesh would wait for it.
        let mesh = method.mesh(&self.device, set, turn)?;
        let prepared = Prepared { request, followed, base, bounces: [None; 2], mesh: mesh.as_deref() };
        // Rays off mirrors take memory, and are followed at once beside live streams.
        let most_pixels = match (cells.iter().all(Vec::is_empty), self.device.gpu.device_queue.cuts()) {
            (true, _) => PIXELS_A_BATCH,
            (false, false) => MIRRORED_PIXELS_A_BATCH,
            (false, true) => MIRRORED_PIXELS_A_SLICE,
        };
        let mut views = Vec::with_capacity(cameras.len());
        let mut in_flight: Option<(Submitted<'_>, BatchViews)> = None;
        // The device works on one batch while the host takes the one before apart.
        for batch in batches(cameras, most_pixels, blocks).map(Some).chain([None]) {
            let recording = batch.map(|batch| self.record(prepared, batch)).transpose()?;
            // Whoever holds the device asks for no other turn.
            let done = match in_flight.take() {
                Some((submitted, batch)) => Some((submitted.wait()?, batch)),
                None => None,
            };
            in_flight = recording.map(submit).transpose()?;
            if let Some((result, batch)) = done {
                batch.unpack(&result, &mut views)?;
            }
        }
        Ok(views)
    }

    /// All passes over a batch.
    fn record<'r>(
        &'r self,
        prepared: Prepared<'r>,
        cameras: &[PinholeCamera],
    ) -> Result<Recording<'r>, ReconstructionError> {
        let Prepared { request: ReconstructRequest { set, common, method, planes, turn, .. }, followed, .. } = prepared;
        let cells = followed[0].cells.len() + common.blocks.len();
        let family = WorkKind::family(&("reconstruct", method, set.cameras.len(), cells));
        let mut recording = Recording::begin(&self.device, set, cameras, planes, family, turn)?;
        recording.lend_blocks(common.blocks);
        let rays = recording.batch.plane_bytes as usize / 4;
        let [mirrors, lobes] =
            followed.map(|mirrors| Bounces::lend(&self.device, mirrors, rays, CurvedSearch::default()));
        let bounces = [mirrors?, lobes?];
        let prepared = Prepared { bounces: bounces.each_ref().map(Option::as_ref), ..prepared };
        self.record_positions(prepared, &mut recording)?;
        let of_bounces = bounces.into_iter().flatten().flat_map(Bounces::into_memory);
        let of_blocks = recording.blocks.take().into_iter().flat_map(VisitedBlocks::into_memory);
        recording.batch.lent = of_bounces.chain(of_blocks).collect();
        Ok(recording)
    }

    /// The passes over all positions within the pixels, and what they show together.
    fn record_positions(
        &self,
        prepared: Prepared<'_>,
        recording: &mut Recording<'_>,
    ) -> Result<(), ReconstructionError> {
        let ReconstructRequest { method, planes, .. } = prepared.request;
        // What a tile's start proves holds for every position within its pixels.
        if method.follows_rays() {
            tile_start::record(recording)?;
            blocks::record_tile_starts(recording)?;
        }
        if planes.antialias == Antialias::NONE {
            self.record_position(prepared, recording, None)?;
            return antialias::record(recording, Sums::None, None);
        }
        self.record_sums(prepared, recording)?;
        // Depth and provenance have no mean: they are the centre's.
        if planes.inverse_depth || planes.provenance {
            recording.go_to(Vec2::ZERO);
            // Mirrors count here for provenance alone: colour is the mean of the positions before.
            let bounces = if planes.provenance { prepared.bounces } else { [None; 2] };
            self.record_position(Prepared { bounces, ..prepared }, recording, None)?;
        }
        antialias::record(recording, Sums::Read, None)
    }

    /// The passes over all positions within the pixels. After the first, only the pixels that it leaves are found.
    fn record_sums(&self, prepared: Prepared<'_>, recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
        let request = prepared.request;
        let mut offsets_px = request.planes.antialias.offsets_px();
        recording.go_to(offsets_px.next().unwrap_or_default());
        self.record_position(prepared, recording, None)?;
        // What a mirror shows is not shared.
        let is_shared = prepared.bounces.iter().all(Option::is_none);
        let rough =
            if is_shared && recording.blocks.is_none() { request.method.share_positions(recording)? } else { None };
        if rough.is_none() {
            antialias::record(recording, Sums::Begun, None)?;
        }
        for offset_px in offsets_px {
            recording.go_to(offset_px);
            self.record_position(prepared, recording, rough.as_ref())?;
            antialias::record(recording, Sums::Continued, rough.as_ref())?;
        }
        Ok(())
    }

    /// The passes over one position within the pixels, of listed pixels or of all.
    fn record_position(
        &self,
        prepared: Prepared<'_>,
        recording: &mut Recording<'_>,
        listed: Option<&PixelList>,
    ) -> Result<(), ReconstructionError> {
        let Prepared { request: ReconstructRequest { method, .. }, base, mesh, bounces: [bounces, lobes], .. } =
            prepared;
        let unknown_in_blocks = blocks::record(recording, &self.drawing, method)?;
        let listed = unknown_in_blocks.as_ref().or(listed);
        let unknown = method.record(&self.drawing, mesh, recording, listed, bounces)?;
        if method.walks_cube() {
            return fill::record(recording, &unknown);
        }
        let mirrored = bounces.map(|bounces| (bounces, bounces.next(&self.device, None)));
        let first = mirrored.as_ref().map(|(bounces, first)| (*bounces, first));
        let glossy = lobes.and_then(|lobes| GlossyList::of(recording, lobes));
        let unknown = match base {
            Some(base) => {
                let lobe = glossy.as_ref().map(|_| LobeLight::sent(first.is_some()));
                layered::walk_pixels(recording, base, Some(&unknown), first, lobe, glossy.as_ref())?
            }
            None => unknown,
        };
        fill::record(recording, &unknown)?;
        specular::record(recording, listed, first, glossy.as_ref())?;
        if let Some((bounces, first)) = mirrored {
            record_mirrored(recording, bounces, first, base)?;
        }
        match (base, lobes, &glossy) {
            (Some(base), Some(lobes), Some(glossy)) => layered::follow_lobes(recording, base, lobes, glossy),
            _ => Ok(()),
        }
    }

    /// The quads that a method draws of a set, for depth alone.
    ///
    /// # Errors
    /// As [`Reconstructor::mesh_statistics`]; a method that draws no quads.
    pub fn depth_quads(
        &self,
        set: Arc<SampleSet>,
        method: ReconstructionMethod,
        turn: Turn,
    ) -> Result<DepthQuads, ReconstructionError> {
        check_samples(&set, method)?;
        let needed = "a method that draws quads";
        let mesh = method.mesh(&self.device, &set, turn)?;
        let mesh = mesh.ok_or_else(|| ReconstructionError::NoSamples { what: method.to_string(), needed })?;
        Ok(DepthQuads { set, mesh })
    }

    /// Records the depth of quads in each view into its target: the near plane over planar depth.
    ///
    /// # Errors
    /// The device's.
    pub fn record_depths(
        &self,
        frame: &mut Frame<'_>,
        quads: &DepthQuads,
        cameras: &[PinholeCamera],
        reversed_depths: &[wgpu::TextureView],
    ) -> Result<(), ReconstructionError> {
        self.drawing.draw(frame, &quads.set, &quads.mesh, cameras, None, reversed_depths)
    }

    /// Statistics of the quads that a method draws; `None` for methods that draw none.
    ///
    /// # Errors
    /// A plane that the method needs and an image lacks, or the device.
    pub fn mesh_statistics(
        &self,
        set: &SampleSet,
        method: ReconstructionMethod,
    ) -> Result<Option<MeshStatistics>, ReconstructionError> {
        Ok(self.mesh(set, method)?.map(|mesh| mesh.statistics))
    }

    /// The quads that a method draws, image after image in the order of their samples; none for methods that draw none.
    ///
    /// # Errors
    /// As [`Reconstructor::mesh_statistics`].
    pub fn read_quads(&self, set: &SampleSet, method: ReconstructionMethod) -> Result<Vec<Quad>, ReconstructionError> {
        self.mesh(set, method)?.map_or(Ok(Vec::new()), |mesh| quads::read(&self.device, &mesh, set))
    }

    fn mesh(&self, set: &SampleSet, method: ReconstructionMethod) -> Result<Option<Arc<Mesh>>, ReconstructionError> {
        check_samples(set, method)?;
        method.mesh(&self.device, set, Turn::default())
    }
}

/// Records the passes over the rays that the view's mirrors have listed, mirror after mirror. Rays are followed in the images of mirror
/// cells and in the base, where there is one.
fn record_mirrored(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    first: RayLists,
    base: Option<&Cube>,
) -> Result<(), ReconstructionError> {
    bounces.each_mirror(recording, first, 1..=bounces.reflections, |recording, rays| {
        let is_cube = bounces.cells[rays.cell].is_cube();
        if !is_cube {
            bounce::follow(recording, bounces, rays)?;
        }
        if let Some(base) = base {
            let walked = if is_cube { Walked::Bounced } else { Walked::LeftBounced };
            layered::follow(recording, base, bounces, rays, walked, Ends::default())?;
        }
        if is_cube { Ok(()) } else { bounce::land(recording, bounces, rays) }
    })
}

fn cube_of_base(base: &SampleSet) -> Result<&Cube, ReconstructionError> {
    base.cube.as_deref().ok_or(ReconstructionError::NoSamples { what: "a base".to_owned(), needed: "a layered cube" })
}

fn check_blocks(common: CommonSets<'_>, method: ReconstructionMethod) -> Result<(), ReconstructionError> {
    if common.blocks.is_empty() {
        return Ok(());
    }
    let refused = if !method.follows_rays() {
        method.to_string()
    } else if common.base.is_some() {
        "a base".to_owned()
    } else if !common.mirrors.cells.is_empty() {
        "mirror cells".to_owned()
    } else {
        return common.blocks.iter().try_for_each(|block| check_samples(block, method));
    };
    Err(ReconstructionError::Blocks { what: refused })
}

/// Views come from pinholes or from a cube, as the method needs.
fn check_samples(set: &SampleSet, method: ReconstructionMethod) -> Result<(), ReconstructionError> {
    if !set.poles.is_empty() {
        return Err(ReconstructionError::Model { model: "single_pole" });
    }
    if method.light_cache_quality().is_some() {
        return Err(ReconstructionError::NoScene { method: method.to_string() });
    }
    let has_light_field = set.cube.as_ref().is_some_and(|cube| cube.light_field.is_some());
    let needed = match method.walks_cube() {
        true if method.gathers() && !has_light_field => "a light field",
        true if set.cube.is_none() => "a layered cube",
        false if set.cameras.is_empty() => "depth images",
        _ => return Ok(()),
    };
    Err(ReconstructionError::NoSamples { what: method.to_string(), needed })
}
