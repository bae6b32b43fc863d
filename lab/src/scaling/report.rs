//! The report of a run.

use std::path::Path;

use anyhow::Context as _;
use report::{Report, Table};

use super::checks::checks;
use super::matrix::{Extent, FEW_NODES, PAPER_NODES, PAPER_VIEWS};
use super::measured::{Measured, MeasuredLighting};
use super::prediction::{Traffic, predict};
use super::results::Results;
use super::sweep::{Basis, scenarios, sweep};
use super::tables::{costs_table, headline_table, paper_table, points_table, shares_table, steps_table};
use super::{charts, costs, sweep_report, whole_images};

/// Makes the report of a run.
pub fn report(measured: &Measured, extent: Extent, scene: &str, most_simulated: usize) -> anyhow::Result<Report> {
    let all: Vec<Results<'_>> = measured.lit.iter().map(|lit| results_of(measured, lit)).collect();
    let main = all.first().context("nothing was measured")?;
    let mut report = new_report(measured, extent, scene);
    report.tables.extend([paper_table(main)?, headline_table(measured, main)?, costs_table(measured, &all)?]);
    for results in &all {
        report.tables.push(points_table(results)?);
    }
    for results in all.iter().skip(1) {
        report.tables.push(whole_images::table(results)?);
    }
    let few = main.node_counts().into_iter().filter(|&nodes| nodes <= FEW_NODES).max().unwrap_or(0);
    report.tables.extend([shares_table(main)?, steps_table(main, few)?]);
    report.charts.extend(charts::charts(main));
    simulate(measured, main, most_simulated, &mut report)?;
    report.summary = summary(main);
    report.checks = checks(measured, &all, extent);
    Ok(report)
}

fn results_of<'a>(measured: &Measured, lit: &'a MeasuredLighting) -> Results<'a> {
    let predictions = lit.points.iter().map(|point| predict(lit, measured.images, point)).collect();
    Results { lit, predictions, images: measured.images }
}

fn new_report(measured: &Measured, extent: Extent, scene: &str) -> Report {
    let mut report = Report::new("Myriorama bench: scaling", measured.device.clone());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", scene);
    report.parameter("sample images S", measured.images);
    report.parameter("cores", measured.cores);
    report.parameter("quota of a node (cores)", measured.quota_cores);
    report.parameter("quick", extent.quick);
    report.parameter("nodes P at most", extent.nodes);
    if let Some(lit) = measured.lit.first() {
        let traffic = Traffic::of(&lit.points);
        report.parameter("bytes of a sample image", traffic.image_bytes);
        report.parameter("bytes of a frame", traffic.frame_bytes);
        report.parameter("bytes a second between processes", traffic.bytes_per_s);
    }
    report.parameter("seconds of measuring", measured.seconds);
    report
}

fn simulate(measured: &Measured, main: &Results<'_>, most_nodes: usize, report: &mut Report) -> anyhow::Result<()> {
    let plain = costs::mean(&measured.unlimited);
    // Expensive lighting was timed with a quota alone; without it, the speed-up is that of the paper's lighting.
    let nodes = main.node_counts().into_iter().max().unwrap_or(PAPER_NODES);
    let speed = main.lit.mean(nodes).sample_image_s / plain.sample_image_s;
    let expensive = measured.lit.get(1).map(|lit| lit.mean(nodes));
    let unlimited = |costs: cluster::Costs| simulation::Machine::of(costs).faster(speed).costs;
    let traffic = Traffic::of(&main.lit.points);
    let basis = Basis { plain, expensive: expensive.map(unlimited), images: measured.images, traffic };
    let scenarios = scenarios(&basis);
    let points = sweep(&basis, &scenarios, most_nodes);
    report.tables.push(sweep_report::reach_table(&scenarios, &points)?);
    report.tables.push(sweep_report::decisions_table(&basis, PAPER_VIEWS)?);
    report.tables.push(sweep_report::sweep_table(&scenarios, &points)?);
    report.charts.extend(sweep_report::charts(&scenarios, &points));
    report.parameter("simulated", sweep_report::summary(&scenarios, &points));
    Ok(())
}

fn summary(main: &Results<'_>) -> String {
    let nodes = main.node_counts().into_iter().max().unwrap_or(PAPER_NODES);
    let of = |policy| main.find(policy, nodes, PAPER_VIEWS).map(|point| main.efficiency(point));
    let text = |value: Option<f64>| value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.3}"));
    format!(
        "Efficiency at P = {nodes}, V = 1000: pipeline {}, auto {}, naive {}. The paper's at eleven: 0.829 and 0.110.",
        text(of(cluster::PolicyChoice::Pipeline)),
        text(of(cluster::PolicyChoice::Auto)),
        text(main.naive(nodes).map(|(efficiency, _)| efficiency)),
    )
}

/// Prints all tables but the longest, and writes them to `tables.md` in Markdown.
///
/// # Errors
/// The folder cannot be written.
pub fn show(report: &Report, folder: &Path) -> anyhow::Result<()> {
    let short = || report.tables.iter().filter(|table| table.name != sweep_report::SWEEP_TABLE);
    short().for_each(|table| println!("\n{}", table.to_text()));
    println!("\n{}", report.summary);
    std::fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let path = folder.join("tables.md");
    let text = short().map(Table::to_markdown).collect::<Vec<_>>().join("\n");
    std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(())
}
