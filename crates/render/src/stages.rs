//! One submission: surfaces, their light, their planes.

use std::{slice, sync::Arc};

use depth_image::Antialias;
use gpu::{BufferPool, Frame, FrameResult, Gpu, JobLimit, PassCache, Pool, Readback, Templates};

use crate::accumulation::{Accumulations, Sums};
use crate::batch::{Batch, Recording};
use crate::finish::Planes;
use crate::known_samples::{ImageSequence, Predecessors};
use crate::layers::{self, LayerKind, Layers};
use crate::light_cache::{self, Picture};
use crate::pieces::Piece;
use crate::reflections::{self, Reflections};
use crate::surfaces::{MOST_FREE_BYTES, SurfaceKind, SurfaceViews, Surfaces};
use crate::{RenderError, coverage, finish, illuminate, keep, lamp_bits, pixel_list::PixelList, raster::Raster};
use crate::{rays::primary, redundancy_test::Evidence};

/// Batches of one class that are under way at once: each holds memory for its surfaces, light and planes.
const BATCHES_OF_A_CLASS: usize = 2;

/// The passes of drawing, and the memory that they share.
pub(crate) struct Stages {
    pub gpu: Arc<Gpu>,
    pub pool: BufferPool,
    surfaces: Pool<SurfaceKind, SurfaceViews>,
    accumulations: Accumulations,
    maps: Pool<LayerKind, Layers>,
    pub raster: Raster,
    pub passes: PassCache,
    pub batches: JobLimit,
}

/// Memory of a batch, on loan until its frame is done.
#[derive(Clone, Copy)]
struct Lendings<'l> {
    planes: &'l Planes,
    mirrored: Option<&'l Reflections>,
    maps: Option<&'l Layers>,
}

impl Stages {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self {
            gpu: gpu.clone(),
            pool: BufferPool::new(gpu),
            surfaces: Pool::of_device(gpu, MOST_FREE_BYTES, SurfaceKind::bytes),
            accumulations: Accumulations::default(),
            maps: layers::pool(gpu),
            raster: Raster::new(gpu, templates),
            passes: PassCache::new(gpu, templates),
            batches: JobLimit::of(BATCHES_OF_A_CLASS),
        }
    }

    /// Draws a batch; the words that come back are its planes.
    pub fn draw(&self, batch: &Batch<'_>) -> Result<(FrameResult, Readback), RenderError> {
        let turn = batch.work.turn;
        let _one = self.batches.begin(turn.class);
        let sums = self.sums(batch)?;
        let Self { gpu, passes, pool, .. } = self;
        let slice_px = gpu.device_queue.slice_units(batch.family(), batch.unknown_slice_px());
        let most_px = if batch.output.follows_rays() { reflections::PIXELS_A_PIECE } else { u64::MAX };
        let pieces = Piece::all(batch.cameras, slice_px.min(most_px));
        let most_rays = pieces.iter().map(Piece::pixel_count).max().unwrap_or(0).max(1);
        let follows_rays = batch.output.follows_rays();
        let mirrored = follows_rays.then(|| Reflections::lend(gpu, pool, batch, most_rays, batch.bytes(1)));
        let mirrored = mirrored.transpose()?;
        let cameras = batch.uniform_of_all(gpu, &pieces, &sums);
        let shifted = batch.positions();
        let positions =
            shifted.iter().map(|(position, cameras)| Batch { cameras, position: *position, ..batch.clone() });
        let positions: Vec<Batch<'_>> = positions.collect();
        let frame = Frame::begin(gpu, "draw", turn);
        let lamp_bits = lamp_bits::lend(pool, batch);
        let mut recording = Recording { gpu, passes, batch, pieces, cameras, sums, lamp_bits, frame };
        let surfaces: Vec<Surfaces> = (0..batch.cameras.len()).map(|place| self.lend(batch, place)).collect();
        let planes = Planes::lend(gpu, pool, batch)?;
        let maps = lamp_bits::lend_maps(gpu, &self.maps, batch);
        let mut lists = Vec::new();
        for position in &positions {
            recording.cameras = position.uniform_of_all(gpu, &recording.pieces, &recording.sums);
            recording.batch = position;
            let lent = Lendings { planes: &planes, mirrored: mirrored.as_ref(), maps: maps.as_deref() };
            lists.extend(self.record_position(&mut recording, &surfaces, lent)?);
        }
        let Recording { sums, lamp_bits, mut frame, .. } = recording;
        let wanted_bits = lamp_bits.as_deref().filter(|_| batch.output.lamp_bits);
        let bytes = match wanted_bits {
            Some(_) => batch.bytes(batch.lamp_words()),
            None => batch.bytes(batch.output.layout().count),
        };
        let host = pool.lend_host("planes read-back", bytes.max(4));
        let read = frame.read_back(wanted_bits.unwrap_or(&planes.words), 0..bytes, host);
        let result = frame.submit()?.wait()?;
        drop((surfaces, lists, planes, mirrored, lamp_bits, maps));
        if batch.work.refinement.goes_on() {
            self.accumulations.put(batch.key(), sums);
        }
        Ok((result, read))
    }

    /// Sums to add to: those of the step before, or new ones.
    fn sums(&self, batch: &Batch<'_>) -> Result<Sums, RenderError> {
        let lighting = batch.work.lighting;
        let refinement = batch.work.refinement;
        let bytes = batch.bytes(if lighting.is_lit() { batch.output.sums.count() } else { 0 });
        self.gpu.check_storage_bytes("the light of a batch (bytes)", bytes)?;
        let wanted = batch.wanted_rays();
        let kept = (refinement.steps > 1).then(|| self.accumulations.take(&batch.key(), wanted)).flatten();
        Ok(kept.unwrap_or_else(|| {
            let buffer = self.pool.lend_storage("light", bytes.max(4));
            Sums { buffer, rays: wanted.map(|rays| 0..rays) }
        }))
    }

    /// Records one position within the pixels: which surface each shows, its light, what mirrors show, and its planes.
    fn record_position(
        &self,
        recording: &mut Recording<'_>,
        surfaces: &[Surfaces],
        lent: Lendings<'_>,
    ) -> Result<Vec<PixelList>, RenderError> {
        let Lendings { planes, mirrored, maps } = lent;
        match recording.batch.sequence {
            Some(sequence) => self.find_in_sequence(recording, sequence, surfaces)?,
            None => self.find(recording, 0, surfaces, None)?,
        }
        if recording.batch.work.lighting.is_lit() && recording.batch.has_color() {
            lamp_bits::record(recording, &self.raster, maps, surfaces)?;
        }
        let lists = self.light(recording, surfaces, planes)?;
        if let Some(mirrored) = mirrored.filter(|_| recording.batch.has_color()) {
            mirrored.record(recording, surfaces)?;
        }
        finish::record(recording, surfaces, planes, mirrored.map(|mirrored| &*mirrored.reflected))?;
        Ok(lists)
    }

    /// Image after image: each consults those before it.
    fn find_in_sequence(
        &self,
        recording: &mut Recording<'_>,
        sequence: ImageSequence<'_>,
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        for (place, (camera, target)) in recording.batch.cameras.iter().zip(surfaces).enumerate() {
            let earlier = sequence.number(place);
            let predecessors =
                (earlier > 0).then(|| sequence.known.predecessors(&self.gpu, earlier, camera.reference()));
            self.find(recording, place, slice::from_ref(target), predecessors.as_ref())?;
            if let Some((held, _)) = sequence.layer(place, Evidence::Samples) {
                keep::record(recording, place, target, held)?;
            }
        }
        Ok(())
    }

    /// The surfaces of the cameras from the `first` on.
    fn find(
        &self,
        recording: &mut Recording<'_>,
        first: usize,
        surfaces: &[Surfaces],
        predecessors: Option<&Predecessors>,
    ) -> Result<(), RenderError> {
        let batch = recording.batch;
        match batch.traced.as_deref().filter(|_| batch.by_rays) {
            Some(traced) => primary::record(recording, traced, first, surfaces, predecessors),
            None => self.raster.record(recording, first, surfaces, predecessors),
        }
    }

    fn lend(&self, batch: &Batch<'_>, place: usize) -> Surfaces {
        let kind = SurfaceKind {
            size_px: batch.cameras[place].size_px(),
            by_rays: batch.by_rays,
            surface_id: batch.output.surface_id,
            triangle_normal: batch.output.triangle_normal,
            first_surface: batch.cached.is_some() && batch.output.antialias > Antialias::NONE,
            front: batch.sequence.is_some_and(|sequence| sequence.number(place) > 0),
        };
        let own = batch.sequence.and_then(|sequence| sequence.layer(place, Evidence::SurfaceIds));
        let kind = own.map_or(kind, |(_, size_px)| SurfaceKind { size_px, surface_id: false, ..kind });
        Surfaces::lend(&self.gpu, &self.surfaces, kind, own.map(|(ids, _)| ids))
    }

    /// Records the light that arrives at surfaces: rays for all pixels, or a look-up in samples and rays for the pixels that no
    /// sample knows. The lists of those must live until the frame is done. A position without colour is looked up for its
    /// provenance alone.
    fn light(
        &self,
        recording: &mut Recording<'_>,
        surfaces: &[Surfaces],
        planes: &Planes,
    ) -> Result<Vec<PixelList>, RenderError> {
        let batch = recording.batch;
        let mut all = Vec::new();
        if let Some(covered_by) = batch.covered_by {
            let parts = batch.parts(&self.gpu, &recording.pieces, &recording.sums);
            for (camera, target) in surfaces.iter().enumerate() {
                let lists = self.lists(recording, camera);
                let picture = Picture { camera, target, planes, lists: &lists, asked: &[] };
                coverage::record(recording, covered_by, picture)?;
                if batch.work.lighting.is_lit() {
                    illuminate::record(recording, &parts, camera, slice::from_ref(target), Some(&lists))?;
                }
                all.extend(lists);
            }
            return Ok(all);
        }
        if !batch.work.lighting.is_lit() || !batch.has_color() && !batch.output.provenance {
            return Ok(all);
        }
        let parts = batch.parts(&self.gpu, &recording.pieces, &recording.sums);
        let Some(cached) = batch.cached else {
            illuminate::record(recording, &parts, 0, surfaces, None)?;
            return Ok(all);
        };
        for (camera, target) in surfaces.iter().enumerate() {
            let lists = self.lists(recording, camera);
            let asked = if batch.position.number > 0 { self.lists(recording, camera) } else { Vec::new() };
            let picture = Picture { camera, target, planes, lists: &lists, asked: &asked };
            light_cache::record(recording, cached, picture)?;
            if batch.has_color() {
                illuminate::record(recording, &parts, camera, slice::from_ref(target), Some(&lists))?;
            }
            all.extend(lists.into_iter().chain(asked));
        }
        Ok(all)
    }

    /// An empty list for each piece of a picture.
    fn lists(&self, recording: &Recording<'_>, camera: usize) -> Vec<PixelList> {
        let pieces = recording.pieces_of(camera).into_iter();
        pieces.map(|piece| PixelList::new(&self.gpu, &self.pool, piece.pixel_count())).collect()
    }
}
