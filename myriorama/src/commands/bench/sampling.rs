//! Sampling without redundance: what it costs, and what quads cut from its images cover.

use std::sync::Arc;

use depth_image::{Camera, DepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::UVec2;
use reconstruction::{ReconstructionMethod, SampleSet, SetDescription};
use render::SamplePlanes;
use sampling::SamplingMethod;
use study::{Bar, Check, Report, Table};

use super::BenchArgs;
use crate::engine::GpuEngine;
use crate::progress::bar;
use crate::sampling_study::{Extent, SCENES, Subject, times, times_report};

const SIZE_PX: UVec2 = UVec2::new(400, 300);
/// On which merging is promised.
const FLAT: &str = "urban";

/// Adds tables and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let extent = Extent::of(args.quick);
    let progress = bar("sampling without redundance", SCENES.len());
    let mut costs = Vec::with_capacity(SCENES.len());
    let mut table = Table::new("Quads cut from conventional images", &COLUMNS);
    for scene in SCENES {
        let subject = Subject::load(engine, scene)?;
        costs.push((scene.to_owned(), times(&subject, extent)?));
        cover(&subject, engine, &mut table, report)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.push(table);
    times_report(&costs, extent, report)
}

const COLUMNS: [(&str, &str); 7] = [
    ("scene", ""),
    ("samples", ""),
    ("lost by mesh", ""),
    ("of these covered by hybrid_mesh", "%"),
    ("quads", ""),
    ("quads of hybrid_mesh:0.5", ""),
    ("greatest error", "px"),
];

/// Seen from where it was taken, each sample is lost or covered.
fn cover(subject: &Subject, engine: &GpuEngine, table: &mut Table, report: &mut Report) -> anyhow::Result<()> {
    let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
    let images = subject.sample(SamplingMethod::Conventional, SIZE_PX, planes)?;
    let (mut samples, mut lost, mut covered) = (0, 0, 0);
    for image in &images {
        let set = upload(subject, engine, std::slice::from_ref(image))?;
        let Camera::Pinhole(camera) = &image.camera;
        let [mesh, hybrid] = ["mesh", "hybrid_mesh"].map(|method| view(engine, &set, camera, method));
        let (mesh, hybrid) = (hits(&mesh?), hits(&hybrid?));
        for ((&depth, mesh), hybrid) in image.inverse_depth_per_m.iter().zip(mesh).zip(hybrid) {
            samples += usize::from(depth > 0.0);
            lost += usize::from(depth > 0.0 && !mesh);
            covered += usize::from(depth > 0.0 && !mesh && hybrid);
        }
    }
    let merged: ReconstructionMethod = "hybrid_mesh:0.5".parse()?;
    let set = upload(subject, engine, &images)?;
    let quads = engine.reconstructor().mesh_statistics(&set, merged)?.unwrap_or_default();
    let share = covered as f64 / lost as f64;
    table.push([
        subject.name.clone().into(),
        samples.into(),
        lost.into(),
        (100.0 * share).into(),
        (quads.quads_before as usize).into(),
        (quads.quads as usize).into(),
        f64::from(quads.greatest_error_px).into(),
    ])?;
    let name = format!("{}: of the samples that mesh loses, covered by hybrid_mesh", subject.name);
    report.checks.push(Check::new(name, share, "", Bar::AtLeast(0.95)));
    if subject.name == FLAT {
        let ratio = quads.quads as f64 / quads.quads_before as f64;
        let name = format!("{FLAT}: quads of {merged} over those of hybrid_mesh");
        report.checks.push(Check::new(name, ratio, "×", Bar::AtMost(0.25)));
        let name = format!("{FLAT}: greatest error of {merged}");
        report.checks.push(Check::new(name, f64::from(quads.greatest_error_px), "px", Bar::AtMost(0.5)));
    }
    Ok(())
}

fn upload(subject: &Subject, engine: &GpuEngine, images: &[DepthImage]) -> anyhow::Result<SampleSet> {
    let offer = &subject.setup.offer;
    let description = SetDescription {
        volume: offer.volume,
        background_linear: offer.background_linear,
        illumination: &offer.illumination,
        highlight: None,
    };
    Ok(engine.reconstructor().upload(images, &description)?)
}

fn view(engine: &GpuEngine, set: &SampleSet, camera: &PinholeCamera, method: &str) -> anyhow::Result<View> {
    let planes = ViewPlanes { inverse_depth: false, provenance: true };
    let views = engine.reconstructor().reconstruct(set, std::slice::from_ref(camera), method.parse()?, planes)?;
    views.into_iter().next().ok_or_else(|| anyhow::anyhow!("no view came"))
}

fn hits(view: &View) -> Vec<bool> {
    view.provenance.iter().flatten().map(|provenance| provenance.kind() == ProvenanceKind::Hit).collect()
}
