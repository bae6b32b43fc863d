//! Samples a pixel: the time and the error of views with 1 to 16, against direct views with 64.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use coordinator::fitting_size_px;
use depth_image::{Antialias, PinholeCamera, View, ViewCell, ViewPlanes, linear_from_srgb8, srgb8_from_linear};
use engine::GpuEngine;
use glam::{UVec2, Vec2};
use metrics::{PictureErrors, Rgb8Image};
use reconstruction::ReconstructionMethod;
use report::{Axis, Bar, Better, Check, Point, Report, Series, Table, XyChart};
use sampling::SamplingMethod;
use scene::SceneSpec;

use super::args::BenchArgs;
use super::peer;
use super::timing::in_turn;
use crate::models::models_of;
use crate::reference_views::{ReferenceViews, sample};

/// A method that draws, beside the one that is asked for.
const HYBRID: &str = "hybrid_mesh";
/// Scenes of the study beside models.
const SCENES: [&str; 3] = ["tree-terrain-500k", "urban", "grass"];
/// What FLIP with four samples a pixel may be at most, over that with one, for each of the scenes.
const FLIP_BARS: [f64; 3] = [0.82, 0.70, 0.85];
/// The number of models on which defaults are compared with those before, the largest files.
const DEFAULTS_MODELS: usize = 4;
/// The size of sample images before they followed the views.
const FIXED_SAMPLES_PX: UVec2 = UVec2::new(400, 300);
/// The least gain in foreground PSNR of the defaults over those before: the mean of models, and of each.
const LEAST_GAINS_DB: [f64; 2] = [4.0, 2.5];
/// Sizes at which c is compared.
const TIMED_SIZES_PX: [UVec2; 2] = [VIEW_SIZE_PX, UVec2::new(640, 360)];
/// Views of a batch that is timed.
const TIMED_VIEWS: usize = 16;
/// Parts of a pixel's side at which the truth's patterns of 16 are placed, from its centre.
const TRUTH_OFFSETS_PX: [Vec2; 4] =
    [Vec2::new(-1.0, -3.0), Vec2::new(3.0, -1.0), Vec2::new(1.0, 3.0), Vec2::new(-3.0, 1.0)];
const TRUTH_STEP_PX: f32 = 1.0 / 128.0;

/// How views are made.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Maker {
    Reconstructed(ReconstructionMethod),
    Direct,
}

/// Error and time of one number of samples.
struct Row {
    maker: Maker,
    antialias: Antialias,
    ms_a_view: f64,
    foreground_psnr_db: f64,
    psnr_db: f64,
    foreground_flip: f64,
    flip: f64,
}

const COLUMNS: [(&str, &str); 8] = [
    ("scene", ""),
    ("views by", ""),
    ("samples a pixel", ""),
    ("time a view", "ms"),
    ("foreground PSNR", "dB"),
    ("PSNR", "dB"),
    ("foreground FLIP", ""),
    ("FLIP", ""),
];

const FILTERED: [(&str, &str); 7] = [
    ("scene", ""),
    ("positions around a centre", ""),
    ("time a sample image", "ms"),
    ("foreground PSNR", "dB"),
    ("PSNR", "dB"),
    ("foreground FLIP", ""),
    ("FLIP", ""),
];

/// A scene with views of it.
struct Subject {
    setup: Setup,
    args: SceneArgs,
    reference: ReferenceViews,
    /// Of 64 samples a pixel.
    truth: Vec<View>,
}

/// Adds a table, charts and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let mut table = Table::new("Samples a pixel, against direct views with 64", &COLUMNS);
    let mut filtered = Table::new("Colours of samples: means of texels' centres and positions around them", &FILTERED);
    let models = match &args.models {
        Some(folder) => models_of(folder, 2)?,
        None => Vec::new(),
    };
    let named = SCENES.into_iter().map(|name| Ok((name.to_owned(), fixtures::spec(name)?)));
    let named = named.collect::<anyhow::Result<Vec<(String, SceneSpec)>>>()?;
    let models = models.into_iter().map(|path| (path.display().to_string(), SceneSpec::File(path)));
    for (number, (name, spec)) in named.into_iter().chain(models).enumerate() {
        let subject = Subject::new(args, engine, SceneArgs::new(spec))?;
        let rows = subject.rows(args)?;
        push(&mut table, &name, &rows)?;
        report.charts.extend(charts(&name, &rows).map(Into::into));
        report.checks.extend(subject.checks(&name, FLIP_BARS.get(number), &rows)?);
        report.checks.push(subject.push_filtered((args, engine), &name, &mut filtered)?);
        if number == 0 {
            report.checks.extend(subject.costs(args, &name)?);
        }
    }
    if let Some(folder) = &args.peer {
        let (scene, setup) = peer::scene(folder)?;
        let views = peer::views(args, &setup, folder)?;
        let subject = Subject::of_views(engine, scene, setup, views)?;
        report.checks.extend(subject.costs(args, "peer scene")?);
    }
    report.tables.extend([table, filtered]);
    defaults(args, engine, report)
}

/// Compares the defaults, four samples a pixel from sample images that follow the views, with those before: one, from
/// 400×300.
fn defaults(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let [mean_name, least_name] =
        ["mean", "least"].map(|of| format!("models: foreground PSNR over the defaults before, {of}"));
    let Some(folder) = &args.models else {
        let names = [mean_name, least_name].into_iter().zip(LEAST_GAINS_DB);
        let not_run = |(name, bar)| Check::not_run(name, "dB", Bar::AtLeast(bar), "--models is not given");
        report.checks.extend(names.map(not_run));
        return Ok(());
    };
    let columns = [
        ("model", ""),
        ("foreground PSNR before", "dB"),
        ("foreground PSNR", "dB"),
        ("foreground FLIP before", ""),
        ("foreground FLIP", ""),
    ];
    let mut table = Table::new("Defaults, and those before, against direct views with 64 samples a pixel", &columns);
    let paths = models_of(folder, DEFAULTS_MODELS)?;
    let progress = bar("defaults on models", paths.len());
    let mut gains_db = Vec::with_capacity(paths.len());
    for path in paths {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let subject = Subject::new(args, engine, SceneArgs::new(SceneSpec::File(path)))?;
        let four = Antialias::of(4).context("four samples are offered")?;
        let row =
            |subject: &Subject, antialias| subject.row(Maker::Reconstructed(args.scene.method()), antialias, f64::NAN);
        let (now, before) =
            (row(&subject, four)?, row(&subject.resampled(engine, FIXED_SAMPLES_PX)?, Antialias::NONE)?);
        let cells = [before.foreground_psnr_db, now.foreground_psnr_db, before.foreground_flip, now.foreground_flip];
        table.push([name.into()].into_iter().chain(cells.map(Into::into)))?;
        gains_db.push(now.foreground_psnr_db - before.foreground_psnr_db);
        progress.inc(1);
    }
    progress.finish_and_clear();
    let mean = gains_db.iter().sum::<f64>() / gains_db.len() as f64;
    let least = gains_db.into_iter().fold(f64::INFINITY, f64::min);
    report.tables.push(table);
    let checks = [(mean_name, mean), (least_name, least)].into_iter().zip(LEAST_GAINS_DB);
    report.checks.extend(checks.map(|((name, gain), bar)| Check::new(name, gain, "dB", Bar::AtLeast(bar))));
    Ok(())
}

impl Subject {
    fn new(args: &BenchArgs, engine: &Arc<GpuEngine>, scene: SceneArgs) -> anyhow::Result<Self> {
        let mut setup = scene.load()?;
        let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
        let views = cell.spread(args.compared_views() / 2, VIEW_SIZE_PX * 2);
        // As a session of such views gets them.
        let size_px = fitting_size_px(&setup.offer.rig, &views[0]).context("no size of samples fits")?;
        setup.samples.iter_mut().for_each(|camera| *camera = camera.resized(size_px));
        Self::of_views(engine, scene, setup, views)
    }

    fn of_views(
        engine: &Arc<GpuEngine>,
        scene: SceneArgs,
        setup: Setup,
        views: Vec<PinholeCamera>,
    ) -> anyhow::Result<Self> {
        // The planes of the hybrid mesh are enough for all methods.
        let scene = SceneArgs { method: Some(HYBRID.parse()?), ..scene };
        let reference = ReferenceViews::draw(engine, &setup, &scene, views)?;
        let mut subject = Self { setup, args: scene, reference, truth: Vec::new() };
        subject.truth = subject.drawn_with_64()?;
        Ok(subject)
    }

    /// The same views from sample images of another size.
    fn resampled(&self, engine: &Arc<GpuEngine>, size_px: UVec2) -> anyhow::Result<Self> {
        let Setup { scene, around, samples, offer } = &self.setup;
        let samples = samples.iter().map(|camera| camera.resized(size_px)).collect();
        let setup = Setup { scene: scene.clone(), around: around.clone(), samples, offer: offer.clone() };
        let reference = ReferenceViews::draw(engine, &setup, &self.args, self.reference.cameras.clone())?;
        Ok(Self { setup, args: self.args.clone(), reference, truth: self.truth.clone() })
    }

    /// Means in linear light of four patterns of 16 that interleave.
    fn drawn_with_64(&self) -> anyhow::Result<Vec<View>> {
        let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::ALL };
        let drawn = |offset: &Vec2| {
            let shifted: Vec<_> =
                self.reference.cameras.iter().map(|camera| camera.with_offset(*offset * TRUTH_STEP_PX)).collect();
            self.reference.drawn_from(&self.setup, self.args.lighting, &shifted, planes)
        };
        let sets = TRUTH_OFFSETS_PX.iter().map(drawn).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(mean_of(&sets))
    }

    fn views(&self, maker: Maker, planes: ViewPlanes) -> anyhow::Result<Vec<View>> {
        match maker {
            Maker::Reconstructed(method) => self.reference.reconstruct(method, planes),
            Maker::Direct => {
                self.reference.drawn_from(&self.setup, self.args.lighting, &self.reference.cameras, planes)
            }
        }
    }

    /// The same views from sample images whose colours are means over `antialias` positions around a texel's centre.
    fn filtered(&self, engine: &Arc<GpuEngine>, antialias: Antialias) -> anyhow::Result<Self> {
        let args = SceneArgs { sampling: Some(SamplingMethod::Conventional(antialias)), ..self.args.clone() };
        let Setup { scene, around, samples, offer } = &self.setup;
        let setup =
            Setup { scene: scene.clone(), around: around.clone(), samples: samples.clone(), offer: offer.clone() };
        let reference = ReferenceViews::draw(engine, &setup, &args, self.reference.cameras.clone())?;
        Ok(Self { setup, args, reference, truth: self.truth.clone() })
    }

    /// Adds what means over texels bring to views of four samples a pixel; with a check of four positions over none.
    fn push_filtered(
        &self,
        (args, engine): (&BenchArgs, &Arc<GpuEngine>),
        name: &str,
        table: &mut Table,
    ) -> anyhow::Result<Check> {
        let four = Antialias::of(4).context("four samples are offered")?;
        let subjects = [Antialias::NONE, four, Antialias::MOST].map(|antialias| self.filtered(engine, antialias));
        let subjects = subjects.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
        let numbers: Vec<usize> = (0..subjects.len()).collect();
        let seconds = in_turn(&numbers, args.runs(), |number| {
            sample(engine, &subjects[number].setup, &subjects[number].args).map(drop)
        })?;
        let mut rows = Vec::with_capacity(subjects.len());
        for (subject, seconds) in subjects.iter().zip(seconds) {
            let row = subject.row(Maker::Reconstructed(args.scene.method()), four, f64::NAN)?;
            let ms = seconds * 1e3 / subject.setup.samples.len() as f64;
            let numbers = [ms, row.foreground_psnr_db, row.psnr_db, row.foreground_flip, row.flip];
            let positions = subject.args.sampling().antialias().samples();
            let names = [name.into(), (if positions > 1 { positions } else { 0 }).into()];
            table.push(names.into_iter().chain(numbers.map(Into::into)))?;
            rows.push(row);
        }
        let name = format!("{name}: FLIP, colours of 4 positions around texels' centres over none");
        let check = Check::new(name, rows[1].flip / rows[0].flip, "×", Bar::AtMost(0.97));
        Ok(check.with_foreground(rows[1].foreground_flip / rows[0].foreground_flip))
    }

    fn rows(&self, args: &BenchArgs) -> anyhow::Result<Vec<Row>> {
        let hybrid = Maker::Reconstructed(HYBRID.parse()?);
        let makers = [Maker::Reconstructed(args.scene.method()), hybrid, Maker::Direct];
        let counts = [1, 2, 4, 8, 16].into_iter().filter_map(Antialias::of);
        let works: Vec<(Maker, Antialias)> =
            makers.into_iter().flat_map(|maker| counts.clone().map(move |antialias| (maker, antialias))).collect();
        let progress = bar("samples a pixel", works.len() * (args.runs() + 2));
        let seconds = in_turn(&works, args.runs(), |(maker, antialias)| {
            self.views(maker, ViewPlanes { antialias, ..ViewPlanes::COLOR })?;
            progress.inc(1);
            Ok(())
        })?;
        let rows = works.into_iter().zip(seconds).map(|((maker, antialias), seconds)| {
            progress.inc(1);
            self.row(maker, antialias, seconds)
        });
        let rows = rows.collect();
        progress.finish_and_clear();
        rows
    }

    /// The errors of all views; `seconds` is the time that they took.
    fn row(&self, maker: Maker, antialias: Antialias, seconds: f64) -> anyhow::Result<Row> {
        let views = self.views(maker, ViewPlanes { antialias, ..ViewPlanes::ALL })?;
        Row::of(maker, antialias, seconds * 1e3 / views.len() as f64, &self.truth, &views)
    }

    fn checks(&self, name: &str, flip_bar: Option<&f64>, rows: &[Row]) -> anyhow::Result<Vec<Check>> {
        let Maker::Reconstructed(method) = rows[0].maker else { anyhow::bail!("the first rows are reconstructed") };
        let of = |samples: u32| {
            let found = rows.iter().find(|row| row.maker == rows[0].maker && row.antialias.samples() == samples);
            found.context("a number of samples is missing")
        };
        let (one, four) = (of(1)?, of(4)?);
        let planes = ViewPlanes { antialias: four.antialias, ..ViewPlanes::ALL };
        let whole = self.reference.reconstruct_whole(method, planes)?;
        let whole = Row::of(four.maker, four.antialias, f64::NAN, &self.truth, &whole)?;
        let flip = flip_bar.map(|&bar| {
            Check::new(format!("{name}: FLIP, 4 samples over 1"), four.flip / one.flip, "×", Bar::AtMost(bar))
                .with_foreground(four.foreground_flip / one.foreground_flip)
        });
        let gain_db = four.foreground_psnr_db - one.foreground_psnr_db;
        let least_db = if flip_bar.is_some() { 3.5 } else { 0.0 };
        let away = |flip: f64, whole: f64| (flip / whole - 1.0).abs() * 100.0;
        let [away, foreground_away] = [away(four.flip, whole.flip), away(four.foreground_flip, whole.foreground_flip)];
        Ok(flip
            .into_iter()
            .chain([
                Check::new(format!("{name}: foreground PSNR, 4 samples over 1"), gain_db, "dB", Bar::AtLeast(least_db)),
                Check::new(format!("{name}: FLIP, 4 samples from 4 whole views"), away, "%", Bar::AtMost(3.0))
                    .with_foreground(foreground_away),
            ])
            .collect())
    }

    /// c with four samples a pixel over c with one.
    fn costs(&self, args: &BenchArgs, name: &str) -> anyhow::Result<Vec<Check>> {
        let four = Antialias::of(4).context("four samples are offered")?;
        let check = |size_px: UVec2| {
            let cameras: Vec<_> = self.reference.cameras.iter().map(|camera| camera.resized(size_px)).collect();
            let cameras = cameras.iter().copied().cycle().take(TIMED_VIEWS).collect::<Vec<_>>();
            let seconds = in_turn(&[Antialias::NONE, four], args.runs().max(5), |antialias| {
                let planes = ViewPlanes { antialias, ..ViewPlanes::COLOR };
                self.reference.reconstruct_at(&cameras, args.scene.method(), planes).map(drop)
            })?;
            let name = format!("{name}, {}x{}: c, 4 samples over 1 (aim 2.5)", size_px.x, size_px.y);
            anyhow::Ok(Check::new(name, seconds[1] / seconds[0], "×", Bar::AtMost(3.0)))
        };
        TIMED_SIZES_PX.into_iter().map(check).collect()
    }
}

impl Row {
    fn of(maker: Maker, antialias: Antialias, ms_a_view: f64, truth: &[View], views: &[View]) -> anyhow::Result<Self> {
        let mut sums = [0.0; 4];
        for (truth, view) in truth.iter().zip(views) {
            let [foreground, whole] = PictureErrors::of(truth, &Rgb8Image::of_view(view)?)?;
            let errors = [foreground.psnr_db, whole.psnr_db, foreground.flip, whole.flip];
            sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
        }
        let [foreground_psnr_db, psnr_db, foreground_flip, flip] = sums.map(|sum| sum / views.len() as f64);
        Ok(Self { maker, antialias, ms_a_view, foreground_psnr_db, psnr_db, foreground_flip, flip })
    }
}

impl std::fmt::Display for Maker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Reconstructed(method) => method.fmt(f),
            Self::Direct => f.write_str(cluster::DIRECT),
        }
    }
}

/// Of each view, the mean colour of all sets in linear light, with the other planes of the first.
fn mean_of(sets: &[Vec<View>]) -> Vec<View> {
    let mean = |number: usize, byte: usize| {
        let sum: f32 = sets.iter().map(|set| linear_from_srgb8(set[number].srgb8[byte])).sum();
        srgb8_from_linear(sum / sets.len() as f32)
    };
    let view = |(number, first): (usize, &View)| {
        let srgb8 = (0..first.srgb8.len()).map(|byte| mean(number, byte)).collect();
        View { srgb8, ..first.clone() }
    };
    sets.first().into_iter().flatten().enumerate().map(view).collect()
}

fn push(table: &mut Table, scene: &str, rows: &[Row]) -> anyhow::Result<()> {
    for row in rows {
        let numbers = [row.ms_a_view, row.foreground_psnr_db, row.psnr_db, row.foreground_flip, row.flip];
        let names = [scene.into(), row.maker.to_string().into(), row.antialias.samples().into()];
        table.push(names.into_iter().chain(numbers.map(Into::into)))?;
    }
    Ok(())
}

fn charts(scene: &str, rows: &[Row]) -> [XyChart; 2] {
    let chart = |what: &str, unit: &str, better: Better, value: fn(&Row) -> f64| {
        let axes = (Axis::log("time a view", "ms"), Axis::linear(what, unit));
        let chart = XyChart::new(format!("Samples a pixel: {what}, {scene}"), axes.0, axes.1);
        let mut makers: Vec<Maker> = rows.iter().map(|row| row.maker).collect();
        makers.dedup();
        let series = makers.into_iter().map(|maker| {
            let own = rows.iter().filter(|row| row.maker == maker);
            let point = |row: &Row| Point::labelled(row.ms_a_view, value(row), row.antialias.to_string());
            Series::line(maker.to_string(), own.map(point))
        });
        let mut chart = series.fold(chart, XyChart::with).with_front(Better::Low, better);
        chart.note = "Labels are samples a pixel. Errors are against direct views with 64.".to_owned();
        chart
    };
    [
        chart("foreground PSNR", "dB", Better::High, |row| row.foreground_psnr_db),
        chart("foreground FLIP", "", Better::Low, |row| row.foreground_flip),
    ]
}
