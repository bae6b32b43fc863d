//! Methods against the truth: the same views drawn from the scene, pixel by pixel.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use codec::{DecodeLimits, PlaneSet, decode_depth_image, encode_depth_image};
use depth_image::{Camera, DepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use engine::GpuEngine;
use metrics::{
    DepthPlane, PixelClass, Rgb8Image, ScoreMap, class_mask, classify, depth_errors, flip_map, psnr_db, ssim_map,
    unheld_rate,
};
use node::{DirectWork, Engine as _, SampleWork};
use rayon::prelude::*;
use reconstruction::{ReconstructionMethod, SampleSet, SetDescription};
use render::Lighting;

/// Both planes beside colour.
pub const ALL_PLANES: ViewPlanes = ViewPlanes { inverse_depth: true, provenance: true };
const COLOR_ONLY: ViewPlanes = ViewPlanes { inverse_depth: false, provenance: false };
/// A channel off by more than this, of 255, is a wrong colour.
const WRONG_COLOR: u8 = 16;

/// A scene's sample set as compositors have it, and views drawn from the scene.
pub struct Truth {
    engine: Arc<GpuEngine>,
    /// The views' cameras.
    pub cameras: Vec<PinholeCamera>,
    /// Drawn from the scene.
    pub views: Vec<View>,
    /// Decoded from what travels.
    pub images: Vec<DepthImage>,
    set: SampleSet,
    classes: Vec<Vec<PixelClass>>,
}

/// How true and how fast a method is. Shares are of 1, over all views together.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which.
    pub method: ReconstructionMethod,
    /// One view in a batch, to host pixels.
    pub ms_a_view: f64,
    /// Mean over views.
    pub psnr_db: f64,
    /// Of the worst view.
    pub psnr_min_db: f64,
    /// Mean over views.
    pub ssim: f64,
    /// Mean over views.
    pub flip: f64,
    /// Of covered pixels, mean over views that have any.
    pub flip_covered: f64,
    /// Hits off by more than 1 % in depth, of all hits.
    pub wrong_hits: f64,
    /// Pixels that no sample camera knows, of all.
    pub unknown: f64,
    /// Disoccluded pixels with a wrong colour, of the disoccluded; NaN where there are none.
    pub disoccluded_wrong: f64,
    /// Of those, the share that is not marked as filled, of the disoccluded.
    pub disoccluded_unmarked: f64,
    /// Disoccluded pixels, of all.
    pub disoccluded: f64,
    /// Loads of depth and colour words a pixel.
    pub fetches_a_ray: f64,
}

impl Truth {
    /// Samples the scene, sends the images through the codec, and draws the views.
    ///
    /// # Errors
    /// The device's or the codec's.
    pub fn take(
        engine: &Arc<GpuEngine>,
        setup: &Setup,
        args: &SceneArgs,
        cameras: Vec<PinholeCamera>,
    ) -> anyhow::Result<Self> {
        let hash = setup.offer.hash.to_string();
        engine.put_scene(&hash, &setup.scene)?;
        let lighting = args.lighting.to_string();
        let samples = setup.samples.iter().copied().map(Camera::Pinhole).collect();
        let work = SampleWork {
            scene_hash: hash.clone(),
            wanted: (0..setup.samples.len() as u32).collect(),
            cameras: samples,
            sampling: args.sampling.to_string(),
            method: args.method.to_string(),
            lighting: lighting.clone(),
            scene_time_s: 0.0,
            settled_at_s: None,
            refinement: cluster::Refinement::default(),
        };
        let images = engine.sample(&work)?.iter().map(travelled).collect::<anyhow::Result<Vec<_>>>()?;
        let description = SetDescription {
            volume: setup.offer.volume,
            background_linear: setup.offer.background_linear,
            illumination: &setup.offer.illumination,
            highlight: args.lighting.highlight(),
        };
        let set = engine.reconstructor().upload(&images, &description)?;
        let direct =
            DirectWork { scene_hash: hash, cameras: cameras.clone(), lighting, scene_time_s: 0.0, planes: ALL_PLANES };
        let views = engine.draw_direct(&direct)?;
        let class = |(camera, view): (&PinholeCamera, &View)| {
            let depth = view.inverse_depth_per_m.as_ref().context("a view without depth")?;
            Ok(classify(camera, depth, &images)?)
        };
        let classes = cameras.iter().zip(&views).map(class).collect::<anyhow::Result<_>>()?;
        Ok(Self { engine: engine.clone(), cameras, views, images, set, classes })
    }

    /// Of the views' pixels that show a surface, those whose surface no sample image holds.
    ///
    /// # Errors
    /// Views without depth.
    pub fn unheld(&self) -> anyhow::Result<f64> {
        let rate = |(camera, view): (&PinholeCamera, &View)| {
            let depth = view.inverse_depth_per_m.as_ref().context("a view without depth")?;
            Ok(unheld_rate(camera, depth, &self.images)?.unwrap_or(0.0))
        };
        let rates = self.cameras.iter().zip(&self.views).map(rate).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(rates.iter().sum::<f64>() / rates.len() as f64)
    }

    /// The same views drawn from the scene in another light.
    ///
    /// # Errors
    /// The device's.
    pub fn drawn(&self, setup: &Setup, lighting: Lighting) -> anyhow::Result<Vec<View>> {
        let direct = DirectWork {
            scene_hash: setup.offer.hash.to_string(),
            cameras: self.cameras.clone(),
            lighting: lighting.to_string(),
            scene_time_s: 0.0,
            planes: COLOR_ONLY,
        };
        Ok(self.engine.draw_direct(&direct)?)
    }

    /// Reconstructs all views.
    ///
    /// # Errors
    /// The device's.
    pub fn reconstruct(&self, method: ReconstructionMethod, planes: ViewPlanes) -> anyhow::Result<Vec<View>> {
        Ok(self.engine.reconstructor().reconstruct(&self.set, &self.cameras, method, planes)?)
    }

    /// Milliseconds a view in one batch of `at_least` views or more, the median of `runs` after one that does
    /// not count.
    ///
    /// # Errors
    /// The device's.
    pub fn ms_a_view(&self, method: ReconstructionMethod, at_least: usize, runs: usize) -> anyhow::Result<f64> {
        let times = at_least.div_ceil(self.cameras.len().max(1)).max(1);
        let cameras = self.cameras.repeat(times);
        let run = || {
            let start = Instant::now();
            self.engine.reconstructor().reconstruct(&self.set, &cameras, method, COLOR_ONLY)?;
            anyhow::Ok(start.elapsed().as_secs_f64())
        };
        run()?;
        let seconds = (0..runs.max(1)).map(|_| run()).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(median(seconds) * 1e3 / cameras.len() as f64)
    }

    /// How true and how fast a method is.
    ///
    /// # Errors
    /// The device's.
    pub fn evaluate(&self, method: ReconstructionMethod, runs: usize) -> anyhow::Result<Row> {
        self.evaluate_timed_on(method, 64, runs)
    }

    /// As [`Truth::evaluate`], timed on a batch of so many views or more.
    ///
    /// # Errors
    /// The device's.
    pub fn evaluate_timed_on(&self, method: ReconstructionMethod, views: usize, runs: usize) -> anyhow::Result<Row> {
        let ms_a_view = self.ms_a_view(method, views, runs)?;
        let (views, statistics) =
            self.engine.reconstructor().reconstruct_measured(&self.set, &self.cameras, method, ALL_PLANES, true)?;
        let pairs: Vec<_> = self.views.iter().zip(&views).zip(&self.classes).collect();
        let errors = pairs
            .into_par_iter()
            .map(|((truth, view), classes)| Errors::of(truth, view, classes))
            .collect::<anyhow::Result<Vec<_>>>()?;
        Ok(row(method, ms_a_view, statistics.fetches_per_ray.unwrap_or(f64::NAN), &errors))
    }
}

fn travelled(image: &DepthImage) -> anyhow::Result<DepthImage> {
    let encoded = encode_depth_image(image, PlaneSet::ALL)?;
    Ok(decode_depth_image(&encoded.header, image.camera, &encoded.payload, &DecodeLimits::default())?)
}

/// One view's, to be added up.
#[derive(Debug, Clone, Copy)]
struct Errors {
    psnr_db: f64,
    ssim: f64,
    flip: f64,
    flip_covered: Option<f64>,
    pixels: usize,
    hits: usize,
    wrong_hits: usize,
    unknown: usize,
    disoccluded: usize,
    disoccluded_wrong: usize,
    disoccluded_unmarked: usize,
}

impl Errors {
    fn of(truth: &View, view: &View, classes: &[PixelClass]) -> anyhow::Result<Self> {
        let (reference, test) = (Rgb8Image::of_view(truth)?, Rgb8Image::of_view(view)?);
        let flip = flip_map(&reference, &test)?;
        let depth = depth_errors(&known_depth(truth)?, &known_depth(view)?, None)?;
        let provenance = view.provenance.as_ref().context("a view without provenance")?;
        let wrong = truth
            .srgb8
            .as_chunks::<3>()
            .0
            .iter()
            .zip(view.srgb8.as_chunks::<3>().0)
            .map(|(a, b)| (0..3).any(|i| a[i].abs_diff(b[i]) > WRONG_COLOR));
        let disoccluded =
            classes.iter().zip(wrong).zip(provenance).filter(|((class, _), _)| **class == PixelClass::Disoccluded);
        let mut errors = Self {
            psnr_db: psnr_db(&reference, &test, None)?.unwrap_or(f64::NAN).min(metrics::PSNR_CAP_DB),
            ssim: mean(&ssim_map(&reference, &test)?)?,
            flip: mean(&flip)?,
            flip_covered: flip.mean(Some(&class_mask(classes, PixelClass::Covered)))?,
            pixels: depth.pixels,
            hits: depth.hit_px,
            wrong_hits: depth.wrong_hit_px,
            unknown: depth.unknown_px,
            disoccluded: 0,
            disoccluded_wrong: 0,
            disoccluded_unmarked: 0,
        };
        for ((_, wrong), provenance) in disoccluded {
            errors.disoccluded += 1;
            errors.disoccluded_wrong += usize::from(wrong);
            errors.disoccluded_unmarked += usize::from(wrong && provenance.kind() != ProvenanceKind::Filled);
        }
        Ok(errors)
    }
}

fn row(method: ReconstructionMethod, ms_a_view: f64, fetches_a_ray: f64, errors: &[Errors]) -> Row {
    let mean = |value: fn(&Errors) -> f64| errors.iter().map(value).sum::<f64>() / errors.len() as f64;
    let sum = |value: fn(&Errors) -> usize| errors.iter().map(value).sum::<usize>() as f64;
    let covered: Vec<f64> = errors.iter().filter_map(|e| e.flip_covered).collect();
    Row {
        method,
        ms_a_view,
        psnr_db: mean(|e| e.psnr_db),
        psnr_min_db: errors.iter().map(|e| e.psnr_db).fold(f64::INFINITY, f64::min),
        ssim: mean(|e| e.ssim),
        flip: mean(|e| e.flip),
        flip_covered: covered.iter().sum::<f64>() / covered.len() as f64,
        wrong_hits: sum(|e| e.wrong_hits) / sum(|e| e.hits),
        unknown: sum(|e| e.unknown) / sum(|e| e.pixels),
        disoccluded_wrong: sum(|e| e.disoccluded_wrong) / sum(|e| e.disoccluded),
        disoccluded_unmarked: sum(|e| e.disoccluded_unmarked) / sum(|e| e.disoccluded),
        disoccluded: sum(|e| e.disoccluded) / sum(|e| e.pixels),
        fetches_a_ray,
    }
}

/// Mean FLIP over views.
///
/// # Errors
/// When views are not of one size.
pub fn mean_flip(references: &[View], tests: &[View]) -> anyhow::Result<f64> {
    let flip = |(reference, test): (&View, &View)| {
        mean(&flip_map(&Rgb8Image::of_view(reference)?, &Rgb8Image::of_view(test)?)?)
    };
    let flips = references.iter().zip(tests).map(flip).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(flips.iter().sum::<f64>() / flips.len() as f64)
}

/// Depth, unknown where it was filled in.
fn known_depth(view: &View) -> anyhow::Result<DepthPlane<'static>> {
    let mut plane = view.inverse_depth_per_m.clone().context("a view without depth")?;
    for (inverse, provenance) in plane.iter_mut().zip(view.provenance.iter().flatten()) {
        if provenance.kind() == ProvenanceKind::Filled {
            *inverse = depth_image::HOLE_INVERSE_DEPTH;
        }
    }
    Ok(DepthPlane::new(view.size_px.x, view.size_px.y, plane)?)
}

fn mean(map: &ScoreMap) -> anyhow::Result<f64> {
    Ok(map.mean(None)?.unwrap_or(f64::NAN))
}

/// The middle of some numbers; NaN of none.
#[must_use]
pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}
