//! Bytes that primary rays read, beside a pass that reads all there is once.

use glam::UVec2;
use gpu::BufferPool;
use render::scalar::rays::{Scene, Visits, pixel_ray};
use report::{Bar, Check, Report, Table};

use super::{
    memory_pass,
    subject::{RUNS, Subject},
};
use crate::statistics::median;

const NODE_BYTES: f64 = 80.0;
const TRIANGLE_BYTES: f64 = 48.0;

const BESIDE_MEMORY: [(&str, &str); 7] = [
    ("node visits a ray", ""),
    ("triangle tests a ray", ""),
    ("a ray reads", "bytes"),
    ("rays read", "GB/s"),
    ("tree and triangles", "MB"),
    ("read once", "GB/s"),
    ("share of it", "%"),
];

/// Adds the table and a check.
pub(super) fn measure(subject: &Subject<'_>, rays_a_second: f64, report: &mut Report) -> anyhow::Result<()> {
    let visits = primary_visits(subject)?;
    let pixels = visits.len() as f64;
    let nodes = visits.iter().map(|visits| f64::from(visits.nodes)).sum::<f64>() / pixels;
    let tests = visits.iter().map(|visits| f64::from(visits.triangles)).sum::<f64>() / pixels;
    let bytes_a_ray = nodes * NODE_BYTES + tests * TRIANGLE_BYTES;
    let by_rays = bytes_a_ray * rays_a_second;
    let (bytes, bytes_a_second) = plain_reading(subject)?;
    let mut table = Table::new("Primary rays beside plain reading of nodes and triangles", &BESIDE_MEMORY);
    let read = [by_rays * 1e-9, bytes * 1e-6, bytes_a_second * 1e-9, by_rays / bytes_a_second * 100.0];
    table.push([nodes, tests, bytes_a_ray].into_iter().chain(read).map(Into::into))?;
    report.tables.push(table);
    let least = visits.iter().map(|visits| visits.nodes).min().map_or(f64::NAN, f64::from);
    report.checks.push(Check::new("node visits of a primary ray, the least", least, "", Bar::AtLeast(1.0)));
    Ok(())
}

/// What the primary ray of each pixel visits, by the scalar twin: the device's rays go the same way.
fn primary_visits(subject: &Subject<'_>) -> anyhow::Result<Vec<Visits>> {
    let twin = Scene::of(subject.scene, 0.0)?;
    let camera = subject.camera()?;
    let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
    Ok(pixels.map(|pixel| twin.closest(&pixel_ray(camera, pixel), camera.near_m).1).collect())
}

/// Bytes of tree and triangles, and bytes read a second.
fn plain_reading(subject: &Subject<'_>) -> anyhow::Result<(f64, f64)> {
    let gpu = subject.engine.renderer.gpu();
    let (pool, tree) = (BufferPool::new(gpu), subject.scene.tree(0.0)?);
    let pass = |_| memory_pass::read(gpu, &pool, &tree.each_ref());
    let passes = (0..RUNS).map(pass).collect::<anyhow::Result<Vec<_>>>()?;
    let bytes = passes.first().map_or(f64::NAN, |pass| pass.bytes as f64);
    Ok((bytes, bytes / median(passes.iter().map(|pass| pass.device_s).collect())))
}
