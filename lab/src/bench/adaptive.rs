//! Rays only where light changes: the time saved, and the effect on the picture.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use metrics::PictureErrors;
use render::{DrawWork, GpuScene, Lighting, Rate, Refinement, Visibility};
use report::{Axis, Bar, Check, Point, Report, Series, Table, XyChart};

use super::args::BenchArgs;
use super::timing::in_turn;
use crate::evaluation::mean_errors;
use crate::lighting_study::FINE;

/// The lighting whose picture counts as converged.
const CONVERGED: &str = "soft 256, occlusion 256";
/// A scene of large smooth surfaces, beside the scene of the bench.
const SMOOTH: &str = "courtyard";
/// Tolerances beside the default.
const TOLERANCES: [f32; 5] = [0.02, 0.05, 0.1, 0.2, 0.3];
/// The most error of the default tolerance, over that of full rate.
const ALLOWED: f64 = 1.1;

/// Results of one rate on one scene.
struct Row {
    rate: Rate,
    seconds: f64,
    /// Over the foreground, then over the whole picture.
    to_full: [PictureErrors; 2],
    to_converged: [PictureErrors; 2],
}

const COLUMNS: [(&str, &str); 12] = [
    ("scene", ""),
    ("rate", ""),
    ("time a view", "ms"),
    ("over full rate", "×"),
    ("foreground FLIP to full rate", ""),
    ("foreground PSNR to full rate", "dB"),
    ("foreground FLIP to converged", ""),
    ("its share of full rate's", "×"),
    ("FLIP to full rate", ""),
    ("PSNR to full rate", "dB"),
    ("FLIP to converged", ""),
    ("over full rate's", "×"),
];

/// Adds a table, charts and checks.
pub fn compare(args: &BenchArgs, engine: &Arc<GpuEngine>, setup: &Setup, report: &mut Report) -> anyhow::Result<()> {
    let spec = fixtures::spec(SMOOTH)?;
    let smooth = SceneArgs { sample_size: args.scene.sample_size, ..SceneArgs::new(spec) }.load()?;
    engine.put_scene(smooth.offer.hash.as_str(), &smooth.scene)?;
    let mut table = Table::new(format!("Adaptive rate, {FINE}"), &COLUMNS);
    let own = args.scene.scene.to_string();
    let also = (own != SMOOTH).then(|| (SMOOTH.to_owned(), &smooth));
    for (name, setup) in [(own, setup)].into_iter().chain(also) {
        let rows = rows(args, engine, setup)?;
        push(&mut table, &name, &rows)?;
        report.charts.push(chart(&name, &rows).into());
        report.checks.extend(checks(&name, &rows)?);
    }
    report.tables.push(table);
    Ok(())
}

/// The full rate first, then adaptive rates from the strictest on.
fn rates() -> anyhow::Result<Vec<Rate>> {
    let Rate::Adaptive { tolerance: default } = default_rate()? else { anyhow::bail!("the default is not adaptive") };
    let mut tolerances: Vec<f32> = TOLERANCES.into_iter().filter(|&t| t != default).chain([default]).collect();
    tolerances.sort_by(f32::total_cmp);
    Ok([Rate::Full].into_iter().chain(tolerances.into_iter().map(|tolerance| Rate::Adaptive { tolerance })).collect())
}

fn default_rate() -> anyhow::Result<Rate> {
    Ok(format!("{FINE}, adaptive").parse::<Lighting>()?.rate)
}

fn rows(args: &BenchArgs, engine: &GpuEngine, setup: &Setup) -> anyhow::Result<Vec<Row>> {
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let camera = setup.samples.first().context("no sample cameras")?;
    let fine: Lighting = FINE.parse()?;
    let rates = rates()?;
    let progress = bar("adaptive rate", rates.len() * (1 + args.runs()) + 1);
    let draw = |lighting: Lighting| {
        let view = view(engine, &scene, camera, lighting);
        progress.inc(1);
        view
    };
    let mut views: Vec<Option<View>> = vec![None; rates.len()];
    let places: Vec<usize> = (0..rates.len()).collect();
    let seconds = in_turn(&places, args.runs(), |place| {
        views[place] = Some(draw(Lighting { rate: rates[place], ..fine })?);
        Ok(())
    })?;
    let converged = draw(CONVERGED.parse()?)?;
    progress.finish_and_clear();
    let views: Vec<View> = views.into_iter().flatten().collect();
    let full = views.first().context("no view")?;
    rates
        .into_iter()
        .zip(seconds)
        .zip(&views)
        .map(|((rate, seconds), view)| Row::of(rate, seconds, view, full, &converged))
        .collect()
}

fn view(engine: &GpuEngine, scene: &GpuScene, camera: &PinholeCamera, lighting: Lighting) -> anyhow::Result<View> {
    let refinement = Refinement::default();
    let work = DrawWork {
        scene,
        lighting,
        scene_time_s: 0.0,
        visibility: Visibility::Measured,
        refinement,
        turn: Default::default(),
    };
    let views = engine.renderer.draw_views(work, &[*camera], ViewPlanes::WITH_DEPTH)?;
    views.into_iter().next().context("no view")
}

impl Row {
    fn of(rate: Rate, seconds: f64, view: &View, full: &View, converged: &View) -> anyhow::Result<Self> {
        let errors = |reference: &View| mean_errors(std::slice::from_ref(reference), std::slice::from_ref(view));
        Ok(Self { rate, seconds, to_full: errors(full)?, to_converged: errors(converged)? })
    }

    fn name(&self) -> String {
        match self.rate {
            Rate::Full => "full".to_owned(),
            Rate::Adaptive { tolerance } => format!("adaptive {tolerance}"),
        }
    }
}

fn push(table: &mut Table, scene: &str, rows: &[Row]) -> anyhow::Result<()> {
    let Some(full) = rows.first() else { return Ok(()) };
    for row in rows {
        let times = [row.seconds * 1e3, row.seconds / full.seconds];
        let errors = |part: usize| {
            let (to_full, to_converged) = (row.to_full[part], row.to_converged[part].flip);
            [to_full.flip, to_full.psnr_db, to_converged, to_converged / full.to_converged[part].flip]
        };
        let numbers = times.into_iter().chain(errors(0)).chain(errors(1));
        table.push([scene.into(), row.name().into()].into_iter().chain(numbers.map(Into::into)))?;
    }
    Ok(())
}

fn chart(scene: &str, rows: &[Row]) -> XyChart {
    let point = |row: &Row| Point::labelled(row.seconds * 1e3, row.to_converged[0].flip, row.name());
    let (full, adaptive): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| row.rate == Rate::Full);
    let (x, y) = (Axis::linear("time a view", "ms"), Axis::linear("foreground FLIP to converged", ""));
    let mut chart = XyChart::new(format!("Adaptive rate, {scene}"), x, y)
        .with(Series::points("full rate", full.into_iter().map(point)))
        .with(Series::line("adaptive", adaptive.into_iter().map(point)));
    chart.note = format!("{FINE}; labels are tolerances. Converged: {CONVERGED}.");
    chart
}

fn checks(scene: &str, rows: &[Row]) -> anyhow::Result<[Check; 2]> {
    let default = default_rate()?;
    let find = |rate: Rate| rows.iter().find(|row| row.rate == rate).context("a rate is missing");
    let (full, adaptive) = (find(Rate::Full)?, find(default)?);
    let [foreground, error] = [0, 1].map(|part| adaptive.to_converged[part].flip / full.to_converged[part].flip);
    let time = adaptive.seconds / full.seconds;
    Ok([
        Check::new(
            format!("{scene}: FLIP to converged light, adaptive over full rate"),
            error,
            "×",
            Bar::AtMost(ALLOWED),
        )
        .with_foreground(foreground),
        Check::new(format!("{scene}: time, adaptive over full rate"), time, "×", Bar::AtMost(1.0)),
    ])
}
