//! Measured costs of this node's operations, each alone and warm. Pictures are finished, by the session's lighting: g_s and
//! g_v hold all light that samplers compute, and c the light that compositors add.

use std::fmt::Display;

use cluster::{Costs, DIRECT, MeasureCosts, Measured, ROW_PARTS, SharedLightCosts, TileCosts, TimedSize, Workload};
use codec::{DecodeLimits, EncodedImage, FrameCodec};
use codec::{decode_sample_image, encode_sample_image, encode_view};
use depth_image::{PinholeCamera, SampleCamera, SampleImage, Turn, View, WorkClass};
use glam::UVec2;
use tonic::Status;

use crate::auto_exposure::auto_exposure;
use crate::engine::{
    DirectWork, Engine, LightParts, SampleSet, SampleWork, UploadedSet, ViewWork, own_time, set_of_view,
};

/// Runs of one operation after a warm-up, in which shaders are built.
const RUNS: usize = 3;
/// A run that takes longer is not repeated: with expensive lighting it takes seconds, and varies little.
const LONG_RUN_S: f64 = 0.5;
/// Larger views are measured in this size: their time is in proportion to their pixels.
const MOST_PIXELS: usize = 1 << 20;
/// Images of light and views are measured with these parts of their sides, one after the other, before they are in full size;
/// each with the part that follows.
const QUICK_SIDE_RATIOS: [(f32, f32); 2] = [(0.125, 0.25), (0.25, 1.0)];
/// No image and no view is measured with fewer pixels: what each takes, however small, would count for all pixels.
const LEAST_QUICK_PIXELS: f64 = 3_000.0;
/// A measurement of light that would take longer is not repeated with larger sides: a client may wait for it.
const LONG_MEASUREMENT_S: f64 = 1.0;
/// Views that are smaller than full ones are timed with larger sides, too.
const LARGER_SIDE_RATIO: f32 = 2.0;
/// The longest time of views that are made in one call, unless one alone takes longer.
const CALL_S: f64 = 1.0;

/// Measures g_s, g_v, c, d and e one after the other. Time that other work has the device does not count.
pub(crate) fn measure_costs(engine: &dyn Engine, request: &MeasureCosts) -> Result<Measured, Status> {
    // Work that arrives meanwhile goes between slices of a measurement that nobody waits for.
    let _cut = request.in_background.then(|| engine.live_stream());
    let class = if request.in_background { WorkClass::Background } else { WorkClass::Batch };
    let measurement = Measurement { engine, turn: Turn { class, flow: Turn::next_flow() } };
    let resized = Resized::with_most_pixels(request);
    let first_view = DirectWork::of(&request.workload, resized.request.views(1), request.planes);
    let measured = measurement.costs_in_steps(request, &resized)?;
    // How rays and triangles compare depends on the size of pictures.
    Ok(Measured { traced_pixel_count: engine.traced_pixel_count(&first_view, measurement.turn)?, ..measured })
}

/// Some views that were reconstructed, and the cost of one.
struct Reconstruction {
    made: Vec<View>,
    view_s: f64,
    shared_light: Option<SharedLightCosts>,
}

/// A measurement with smaller images and views, whose times are in proportion to their pixels.
struct Resized {
    request: MeasureCosts,
    texels_ratio: f64,
    pixels_ratio: f64,
}

impl Resized {
    /// Images of full size, and views of [`MOST_PIXELS`] at most.
    fn with_most_pixels(request: &MeasureCosts) -> Self {
        let view_pixels = request.typical_views.first().map_or(1, PinholeCamera::pixel_count);
        Self::new(request, 1.0, (MOST_PIXELS as f32 / view_pixels as f32).sqrt().min(1.0))
    }

    fn new(request: &MeasureCosts, image_side_ratio: f32, view_side_ratio: f32) -> Self {
        let mut resized = request.clone();
        if image_side_ratio < 1.0 {
            for image in &mut resized.workload.sample_cameras {
                *image = image.resized(scaled_size(image.size_px(), image_side_ratio));
            }
        }
        for view in &mut resized.typical_views {
            *view = view.resized(scaled_size(view.size_px, view_side_ratio));
        }
        Self {
            texels_ratio: texels(request) / texels(&resized).max(1.0),
            pixels_ratio: view_pixels(request) / view_pixels(&resized).max(1.0),
            request: resized,
        }
    }

    /// Views of [`LARGER_SIDE_RATIO`], unless they are larger than full ones or than [`MOST_PIXELS`].
    fn with_larger_views(&self) -> Option<Self> {
        let larger = Self::new(&self.request, 1.0, LARGER_SIDE_RATIO);
        let own_pixels = view_pixels(&self.request);
        let larger_pixels = view_pixels(&larger.request);
        let most_pixels = (own_pixels * self.pixels_ratio).min(MOST_PIXELS as f64);
        (own_pixels < larger_pixels && larger_pixels <= most_pixels).then_some(larger)
    }

    fn in_full_size(&self, measured: Measured) -> Measured {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, in_order, tiles } =
            measured.costs;
        let sample_image_s = sample_image_s * self.texels_ratio;
        let costs = Costs {
            sample_image_s,
            direct_view_s: direct_view_s * self.pixels_ratio,
            reconstruct_view_s: reconstruct_view_s * self.pixels_ratio,
            load_set_s: load_set_s * self.texels_ratio,
            encode_view_s: encode_view_s * self.pixels_ratio,
            in_order,
            tiles: tiles.and_then(|tiles| TileCosts::of_image(sample_image_s, tiles.overhead_s, tiles.row_shares)),
        };
        let shared_light = measured.shared_light.map(|light| light.scaled(self.pixels_ratio));
        Measured { costs, shared_light, ..measured }
    }
}

fn texels(request: &MeasureCosts) -> f64 {
    request.workload.sample_cameras.iter().map(SampleCamera::pixel_count).sum::<usize>() as f64
}

fn view_pixels(request: &MeasureCosts) -> f64 {
    request.typical_views.iter().map(PinholeCamera::pixel_count).sum::<usize>() as f64
}

fn view_work(request: &MeasureCosts, cameras: Vec<PinholeCamera>) -> ViewWork {
    ViewWork { cameras, method: request.method.clone(), planes: request.planes }
}

/// The least part of the sides with which all images and views have [`LEAST_QUICK_PIXELS`].
fn least_quick_ratio(request: &MeasureCosts) -> f32 {
    let images = request.workload.sample_cameras.iter().map(SampleCamera::pixel_count);
    let views = request.typical_views.iter().map(PinholeCamera::pixel_count);
    let fewest = images.chain(views).min().unwrap_or(0).max(1);
    (LEAST_QUICK_PIXELS / fewest as f64).sqrt() as f32
}

fn scaled_size(size_px: UVec2, side_ratio: f32) -> UVec2 {
    (size_px.as_vec2() * side_ratio).as_uvec2().max(UVec2::ONE)
}

/// A measurement's device, and its place among other work.
struct Measurement<'a> {
    engine: &'a dyn Engine,
    turn: Turn,
}

impl Measurement<'_> {
    /// Costs in full size, or, of light that takes long, from smaller images and views.
    fn costs_in_steps(&self, request: &MeasureCosts, full: &Resized) -> Result<Measured, Status> {
        if self.engine.sample_planes(&request.method)?.light {
            for (ratio, next_ratio) in QUICK_SIDE_RATIOS {
                let ratio = ratio.max(least_quick_ratio(request));
                if ratio >= next_ratio {
                    continue;
                }
                let quick = Resized::new(request, ratio, ratio);
                let measured = quick.in_full_size(self.costs(&quick)?);
                let costs = &measured.costs;
                let set_s = costs.sample_image_s * request.workload.sample_cameras.len() as f64;
                let warmed_s = costs.direct_view_s + costs.reconstruct_view_s + costs.encode_view_s;
                let next_s = (set_s + 2.0 * warmed_s) * f64::from(next_ratio).powi(2);
                if next_s > LONG_MEASUREMENT_S {
                    return Ok(measured);
                }
            }
        }
        Ok(full.in_full_size(self.costs(full)?))
    }

    fn costs(&self, resized: &Resized) -> Result<Measured, Status> {
        let request = &resized.request;
        let engine = self.engine;
        let workload = &request.workload;
        let planes = engine.sample_planes(&request.method)?;
        // Views are made from all of them: their own cell, and common cells.
        let cells = workload.cells();
        let works = cells.iter().enumerate().map(|(number, cell)| match workload.common_cell(number) {
            Some(_) => SampleWork::of(cell),
            None => SampleWork { planes, ..SampleWork::of(cell) },
        });
        let works: Vec<SampleWork> = works.collect();
        let is_tileable = engine.images_are_independent(&workload.sampling)?;
        let sampled = works.iter().map(|work| self.sampled_timed(work, is_tileable));
        let (encoded, cells_s): (Vec<_>, Vec<f64>) = sampled.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let (sets, load_s) = self.timed(|| {
            let mut sets = Vec::new();
            for (number, (cell, images)) in cells.iter().zip(&encoded).enumerate() {
                let is_common = workload.common_cell(number).is_some();
                let set = SampleSet::of(cell, decoded(cell, images)?, is_common).map_err(codec)?;
                sets.push(engine.upload(&set, self.turn)?);
            }
            Ok(sets)
        })?;
        let set = set_of_view(engine, workload, sets)?;
        let load_set_s = load_s / cells.len().max(1) as f64;
        let sample_image_s = cells_s.iter().sum::<f64>() / workload.sample_cameras.len().max(1) as f64;
        let tiles = match works.first().zip(cells_s.first()) {
            Some((work, cell_s)) if is_tileable => self.tile_costs(work, cell_s / work.cameras.len().max(1) as f64)?,
            _ => None,
        };
        let (drawn, direct_view_s) = self.direct_view_s(request)?;
        let reconstruction = match request.method.as_str() {
            DIRECT => Reconstruction { made: drawn, view_s: direct_view_s, shared_light: None },
            _ => self.reconstruction(set.as_ref(), resized)?,
        };
        let Reconstruction { made, view_s: reconstruct_view_s, shared_light } = reconstruction;
        let encode_view_s = self.encode_s(&made, &request.codec)?;
        let in_order = engine.images_are_sequential(&workload.sampling)?;
        let costs =
            Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, in_order, tiles };
        let auto_exposure = auto_exposure(engine, workload, self.turn)?;
        Ok(Measured { costs, planes, auto_exposure, shared_light, ..Measured::default() })
    }

    /// The cost of one view, and where it goes. Small views take longer than their share of the pixels: from views of two sizes follows
    /// what a full one takes, and that in proportion to the pixels of a small one.
    fn reconstruction(&self, set: &dyn UploadedSet, resized: &Resized) -> Result<Reconstruction, Status> {
        let (made, small_s) = self.reconstruct_view_s(set, &resized.request)?;
        let Some(larger) = resized.with_larger_views() else {
            let shared_light = self.shared_light(set, &resized.request, small_s)?;
            return Ok(Reconstruction { made, view_s: small_s, shared_light });
        };
        let (_, larger_s) = self.reconstruct_view_s(set, &larger.request)?;
        let small = TimedSize { pixels: view_pixels(&resized.request), seconds: small_s };
        let larger_size = TimedSize { pixels: view_pixels(&larger.request), seconds: larger_s };
        let full_s = small.at_size(Some(larger_size), small.pixels * resized.pixels_ratio);
        let view_s = full_s / resized.pixels_ratio;
        let parts = self.shared_light(set, &larger.request, larger_s)?;
        let shared_light = parts.filter(|_| larger_s > 0.0).map(|parts| parts.scaled(view_s / larger_s));
        Ok(Reconstruction { made, view_s, shared_light })
    }

    /// Where the time of one view goes whose light comes from samples.
    fn shared_light(
        &self,
        set: &dyn UploadedSet,
        request: &MeasureCosts,
        reconstruct_view_s: f64,
    ) -> Result<Option<SharedLightCosts>, Status> {
        let parts = self.engine.light_parts(set, &view_work(request, request.views(1)), self.turn)?;
        Ok(parts.map(|LightParts { known_ratio, surfaces_s, draft_s }| SharedLightCosts {
            known_ratio,
            surfaces_s,
            look_up_s: (draft_s - surfaces_s).max(0.0),
            unknown_s: (reconstruct_view_s - draft_s).max(0.0),
        }))
    }

    /// Images as they leave a sampler, which encodes one set before it samples the next.
    fn sampled(&self, work: &SampleWork) -> Result<Vec<EncodedImage>, Status> {
        let images = self.engine.sample(work, self.turn)?;
        images.iter().map(|image| encode_sample_image(image).map_err(codec)).collect()
    }

    /// Images, and their time. Where images are tileable, one row of the last builds all shaders: a set whose light is expensive is
    /// then sampled once.
    fn sampled_timed(&self, work: &SampleWork, is_tileable: bool) -> Result<(Vec<EncodedImage>, f64), Status> {
        let Some(row) = one_row(work).filter(|_| is_tileable) else {
            return self.timed(|| self.sampled(work));
        };
        self.sampled(&row)?;
        self.timed_warm(|| self.sampled(work))
    }

    /// The overhead of a tile, measured on a tile of one row, and the shares of rows, measured on quarters of the height.
    /// Each quarter is of another image, since images differ. Images of too few rows are not tileable.
    fn tile_costs(&self, whole: &SampleWork, sample_image_s: f64) -> Result<Option<TileCosts>, Status> {
        let Some(row) = one_row(whole) else { return Ok(None) };
        if whole.cameras.iter().any(|camera| (camera.size_px().y as usize) < ROW_PARTS) {
            return Ok(None);
        }
        let tile_s = |work: SampleWork| {
            // Whole images have built the shaders, and what takes long varies little.
            if sample_image_s > LONG_RUN_S {
                let (sampled, own_s) = own_time(self.engine, || self.sampled(&work));
                return sampled.map(|_| own_s);
            }
            Ok::<f64, Status>(self.timed(|| self.sampled(&work))?.1)
        };
        let row_s = tile_s(row)?;
        let mut quarters_s = [0.0; ROW_PARTS];
        for (quarter, quarter_s) in quarters_s.iter_mut().enumerate() {
            let wanted = vec![(quarter % whole.cameras.len() * ROW_PARTS + quarter) as u32];
            *quarter_s = tile_s(SampleWork { tile_count: ROW_PARTS as u32, wanted, ..whole.clone() })?;
        }
        Ok(split_into_overhead_and_shares(sample_image_s, row_s, quarters_s))
    }

    /// The cost of one view over all typical views, in calls of the batch's size; with some of the views.
    fn reconstruct_view_s(&self, set: &dyn UploadedSet, request: &MeasureCosts) -> Result<(Vec<View>, f64), Status> {
        match request.typical_views.len() as u32 {
            0..=1 => as_many_as_time_allows(request.batch_count, |views| self.reconstructed(set, request, views)),
            views => self.reconstructed(set, request, request.batch_count.max(views)),
        }
    }

    fn reconstructed(
        &self,
        set: &dyn UploadedSet,
        request: &MeasureCosts,
        views: u32,
    ) -> Result<(Vec<View>, f64), Status> {
        let batch = request.batch_count as usize;
        let views = request.views(views);
        let calls = views.chunks(batch.max(1)).map(|cameras| view_work(request, cameras.to_vec()));
        let calls: Vec<ViewWork> = calls.collect();
        let (made, seconds) = self.timed(|| {
            calls.iter().try_fold(Vec::new(), |_, work| Ok(self.engine.reconstruct(set, work, self.turn)?))
        })?;
        Ok((made, seconds / views.len() as f64))
    }

    /// The cost of one view; with some of the views.
    fn direct_view_s(&self, request: &MeasureCosts) -> Result<(Vec<View>, f64), Status> {
        as_many_as_time_allows(request.batch_count, |views| {
            let (drawn, direct_s) = self.timed(|| {
                let work = DirectWork::of(&request.workload, request.views(views), request.planes);
                Ok(self.engine.draw_direct(&work, self.turn)?)
            })?;
            Ok((drawn, direct_s / f64::from(views)))
        })
    }

    /// The mean cost over all views of the batch. A single view ends within a time slice, in which a node with a CPU quota
    /// is as fast as any.
    fn encode_s(&self, made: &[View], codec_name: &str) -> Result<f64, Status> {
        let frame_codec: FrameCodec = codec_name.parse().map_err(codec)?;
        let ((), seconds) =
            self.timed(|| made.iter().try_for_each(|view| encode_view(view, frame_codec).map(drop).map_err(codec)))?;
        Ok(seconds / made.len().max(1) as f64)
    }

    /// As [`Measurement::timed_warm`], after a warm-up, which may build shaders.
    fn timed<T>(&self, mut run: impl FnMut() -> Result<T, Status>) -> Result<(T, f64), Status> {
        run()?;
        self.timed_warm(run)
    }

    /// The result of the first run, and the median time of the runs: one long run, or [`RUNS`].
    fn timed_warm<T>(&self, mut run: impl FnMut() -> Result<T, Status>) -> Result<(T, f64), Status> {
        let (result, first_s) = own_time(self.engine, &mut run);
        let result = result?;
        let runs = if first_s > LONG_RUN_S { 1 } else { RUNS };
        let mut seconds = vec![first_s];
        while seconds.len() < runs {
            let (done, own_s) = own_time(self.engine, &mut run);
            done?;
            seconds.push(own_s);
        }
        seconds.sort_by(f64::total_cmp);
        Ok((result, seconds[seconds.len() / 2]))
    }
}

fn split_into_overhead_and_shares(sample_image_s: f64, row_s: f64, quarters_s: [f64; ROW_PARTS]) -> Option<TileCosts> {
    let overhead_s = quarters_s.iter().copied().fold(row_s.min(sample_image_s), f64::min);
    let rows_s = quarters_s.map(|tile_s| tile_s - overhead_s);
    let all_s: f64 = rows_s.iter().sum();
    TileCosts::of_image(sample_image_s, overhead_s, (all_s > 0.0).then(|| rows_s.map(|tile_s| tile_s / all_s)))
}

fn codec(error: impl Display) -> Status {
    Status::internal(format!("codec: {error}"))
}

/// The first row of the last image: where images depend on those before them, its time has theirs. `None` without images.
fn one_row(work: &SampleWork) -> Option<SampleWork> {
    let rows = work.cameras.last()?.size_px().y;
    let last = work.cameras.len() as u32 - 1;
    Some(SampleWork { tile_count: rows, wanted: vec![last * rows], ..work.clone() })
}

/// Views and the cost of one of them, by `make` for a number of views: as many, up to `most`, as time allows. Fixed costs
/// are shared as in real batches where a view is quick, and hardly matter where it is not.
fn as_many_as_time_allows(
    most: u32,
    make: impl Fn(u32) -> Result<(Vec<View>, f64), Status>,
) -> Result<(Vec<View>, f64), Status> {
    let (made, alone_s) = make(1)?;
    match views_in_time(alone_s, most) {
        1 => Ok((made, alone_s)),
        views => make(views),
    }
}

/// The number of views to make in one call, where one alone takes `alone_s`.
fn views_in_time(alone_s: f64, most: u32) -> u32 {
    // A cast saturates: views that take no time give the largest batch.
    ((CALL_S / alone_s) as u32).clamp(1, most.max(1))
}

fn decoded(workload: &Workload, encoded: &[EncodedImage]) -> Result<Vec<SampleImage>, Status> {
    let limits = DecodeLimits::default();
    let images = encoded.iter().zip(&workload.sample_cameras);
    images
        .map(|(image, camera)| decode_sample_image(&image.header, camera, &image.payload, &limits).map_err(codec))
        .collect()
}

#[cfg(test)]
#[path = "measure_tests.rs"]
pub(crate) mod tests;
