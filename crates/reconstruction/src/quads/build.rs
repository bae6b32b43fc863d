//! Cuts a set's images, and reads back what came of it.

use std::sync::Arc;

use depth_image::PinholeCamera;
use glam::{UVec2, Vec2, Vec3};
use gpu::{Frame, Readback, Turn};

use super::cut::ImageCut;
use super::mesh::{Cut, INDICES_A_QUAD, MAX_MESHES, Mesh, MeshStatistics, Quad, QuadVertices};
use super::{list, merge};
use crate::methods::{hybrid_mesh::CutTexels, mesh::CutBetweenSamples};
use crate::{device::Device, error::ReconstructionError, sample_set::SampleSet};

/// The set's mesh of a cut, made when it is first asked for.
pub(crate) fn mesh(device: &Device, set: &SampleSet, cut: Cut, turn: Turn) -> Result<Arc<Mesh>, ReconstructionError> {
    let missing = set.meshes.planes.as_ref().err().filter(|_| cut.vertices == QuadVertices::AtTexelCorners);
    if let Some(&(index, plane)) = missing {
        return Err(ReconstructionError::MissingPlane { index, plane });
    }
    if let Some(mesh) = mesh_of_cut(&set.meshes.meshes.lock(), cut) {
        return Ok(mesh);
    }
    // Not under the lock: a live view would wait for the turn of a batch.
    let mesh = Arc::new(build(device, set, cut, turn)?);
    let mut meshes = set.meshes.meshes.lock();
    if let Some(mesh) = mesh_of_cut(&meshes, cut) {
        return Ok(mesh);
    }
    if meshes.len() >= MAX_MESHES {
        meshes.remove(0);
    }
    meshes.push(mesh.clone());
    Ok(mesh)
}

fn mesh_of_cut(meshes: &[Arc<Mesh>], cut: Cut) -> Option<Arc<Mesh>> {
    meshes.iter().find(|mesh| mesh.cut == cut).cloned()
}

/// Quads are listed in the order of their samples, so that the same set gives the same list.
fn build(device: &Device, set: &SampleSet, cut: Cut, turn: Turn) -> Result<Mesh, ReconstructionError> {
    let mut frame = Frame::begin(&device.gpu, "cut meshes", turn);
    let mut images = Vec::new();
    let mut reads = Vec::new();
    for number in 0..set.cameras.len() {
        let image = ImageCut::new(device, set, number, cut)?;
        match cut.vertices {
            QuadVertices::AtSamples => {
                image.dispatch(&mut frame, &CutBetweenSamples, image.work(), image.size_px.to_array())?;
            }
            QuadVertices::AtTexelCorners => {
                image.dispatch(&mut frame, &CutTexels, image.work(), image.size_px.to_array())?;
            }
        }
        cut.merged.map_or(Ok(()), |bound| merge::record(&mut frame, &image, bound))?;
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
    let mut frame = Frame::begin(&device.gpu, "read quads", Turn::default());
    let buffers = mesh.images.iter().map(|image| [&image.inverse_depths, &image.indices, &image.draw]);
    let reads: Vec<_> = buffers.map(|buffers| buffers.map(|buffer| read_back(device, &mut frame, buffer))).collect();
    let done = frame.submit()?.wait()?;
    let vertices = mesh.cut.vertices;
    let mut quads = Vec::new();
    for (image, [depths, indices, draw]) in reads.into_iter().enumerate() {
        let count = done.with(draw, |words: &[u32]| words[0] as usize)?;
        let indices = done.with(indices, |words: &[u32]| words[..count].to_vec())?;
        let depths = done.with(depths, <[f32]>::to_vec)?;
        let camera = &set.meshes.cameras[image];
        quads.extend(indices.chunks_exact(INDICES_A_QUAD as usize).map(|quad| {
            let corners = [quad[0], quad[1], quad[2], quad[3]];
            let samples = [quad[0], quad[3]].map(|vertex| vertex / vertices.per_sample());
            let corners_in_world =
                corners.map(|vertex| vertex_in_world(camera, vertices, vertex, depths[vertex as usize]));
            Quad { image, corners_in_world, samples }
        }));
    }
    Ok(quads)
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
