//! The report of a run.

use std::path::Path;

use anyhow::Context as _;
use cluster::PolicyChoice;
use report::Report;

use super::checks::checks;
use super::matrix::{Extent, PAPER_NODES, PAPER_VIEWS};
use super::results::Results;
use super::tables::{costs_table, headline_table, paper_table, points_table, set_costs_table};
use super::{charts, sweep};
use crate::markdown::markdown;
use crate::study::{new_report, table};

/// Makes the report of a run.
pub fn report(results: &Results, extent: Extent, scene: &str, most_simulated: usize) -> anyhow::Result<Report> {
    let mut report = new_report("Myriorama bench: scaling", &results.device);
    report.parameter("scene", scene);
    report.parameter("lighting", results.lighting.to_string());
    report.parameter("sample images S", results.set.images);
    report.parameter("cores", results.cores);
    report.parameter("form", format!("{:?}", extent.form));
    report.parameter("nodes P at most", extent.nodes);
    report.parameter("bytes of a sample image", results.traffic.image_bytes);
    report.parameter("bytes of a frame", results.traffic.frame_bytes);
    report.parameter("bytes a second between processes", results.traffic.bytes_per_s);
    report.parameter("seconds of measuring", results.seconds);
    report.tables.extend([
        paper_table(results)?,
        headline_table(results)?,
        costs_table(results)?,
        points_table(results)?,
    ]);
    report.charts.extend(charts::charts(results));
    let scenarios = sweep::scenarios(results);
    let simulated = sweep::sweep(results, &scenarios, &sweep::VIEWS, most_simulated);
    report.tables.push(sweep::reach_table(&scenarios, &simulated)?);
    report.tables.push(table(sweep::SWEEP_TABLE, &sweep::COLUMNS, &simulated)?);
    report.charts.push(sweep::chart(&scenarios, &simulated));
    if !results.sets.is_empty() {
        let by_set = sweep::sweep(results, &sweep::set_scenarios(results), &sweep::SET_VIEWS, most_simulated);
        report.tables.extend([set_costs_table(results)?, sweep::cheapest_sets(results, &by_set)?]);
    }
    report.summary = summary(results);
    report.checks = checks(results, extent);
    Ok(report)
}

fn summary(results: &Results) -> String {
    let nodes = results.node_counts().into_iter().max().unwrap_or(PAPER_NODES);
    let [pipeline, auto] = [PolicyChoice::Pipeline, PolicyChoice::Auto]
        .map(|policy| results.find(policy, nodes, PAPER_VIEWS).map(|point| results.efficiency(point)));
    let naive = results.naive(nodes).map(|(efficiency, _)| efficiency);
    let [pipeline, auto, naive] = [pipeline, auto, naive]
        .map(|value| value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.3}")));
    format!(
        "Efficiency at P = {nodes}, V = 1000: pipeline {pipeline}, auto {auto}, naive {naive}. The paper's at eleven: \
         0.829 and 0.110."
    )
}

/// Prints all tables but the longest, and writes them to `tables.md` in Markdown.
///
/// # Errors
/// The folder cannot be written.
pub fn show(report: &Report, folder: &Path) -> anyhow::Result<()> {
    let short = report.tables.iter().filter(|table| table.name != sweep::SWEEP_TABLE);
    short.clone().for_each(|table| println!("\n{}", table.to_text()));
    println!("\n{}", report.summary);
    std::fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let path = folder.join("tables.md");
    let text = short.map(markdown).collect::<Vec<_>>().join("\n");
    std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(())
}
