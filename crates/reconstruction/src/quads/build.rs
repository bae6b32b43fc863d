//! Cuts a set's images, and reads back what came of it.

use std::sync::Arc;

use depth_image::PinholeCamera;
use glam::{UVec2, Vec2, Vec3};
use gpu::{Frame, Readback, Turn};

use super::cut::ImageCut;
use super::list;
use super::mesh::{Cut, INDICES_A_QUAD, MAX_MESHES, Mesh, MeshStatistics, Quad, QuadVertices};
use crate::{device::Device, error::ReconstructionError, sample_set::SampleSet};

/// The set's mesh of a cut, made when it is first asked for; `record` records the passes that cut one image.
pub(crate) fn mesh(
    device: &Device,
    set: &SampleSet,
    cut: Cut,
    turn: Turn,
    record: impl Fn(&mut Frame<'_>, &ImageCut<'_>) -> Result<(), ReconstructionError>,
) -> Result<Arc<Mesh>, ReconstructionError> {
    if let Some(mesh) = kept(&set.meshes.meshes.lock(), cut) {
        return Ok(mesh);
    }
    // Not under the lock: a live view would wait for the turn of a batch.
    let mesh = Arc::new(build(device, set, cut, turn, record)?);
    let mut meshes = set.meshes.meshes.lock();
    if let Some(mesh) = kept(&meshes, cut) {
        return Ok(mesh);
    }
    if meshes.len() >= MAX_MESHES {
        meshes.remove(0);
    }
    meshes.push(mesh.clone());
    Ok(mesh)
}

fn kept(meshes: &[Arc<Mesh>], cut: Cut) -> Option<Arc<Mesh>> {
    meshes.iter().find(|mesh| mesh.cut == cut).cloned()
}

/// Quads are listed in the order of their samples, so that the same set gives the same list.
fn build(
    device: &Device,
    set: &SampleSet,
    cut: Cut,
    turn: Turn,
    record: impl Fn(&mut Frame<'_>, &ImageCut<'_>) -> Result<(), ReconstructionError>,
) -> Result<Mesh, ReconstructionError> {
    let mut frame = Frame::begin(&device.gpu, "cut meshes", turn);
    let mut images = Vec::new();
    let mut reads = Vec::new();
    for number in 0..set.cameras.len() {
        let image = ImageCut::new(device, set, number, cut)?;
        record(&mut frame, &image)?;
        list::record(&mut frame, &image, cut.vertices)?;
        reads.push([&image.quads.draw, &image.report].map(|buffer| read_back(device, &mut frame, buffer)));
        images.push(image.quads);
    }
    let done = frame.submit()?.wait()?;
    let mut statistics = MeshStatistics { device_s: done.device_s, ..MeshStatistics::default() };
    for [draw, report] in reads {
        let [error_bits, before] = done.with(report, |words: &[u32]| [words[0], words[1]])?;
        statistics.quads_before += u64::from(before);
        statistics.greatest_error_px = statistics.greatest_error_px.max(f32::from_bits(error_bits));
        statistics.quads += done.with(draw, |words: &[u32]| u64::from(words[0] / INDICES_A_QUAD))?;
    }
    Ok(Mesh { cut, images, statistics })
}

/// The quads of a mesh, image after image.
pub(crate) fn read(device: &Device, mesh: &Mesh, set: &SampleSet) -> Result<Vec<Quad>, ReconstructionError> {
    let mut quads = Vec::new();
    for number in 0..mesh.images.len() {
        quads.extend(read_image(device, mesh, set, number)?);
    }
    Ok(quads)
}

fn read_image(device: &Device, mesh: &Mesh, set: &SampleSet, number: usize) -> Result<Vec<Quad>, ReconstructionError> {
    let image = &mesh.images[number];
    let mut frame = Frame::begin(&device.gpu, "read quads", Turn::default());
    let buffers = [&image.inverse_depths, &image.indices, &image.draw];
    let [depths, indices, draw] = buffers.map(|buffer| read_back(device, &mut frame, buffer));
    let done = frame.submit()?.wait()?;
    let count = done.with(draw, |words: &[u32]| words[0] as usize)?;
    let indices = done.with(indices, |words: &[u32]| words[..count].to_vec())?;
    let depths = done.with(depths, <[f32]>::to_vec)?;
    let camera = &set.meshes.cameras[number];
    let vertices = mesh.cut.vertices;
    let quads = indices.chunks_exact(INDICES_A_QUAD as usize).map(|quad| {
        let corners = [quad[0], quad[1], quad[2], quad[3]];
        let samples = [quad[0], quad[3]].map(|vertex| vertex / vertices.per_sample());
        let corners_in_world = corners.map(|vertex| vertex_in_world(camera, vertices, vertex, depths[vertex as usize]));
        Quad { image: number, corners_in_world, samples }
    });
    Ok(quads.collect())
}

fn read_back(device: &Device, frame: &mut Frame<'_>, buffer: &wgpu::Buffer) -> Readback {
    frame.read_back(buffer, 0..buffer.size(), device.buffers.lend_host("quad read-back", buffer.size()))
}

/// As `draw.wgsl` has it.
fn vertex_in_world(camera: &PinholeCamera, vertices: QuadVertices, vertex: u32, inverse_depth_per_m: f32) -> Vec3 {
    let (sample, offset) = match vertices {
        QuadVertices::AtSamples => (vertex, Vec2::splat(0.5)),
        QuadVertices::AtTexelCorners => (vertex / 4, UVec2::new(vertex & 1, vertex >> 1 & 1).as_vec2()),
    };
    let texel = UVec2::new(sample % camera.size_px.x, sample / camera.size_px.x);
    camera.ray(texel.as_vec2() + offset).at(inverse_depth_per_m.recip())
}
