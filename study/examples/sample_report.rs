//! Writes a report of made-up numbers with every kind of part, to see how reports look.
//!
//! `cargo run --release -p study --example sample_report -- FOLDER`

use std::path::Path;

use image::RgbImage;
use metrics::{Rgb8Image, flip_map};
use study::{
    Axis, Bar, BarChart, Better, Check, Point, Provenance, Report, ReportError, Series, Table, XyChart, comparison_row,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give a folder")?;
    let mut report = Report::new("Sample report: numbers made up", "no device");
    report.summary = "Every kind of part, with names that need escaping: <b>a & b</b>.".into();
    report.version("study", env!("CARGO_PKG_VERSION"));
    report.parameter("views", 100_u32);
    report.parameter("scene", "hall of <columns>");
    report.parameter("budget, FLIP", 0.05);
    add_checks(&mut report);
    add_table(&mut report)?;
    report.charts = vec![efficiency().into(), cost().into(), quality().into(), stages().into(), narrow().into()];
    add_pictures(&mut report)?;
    let ok = report.finish(Path::new(&folder))?;
    println!("exit_ok: {ok}");
    Ok(())
}

fn add_checks(report: &mut Report) {
    report.checks = vec![
        Check::new("efficiency at P = 8", 0.93, "", Bar::AtLeast(0.9)),
        Check::new("disocclusion rate", 0.8, "%", Bar::AtMost(0.5)),
        Check::new("frames that mix sample sets", 0.0, "", Bar::Equal(0.0)),
        Check::not_run("speed-up over direct, GPU", "×", Bar::AtLeast(10.0), "no GPU on this machine"),
    ];
}

fn add_table(report: &mut Report) -> Result<(), ReportError> {
    let mut table = Table::new("K_fd against brute force", &[("policy", ""), ("K", ""), ("time", "ms"), ("best", "")]);
    table.push(["floor(K*)".into(), 3_u32.into(), 41.237.into(), true.into()])?;
    table.push(["ceil(K*) <printed>".into(), 4_u32.into(), 47.9.into(), false.into()])?;
    table.push(["time-sharing".into(), None::<u32>.into(), 39.8.into(), true.into()])?;
    report.tables.push(table);
    Ok(())
}

fn efficiency() -> XyChart {
    let measured = |loss: f64| (1..=8).map(move |p| (f64::from(p), 1.0 - loss * f64::from(p - 1)));
    let foretold = |loss: f64| [12, 16, 24].map(move |p| (f64::from(p), 1.0 - loss * f64::from(p - 1) * 0.9));
    XyChart::new("Efficiency", Axis::linear("nodes P", ""), Axis::linear("efficiency", ""))
        .with(Series::line("pipeline", measured(0.009)).then_extrapolated(foretold(0.009)))
        .with(Series::line("naive", measured(0.03)).then_extrapolated(foretold(0.03)))
        .with(Series::line("time-sharing", measured(0.006)))
        .with_limit("promised: 0.9", 0.9)
}

fn cost() -> XyChart {
    let views = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];
    let line = |fixed: f64, each: f64| views.map(|v| (v, fixed + each * v));
    XyChart::new("Time per frame over views", Axis::log("views V", ""), Axis::log("time per frame", "ms"))
        .with(Series::line("direct", line(0.0, 22.0)))
        .with(Series::line("lockstep, 256 steps", line(90.0, 6.1)))
        .with(Series::line("joint carve", line(90.0, 1.9)))
        .with(Series::line("layered depth images", line(160.0, 1.1)))
        .with(Series::line("min-max pyramid, one camera", line(25.0, 1.5)))
        .with(Series::line("graph camera", line(60.0, 4.2)))
}

fn quality() -> XyChart {
    let points = |c: f64, error: f64| {
        [1, 2, 4, 8].map(|s| Point::labelled(c * f64::from(s).powf(0.4), error / f64::from(s), format!("S = {s}")))
    };
    XyChart::new("Speed against accuracy", Axis::log("one view c", "ms"), Axis::log("FLIP, mean", ""))
        .with(Series::points("joint carve", points(1.9, 0.11)))
        .with(Series::points("lockstep, 256 steps", points(6.1, 0.14)))
        .with(Series::points("layered depth images", points(1.1, 0.3)))
        .with(Series::points("direct", [(22.0, 0.002)]))
        .with_limit("budget", 0.05)
        .with_front(Better::Low, Better::Low)
}

fn stages() -> BarChart {
    BarChart::new(
        "Time per stage",
        Axis::linear("time per frame", "ms"),
        ["direct", "lockstep, 256 steps", "joint carve", "layered depth images of a scene with a long name"],
    )
    .with("render", [220.0, 0.0, 0.0, 0.0])
    .with("decode", [0.0, 9.0, 9.0, 14.0])
    .with("build pyramids", [0.0, 0.0, 6.5, 2.0])
    .with("reconstruct", [0.0, 121.0, 38.0, 21.0])
    .with("encode and send", [24.0, 24.0, 24.0, 24.0])
}

fn narrow() -> XyChart {
    let line = (0..=20).map(|i| (f64::from(i) * 0.05, 33.1 + 0.4 * (f64::from(i) * 0.9).sin()));
    XyChart::new("PSNR over time", Axis::linear("time", "s"), Axis::linear("PSNR", "dB"))
        .with(Series::line("joint carve", line))
}

fn add_pictures(report: &mut Report) -> Result<(), Box<dyn std::error::Error>> {
    let shaded =
        |x: u32, y: u32| [(x * 2) as u8, (y * 2) as u8, if (x / 16 + y / 16).is_multiple_of(2) { 190 } else { 60 }];
    let direct = RgbImage::from_fn(120, 90, |x, y| image::Rgb(shaded(x, y)));
    let reconstructed = RgbImage::from_fn(120, 90, |x, y| image::Rgb(shaded(if x > 70 { x + 2 } else { x }, y)));
    let view = |image: &RgbImage| Rgb8Image::new(120, 90, image.as_raw().clone());
    let flip = flip_map(&view(&direct)?, &view(&reconstructed)?)?;
    let provenance: Vec<Provenance> = (0..120 * 90)
        .map(|i| match (i % 120, i / 120) {
            (x, _) if x < 50 => Provenance::Sample(0),
            (x, y) if x < 70 && y > 20 => Provenance::Blend,
            (x, _) if x < 74 => Provenance::Fill,
            _ => Provenance::Sample(1),
        })
        .collect();
    report.pictures.push(comparison_row("Made-up view", direct, reconstructed, &flip, Some(&provenance)));
    Ok(())
}
