//! Measured costs of this node's operations, each alone and warm. Pictures are finished, by the session's lighting: g_s and
//! g_v hold all light that samplers compute, and c the light that compositors add.

use std::fmt::Display;

use cluster::{Costs, DIRECT, MeasureCosts, Measured, ROW_PARTS, SharedLightCosts, TileCosts, TimedSize, Workload};
use codec::{DecodeLimits, EncodedImage, FrameCodec};
use codec::{decode_sample_image, encode_sample_image, encode_view};
use depth_image::{PinholeCamera, SampleCamera, SampleImage, View};
use glam::UVec2;
use tonic::Status;

use crate::auto_exposure::auto_exposure;
use crate::engine::{
    DirectWork, Engine, LightParts, SampleSet, SampleWork, Turn, UploadedSet, ViewWork, WorkClass, own_time,
    set_of_view,
};

/// Runs of one operation after a warm-up, in which shaders are built.
const RUNS: usize = 3;
/// A run that takes longer is not repeated: with expensive lighting it takes seconds, and varies little.
const LONG_RUN_S: f64 = 0.5;
/// Larger views are measured in this size: their time is in proportion to their pixels.
const MOST_PIXELS: usize = 1 << 20;
/// Images of light and views are measured with these parts of their sides, one after the other, before they are in full size.
const QUICK_SIDE_RATIOS: [f32; 2] = [0.125, 0.25];
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

/// About the time that it takes to measure these costs.
fn measurement_s(costs: &Costs, workload: &Workload) -> f64 {
    let set_s = costs.sample_image_s * workload.sample_cameras.len() as f64;
    let warmed_s = costs.direct_view_s + costs.reconstruct_view_s + costs.encode_view_s;
    set_s + 2.0 * warmed_s
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
        let ratio = |full: usize, small: usize| full as f64 / small.max(1) as f64;
        let texels = |request: &MeasureCosts| -> usize {
            request.workload.sample_cameras.iter().map(SampleCamera::pixel_count).sum()
        };
        let pixels =
            |request: &MeasureCosts| -> usize { request.typical_views.iter().map(PinholeCamera::pixel_count).sum() };
        Self {
            texels_ratio: ratio(texels(request), texels(&resized)),
            pixels_ratio: ratio(pixels(request), pixels(&resized)),
            request: resized,
        }
    }

    fn view_pixels(&self) -> f64 {
        self.request.typical_views.iter().map(PinholeCamera::pixel_count).sum::<usize>() as f64
    }

    /// Views of [`LARGER_SIDE_RATIO`], unless they are larger than full ones or than [`MOST_PIXELS`].
    fn with_larger_views(&self) -> Option<Self> {
        let larger = Self::new(&self.request, 1.0, LARGER_SIDE_RATIO);
        let most_pixels = (self.view_pixels() * self.pixels_ratio).min(MOST_PIXELS as f64);
        (self.view_pixels() < larger.view_pixels() && larger.view_pixels() <= most_pixels).then_some(larger)
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
            let next_ratios = QUICK_SIDE_RATIOS.into_iter().skip(1).chain([1.0]);
            for (ratio, next_ratio) in QUICK_SIDE_RATIOS.into_iter().zip(next_ratios) {
                let ratio = ratio.max(least_quick_ratio(request));
                if ratio >= next_ratio {
                    continue;
                }
                let quick = Resized::new(request, ratio, ratio);
                let measured = quick.in_full_size(self.costs(&quick)?);
                let next_s = measurement_s(&measured.costs, &request.workload) * f64::from(next_ratio).powi(2);
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
        let sample = |(number, cell): (usize, &Workload)| match workload.common_cell(number) {
            Some(_) => SampleWork::of(cell),
            None => SampleWork { planes, ..SampleWork::of(cell) },
        };
        let is_tileable = engine.images_are_independent(&workload.sampling)?;
        let sampled = cells.iter().enumerate().map(|cell| self.sampled_timed(&sample(cell), is_tileable));
        let (encoded, cells_s): (Vec<_>, Vec<f64>) = sampled.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let upload = |(number, (cell, images)): (usize, (&Workload, &Vec<_>))| {
            let is_common = workload.common_cell(number).is_some();
            let set = SampleSet::of(cell, decoded(cell, images)?, is_common).map_err(codec)?;
            Ok(engine.upload(&set, self.turn)?)
        };
        let upload_all = || cells.iter().zip(&encoded).enumerate().map(upload).collect::<Result<Vec<_>, Status>>();
        let (sets, load_s) = self.timed(upload_all)?;
        let set = set_of_view(engine, workload, sets)?;
        let load_set_s = load_s / cells.len().max(1) as f64;
        let sample_image_s = cells_s.iter().sum::<f64>() / workload.sample_cameras.len().max(1) as f64;
        let first = cells.first().zip(cells_s.first()).filter(|_| is_tileable);
        let tile_costs = |(cell, cell_s): (&Workload, &f64)| {
            self.tile_costs(&sample((0, cell)), cell_s / cell.sample_cameras.len().max(1) as f64)
        };
        let tiles = first.map(tile_costs).transpose()?.flatten();
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
        let small = TimedSize { pixels: resized.view_pixels(), seconds: small_s };
        let larger_size = TimedSize { pixels: larger.view_pixels(), seconds: larger_s };
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
        let work = ViewWork { cameras: request.views(1), method: request.method.clone(), planes: request.planes };
        let parts = self.engine.light_parts(set, &work, self.turn)?;
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

    /// Images, and their time. Where images are tileable, one row of the first builds all shaders: a set whose light is expensive is
    /// then sampled once.
    fn sampled_timed(&self, work: &SampleWork, is_tileable: bool) -> Result<(Vec<EncodedImage>, f64), Status> {
        let Some(first) = work.cameras.first().copied().filter(|_| is_tileable) else {
            return self.timed(|| self.sampled(work));
        };
        let row = first.tile(0, first.size_px().y);
        self.sampled(&SampleWork { cameras: vec![row], wanted: vec![0], ..work.clone() })?;
        self.timed_warm(|| self.sampled(work))
    }

    /// The overhead of a tile, measured on a tile of one row, and the shares of rows, measured on quarters of the height.
    /// Each quarter is of another image, since images differ. Images of too few rows are not tileable.
    fn tile_costs(&self, whole: &SampleWork, sample_image_s: f64) -> Result<Option<TileCosts>, Status> {
        let Some(first) = whole.cameras.first().copied() else { return Ok(None) };
        if whole.cameras.iter().any(|camera| (camera.size_px().y as usize) < ROW_PARTS) {
            return Ok(None);
        }
        let tile_s = |camera: SampleCamera| {
            let work = SampleWork { cameras: vec![camera], wanted: vec![0], ..whole.clone() };
            // Whole images have built the shaders, and what takes long varies little.
            if sample_image_s > LONG_RUN_S {
                let (sampled, own_s) = own_time(self.engine, || self.sampled(&work));
                return sampled.map(|_| own_s);
            }
            Ok::<f64, Status>(self.timed(|| self.sampled(&work))?.1)
        };
        let row_s = tile_s(first.tile(0, first.size_px().y))?;
        let mut quarters_s = [0.0; ROW_PARTS];
        for (quarter, camera) in whole.cameras.iter().cycle().take(ROW_PARTS).enumerate() {
            quarters_s[quarter] = tile_s(camera.tile(quarter as u32, ROW_PARTS as u32))?;
        }
        Ok(split_into_overhead_and_shares(sample_image_s, row_s, quarters_s))
    }

    /// The cost of one view over all typical views, in calls of the batch's size; with some of the views. Of one typical view as many
    /// are made as time allows, as of views that are drawn directly.
    fn reconstruct_view_s(&self, set: &dyn UploadedSet, request: &MeasureCosts) -> Result<(Vec<View>, f64), Status> {
        if request.typical_views.len() > 1 {
            return self.reconstructed(set, request, request.batch_count.max(request.typical_views.len() as u32));
        }
        let (made, alone_s) = self.reconstructed(set, request, 1)?;
        match views_in_time(alone_s, request.batch_count) {
            1 => Ok((made, alone_s)),
            views => self.reconstructed(set, request, views),
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
        let work = |cameras: &[PinholeCamera]| ViewWork {
            cameras: cameras.to_vec(),
            method: request.method.clone(),
            planes: request.planes,
        };
        let calls: Vec<ViewWork> = views.chunks(batch.max(1)).map(work).collect();
        let make = || calls.iter().try_fold(Vec::new(), |_, work| Ok(self.engine.reconstruct(set, work, self.turn)?));
        let (made, seconds) = self.timed(make)?;
        Ok((made, seconds / views.len() as f64))
    }

    /// Measured on as many views as time allows; with some of the views. Fixed costs are shared as in real batches where a
    /// view is quick, and hardly matter where it is not.
    fn direct_view_s(&self, request: &MeasureCosts) -> Result<(Vec<View>, f64), Status> {
        let work = |views: u32| DirectWork::of(&request.workload, request.views(views), request.planes);
        let draw = |views: u32| Ok(self.engine.draw_direct(&work(views), self.turn)?);
        let (drawn, alone_s) = self.timed(|| draw(1))?;
        let views = views_in_time(alone_s, request.batch_count);
        if views == 1 {
            return Ok((drawn, alone_s));
        }
        let (drawn, direct_s) = self.timed(|| draw(views))?;
        Ok((drawn, direct_s / f64::from(views)))
    }

    /// The mean cost over all views of the batch. A single view ends within a time slice, in which a node with a CPU quota
    /// is as fast as any.
    fn encode_s(&self, made: &[View], codec_name: &str) -> Result<f64, Status> {
        let frame_codec: FrameCodec = codec_name.parse().map_err(codec)?;
        let encode = || made.iter().try_for_each(|view| encode_view(view, frame_codec).map(drop).map_err(codec));
        let ((), seconds) = self.timed(encode)?;
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
        let mut seconds = vec![first_s];
        while seconds.len() < runs_after(first_s) {
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

/// The number of views to make in one call, where one alone takes `alone_s`.
fn views_in_time(alone_s: f64, most: u32) -> u32 {
    // A cast saturates: views that take no time give the largest batch.
    ((CALL_S / alone_s) as u32).clamp(1, most.max(1))
}

fn decoded(workload: &Workload, encoded: &[EncodedImage]) -> Result<Vec<SampleImage>, Status> {
    let limits = DecodeLimits::default();
    let decode = |(image, camera): (&EncodedImage, &SampleCamera)| {
        decode_sample_image(&image.header, camera, &image.payload, &limits).map_err(codec)
    };
    encoded.iter().zip(&workload.sample_cameras).map(decode).collect()
}

/// The number of runs, by the time of the first.
fn runs_after(first_s: f64) -> usize {
    if first_s > LONG_RUN_S { 1 } else { RUNS }
}

#[cfg(test)]
#[path = "measure_tests.rs"]
pub(crate) mod tests;
