//! Sampling without redundancy: its cost, and the coverage of quads cut from its images.

use gpu::Turn;
use std::sync::Arc;

use app_core::progress::bar;
use depth_image::{DepthImage, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use reconstruction::{MeshStatistics, ReconstructRequest, SampleSet, SetDescription};
use render::SamplePlanes;
use report::{Bar, Check, Report, Table};
use sampling::SamplingMethod;

use super::args::BenchArgs;
use crate::sampling_study::{Extent, SCENES, Subject, times, times_report};

const SIZE_PX: UVec2 = UVec2::new(400, 300);
/// The scene on which merging is checked, with finer images as well: they have more quads within a surface.
const FLAT: &str = "urban";
const FINE_PX: UVec2 = UVec2::splat(1024);

/// Adds tables and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let extent = Extent::of(args.quick);
    let progress = bar("sampling without redundance", SCENES.len());
    let mut costs = Vec::with_capacity(SCENES.len());
    let mut table = Table::new("Quads cut from conventional images", &COLUMNS);
    let mut merged = Table::new("Quads merged within half a pixel", &MERGED_COLUMNS);
    for scene in SCENES {
        let subject = Subject::load(engine, scene)?;
        costs.push((scene.to_owned(), times(&subject, extent)?));
        cover(&subject, engine, &mut table, report)?;
        merge(&subject, engine, SIZE_PX, &mut merged, report)?;
        if scene == FLAT {
            merge(&subject, engine, FINE_PX, &mut merged, report)?;
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.extend([table, merged]);
    times_report(&costs, extent, report)
}

const COLUMNS: [(&str, &str); 4] =
    [("scene", ""), ("samples", ""), ("lost by mesh", ""), ("of these covered by hybrid_mesh", "%")];

const MERGED_COLUMNS: [(&str, &str); 8] = [
    ("scene", ""),
    ("images", "px"),
    ("quads of hybrid_mesh", ""),
    ("of hybrid_mesh:0.5", ""),
    ("share left", ""),
    ("greatest error", "px"),
    ("cut", "ms"),
    ("cut and merged", "ms"),
];

/// Counts the samples that are lost or covered, seen from where they were taken.
fn cover(subject: &Subject, engine: &GpuEngine, table: &mut Table, report: &mut Report) -> anyhow::Result<()> {
    let images = conventional(subject, SIZE_PX)?;
    let (mut samples, mut lost, mut covered) = (0, 0, 0);
    for image in &images {
        let set = upload(subject, engine, std::slice::from_ref(image))?;
        let camera = image.camera.reference();
        let [mesh, hybrid] = ["mesh", "hybrid_mesh"].map(|method| view(engine, &set, camera, method));
        let (mesh, hybrid) = (hits(&mesh?), hits(&hybrid?));
        for ((&depth, mesh), hybrid) in image.inverse_depth_per_m.iter().zip(mesh).zip(hybrid) {
            samples += usize::from(depth > 0.0);
            lost += usize::from(depth > 0.0 && !mesh);
            covered += usize::from(depth > 0.0 && !mesh && hybrid);
        }
    }
    let share = covered as f64 / lost as f64;
    table.push([subject.name.clone().into(), samples.into(), lost.into(), (100.0 * share).into()])?;
    let name = format!("{}: of the samples that mesh loses, covered by hybrid_mesh", subject.name);
    report.checks.push(Check::new(name, share, "", Bar::AtLeast(0.95)));
    Ok(())
}

/// Measures the quads that merging leaves.
fn merge(
    subject: &Subject,
    engine: &GpuEngine,
    size_px: UVec2,
    table: &mut Table,
    report: &mut Report,
) -> anyhow::Result<()> {
    let set = upload(subject, engine, &conventional(subject, size_px)?)?;
    let cut = |method: &str| -> anyhow::Result<MeshStatistics> {
        Ok(engine.reconstructor.mesh_statistics(&set, method.parse()?)?.unwrap_or_default())
    };
    let (cut, merged) = (cut("hybrid_mesh")?, cut("hybrid_mesh:0.5")?);
    let share = merged.quads as f64 / merged.quads_before as f64;
    let error_px = f64::from(merged.greatest_error_px);
    table.push([
        subject.name.clone().into(),
        format!("{} × {}", size_px.x, size_px.y).into(),
        (cut.quads as usize).into(),
        (merged.quads as usize).into(),
        share.into(),
        error_px.into(),
        (cut.device_s * 1e3).into(),
        (merged.device_s * 1e3).into(),
    ])?;
    if subject.name == FLAT {
        let name = |what: &str| format!("{FLAT}, images of {} × {}: {what} of hybrid_mesh:0.5", size_px.x, size_px.y);
        report.checks.push(Check::new(name("share of quads left"), share, "×", Bar::AtMost(0.25)));
        report.checks.push(Check::new(name("greatest error"), error_px, "px", Bar::AtMost(0.5)));
    }
    Ok(())
}

fn conventional(subject: &Subject, size_px: UVec2) -> anyhow::Result<Vec<DepthImage>> {
    let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
    subject.sample(SamplingMethod::CONVENTIONAL, size_px, planes)
}

fn upload(subject: &Subject, engine: &GpuEngine, images: &[DepthImage]) -> anyhow::Result<SampleSet> {
    let offer = &subject.setup.offer;
    let description = SetDescription {
        volume: offer.volume,
        background: offer.background,
        illumination: &offer.illumination,
        highlight: None,
        environment: None,
        mips: false,
    };
    Ok(engine.reconstructor.upload(images, &description, Turn::default())?)
}

fn view(engine: &GpuEngine, set: &SampleSet, camera: &PinholeCamera, method: &str) -> anyhow::Result<View> {
    let planes = ViewPlanes::WITH_PROVENANCE;
    let views = engine.reconstructor.reconstruct(ReconstructRequest {
        planes,
        ..ReconstructRequest::new(set, std::slice::from_ref(camera), method.parse()?)
    })?;
    views.into_iter().next().ok_or_else(|| anyhow::anyhow!("no view came"))
}

fn hits(view: &View) -> Vec<bool> {
    view.provenance.iter().flatten().map(|provenance| provenance.kind() == ProvenanceKind::Hit).collect()
}
