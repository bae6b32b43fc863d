//! Rays: their speed by kind, the memory that they read, the tree, and the choice between rays and triangles.

mod choices;
mod memory;
mod memory_pass;
mod speeds;
mod subject;

use std::sync::Arc;

use app_core::setup::Setup;
use engine::GpuEngine;
use report::{Report, Table};

use self::subject::Subject;
use super::args::BenchArgs;

/// Adds tables and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, setup: &Setup, report: &mut Report) -> anyhow::Result<()> {
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let cameras = &setup.samples[..setup.samples.len().min(if args.quick { 1 } else { 4 })];
    let subject = Subject { engine, scene: &scene, cameras };
    report.tables.push(tree(&subject)?);
    let primary_a_second = speeds::measure(&subject, &setup.scene.illumination.lights, report)?;
    memory::measure(&subject, primary_a_second, report)?;
    choices::measure(&subject, setup.offer.hash.as_str(), report)
}

const TREE: [(&str, &str); 6] = [
    ("triangles", ""),
    ("built in", "s"),
    ("uploaded in", "s"),
    ("nodes", ""),
    ("levels", ""),
    ("expected visits and tests of a random ray", ""),
];

fn tree(subject: &Subject<'_>) -> anyhow::Result<Table> {
    let mut table = Table::new("Tree over the triangles", &TREE);
    let built = subject.scene.acceleration(0.0)?;
    let (build_s, upload_s) = (built.build_s.into(), built.upload_s.into());
    table.push([
        built.triangles.into(),
        build_s,
        upload_s,
        built.nodes.into(),
        built.depth.into(),
        built.cost.into(),
    ])?;
    Ok(table)
}
