//! Sample images as quads on the device: cut once a set and method, drawn for every view.
//!
//! What a quad stands for is the method's (`mesh.rs`, `hybrid_mesh.rs`); here quads are counted and listed in the order
//! of their samples, so that the same set gives the same list.

use std::sync::{Arc, Mutex, PoisonError};

use depth_image::{Camera, DepthImage, PinholeCamera};
use glam::{UVec2, Vec2, Vec3};
use gpu::{Frame, PooledBuffer, Readback};
use wgpu::{BindingResource, BufferUsages};

use crate::{
    ErrorBound, ReconstructionError, ReconstructionMethod, Reconstructor, SampleSet, ShaderKey,
    layout::{GpuCutWork, GpuSampleCamera, GpuViewCamera},
    methods::{
        hybrid_mesh::{self, CornerPlanes},
        mesh,
    },
    word_texture::WordTextures,
};

/// `CHUNK` of `cut.wgsl`.
const CHUNK: u32 = 64;
pub(crate) const INDICES_A_QUAD: u32 = 6;
const BYTES_OF_DRAW: u64 = 20;
/// Bits of the greatest error, and quads before merging.
const BYTES_OF_REPORT: u64 = 8;
/// Kept with a set, the last ones asked for: bounds are free to choose, memory is not.
const MAX_CUTS: usize = 3;

/// How images are cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Between samples.
    Mesh,
    /// A quad a sample, then merged or not.
    Hybrid(Option<ErrorBound>),
}

impl Cut {
    /// `None` of methods that draw no quads.
    pub fn of(method: ReconstructionMethod) -> Option<Self> {
        match method {
            ReconstructionMethod::Mesh => Some(Self::Mesh),
            ReconstructionMethod::HybridMesh { merged } => Some(Self::Hybrid(merged)),
            ReconstructionMethod::LightFieldSearch { .. } | ReconstructionMethod::JointCarve { .. } => None,
        }
    }

    pub fn is_hybrid(self) -> bool {
        matches!(self, Self::Hybrid(_))
    }

    fn vertices_a_sample(self) -> u64 {
        if self.is_hybrid() { 4 } else { 1 }
    }
}

/// What cutting a set came to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshStatistics {
    /// Quads before any were merged.
    pub quads_before: u64,
    /// Quads that are drawn.
    pub quads: u64,
    /// Of merged quads, how far they are off what they replace: in sample pixels, as seen from the side.
    pub greatest_error_px: f32,
    /// Seconds on the device, once a set.
    pub device_s: f64,
}

/// Two triangles: its first three corners, and its last three.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad {
    /// The sample image it was cut from.
    pub image: usize,
    /// Upper left, upper right, lower left, lower right.
    pub corners_in_world: [Vec3; 4],
    /// Of each of its triangles the sample it stands for where no camera knows better, row by row in the image.
    pub samples: [u32; 2],
}

/// What a set keeps for methods that draw quads.
pub(crate) struct SetMeshes {
    pub cameras: Vec<PinholeCamera>,
    /// Or which plane is missing where.
    pub planes: Result<CornerPlanes, (usize, &'static str)>,
    /// The one first asked for is the first.
    cut: Mutex<Vec<Arc<Mesh>>>,
}

impl SetMeshes {
    /// Planes go to the device where every image has them.
    pub fn upload(textures: &WordTextures, images: &[DepthImage]) -> Result<Self, ReconstructionError> {
        let camera = |image: &DepthImage| {
            let Camera::Pinhole(camera) = &image.camera;
            *camera
        };
        let planes = match hybrid_mesh::REQUIRED_PLANES.missing(images) {
            Some(missing) => Err(missing),
            None => Ok(CornerPlanes::upload(textures, images)?),
        };
        Ok(Self { cameras: images.iter().map(camera).collect(), planes, cut: Mutex::default() })
    }
}

/// A set's images, cut.
pub(crate) struct Mesh {
    pub cut: Cut,
    pub images: Vec<ImageQuads>,
    pub statistics: MeshStatistics,
}

/// Of one image. Buffers of their own: those of all images may exceed what a device binds at once.
pub(crate) struct ImageQuads {
    /// On the rays of the vertices, see `quads.wgsl`.
    pub inverse_depths: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    /// Arguments of the indirect draw.
    pub draw: wgpu::Buffer,
}

/// An image on its way to quads.
pub(crate) struct ImageCut<'s> {
    pub set: &'s SampleSet,
    pub number: usize,
    pub size_px: UVec2,
    pub quads: ImageQuads,
    /// See `extent_of` in the shaders.
    pub extents: PooledBuffer,
    pub report: wgpu::Buffer,
}

impl ImageCut<'_> {
    fn samples(&self) -> u32 {
        self.size_px.element_product()
    }

    pub fn work(&self) -> GpuCutWork {
        let camera: &GpuSampleCamera = &self.set.cameras[self.number];
        let rays = GpuViewCamera::of(&self.set.meshes.cameras[self.number], 0, UVec2::ONE, 0);
        let planes = self.set.meshes.planes.as_ref();
        GpuCutWork {
            column_in_world: rays.column_in_world,
            focal_px: camera.focal_px,
            row_in_world: rays.row_in_world,
            code_scale: camera.code_scale,
            corner_in_world: rays.corner_in_world,
            code_offset: camera.code_offset,
            size_px: self.size_px.to_array(),
            first_sample: camera.first_cell,
            first_corner: planes.map_or(0, |planes| planes.first_corners[self.number]),
            axis: 0,
            bound_px: 0.0,
            chunks: self.samples().div_ceil(CHUNK),
            segment: 0,
        }
    }
}

/// Read-backs of one image.
struct Reads {
    draw: Readback,
    report: Readback,
}

impl Reconstructor {
    /// What cutting the set for a method came to; `None` of methods that draw no quads.
    ///
    /// # Errors
    /// A plane that the method needs and an image lacks, or the device.
    pub fn mesh_statistics(
        &self,
        set: &SampleSet,
        method: ReconstructionMethod,
    ) -> Result<Option<MeshStatistics>, ReconstructionError> {
        Ok(self.mesh(set, method)?.map(|mesh| mesh.statistics))
    }

    /// The quads that a method draws, image after image in the order of their samples; none of methods that draw none.
    ///
    /// # Errors
    /// As [`Reconstructor::mesh_statistics`].
    pub fn read_quads(&self, set: &SampleSet, method: ReconstructionMethod) -> Result<Vec<Quad>, ReconstructionError> {
        let Some(mesh) = self.mesh(set, method)? else { return Ok(Vec::new()) };
        let mut quads = Vec::new();
        for number in 0..mesh.images.len() {
            quads.extend(self.read_image(set, &mesh, number)?);
        }
        Ok(quads)
    }

    fn read_image(&self, set: &SampleSet, mesh: &Mesh, number: usize) -> Result<Vec<Quad>, ReconstructionError> {
        let image = &mesh.images[number];
        let mut frame = Frame::begin(&self.gpu, "read quads");
        let mut read = |buffer: &wgpu::Buffer| {
            let host = self.pool.lend_host("quad read-back", buffer.size());
            frame.read_back(buffer, 0..buffer.size(), host)
        };
        let [depths, indices, draw] = [&image.inverse_depths, &image.indices, &image.draw].map(&mut read);
        let done = frame.submit().wait()?;
        let count = done.with(draw, |words: &[u32]| words[0] as usize)?;
        let indices = done.with(indices, |words: &[u32]| words[..count].to_vec())?;
        let camera = &set.meshes.cameras[number];
        let quad = |quad: &[u32], depths: &[f32]| {
            let place = |i: usize| vertex_in_world(camera, mesh.cut, quad[i], depths[quad[i] as usize]);
            let samples = [quad[0], quad[3]].map(|vertex| vertex / mesh.cut.vertices_a_sample() as u32);
            Quad { image: number, corners_in_world: [0, 1, 2, 3].map(place), samples }
        };
        Ok(done.with(depths, |depths: &[f32]| {
            indices.chunks_exact(INDICES_A_QUAD as usize).map(|indices| quad(indices, depths)).collect()
        })?)
    }

    /// Cut when first asked for, and kept with the set.
    pub(crate) fn mesh(
        &self,
        set: &SampleSet,
        method: ReconstructionMethod,
    ) -> Result<Option<Arc<Mesh>>, ReconstructionError> {
        let Some(cut) = Cut::of(method) else { return Ok(None) };
        // Held while it is cut: who asks meanwhile wants the same.
        let mut meshes = set.meshes.cut.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(mesh) = meshes.iter().find(|mesh| mesh.cut == cut) {
            return Ok(Some(mesh.clone()));
        }
        let mesh = Arc::new(self.cut(set, cut)?);
        if meshes.len() >= MAX_CUTS {
            meshes.remove(0);
        }
        meshes.push(mesh.clone());
        Ok(Some(mesh))
    }

    fn cut(&self, set: &SampleSet, cut: Cut) -> Result<Mesh, ReconstructionError> {
        let mut frame = Frame::begin(&self.gpu, "cut meshes");
        let (mut images, mut reads) = (Vec::new(), Vec::new());
        for number in 0..set.cameras.len() {
            let image = self.image_cut(set, number, cut)?;
            match cut {
                Cut::Mesh => mesh::record(self, &mut frame, &image)?,
                Cut::Hybrid(merged) => hybrid_mesh::record(self, &mut frame, &image, merged)?,
            }
            self.list_quads(&mut frame, &image, cut)?;
            let mut read = |buffer: &wgpu::Buffer, bytes: u64| {
                frame.read_back(buffer, 0..bytes, self.pool.lend_host("mesh report", bytes))
            };
            let draw = read(&image.quads.draw, BYTES_OF_DRAW);
            reads.push(Reads { draw, report: read(&image.report, BYTES_OF_REPORT) });
            images.push(image);
        }
        let done = frame.submit().wait()?;
        let mut statistics = MeshStatistics { device_s: done.device_s, ..MeshStatistics::default() };
        for read in reads {
            let [error_bits, before] = done.with(read.report, |words: &[u32]| [words[0], words[1]])?;
            statistics.quads_before += u64::from(before);
            statistics.greatest_error_px = statistics.greatest_error_px.max(f32::from_bits(error_bits));
            statistics.quads += done.with(read.draw, |words: &[u32]| u64::from(words[0] / INDICES_A_QUAD))?;
        }
        Ok(Mesh { cut, images: images.into_iter().map(|image| image.quads).collect(), statistics })
    }

    fn image_cut<'s>(&self, set: &'s SampleSet, number: usize, cut: Cut) -> Result<ImageCut<'s>, ReconstructionError> {
        let size_px = set.meshes.cameras[number].size_px;
        let samples = u64::from(size_px.element_product());
        let storage = |label: &str, bytes: u64, usage: BufferUsages| {
            self.gpu.check_storage_bytes(label, bytes)?;
            let usage = usage | BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            let descriptor =
                wgpu::BufferDescriptor { label: Some(label), size: bytes, usage, mapped_at_creation: false };
            Ok::<_, gpu::GpuError>(self.gpu.device.create_buffer(&descriptor))
        };
        let indices = 4 * u64::from(INDICES_A_QUAD) * samples;
        let quads = ImageQuads {
            inverse_depths: storage("corners of quads", 4 * cut.vertices_a_sample() * samples, BufferUsages::VERTEX)?,
            indices: storage("indices of quads (bytes)", indices, BufferUsages::INDEX)?,
            draw: storage("quads to draw", BYTES_OF_DRAW, BufferUsages::INDIRECT)?,
        };
        // New buffers are zero, as the report's sums need.
        let report = storage("mesh report", BYTES_OF_REPORT, BufferUsages::empty())?;
        let extents = self.pool.lend_storage("extents of quads", 4 * samples);
        Ok(ImageCut { set, number, size_px, quads, extents, report })
    }

    fn list_quads(&self, frame: &mut Frame<'_>, image: &ImageCut<'_>, cut: Cut) -> Result<(), ReconstructionError> {
        let chunks = image.samples().div_ceil(CHUNK);
        let counts = self.pool.lend_storage("quads of chunks", 4 * u64::from(chunks));
        let key = |name| ShaderKey { name, hybrid: cut.is_hybrid(), ..ShaderKey::default() };
        let groups = [chunks.div_ceil(CHUNK), 1, 1];
        let (work, extents, places) = (image.work(), &*image.extents, &*counts);
        self.cut_pass(frame, key("quad_count.wgsl"), &work, &buffers([extents, places, &image.report]), groups)?;
        self.cut_pass(frame, key("quad_scan.wgsl"), &work, &buffers([places, &image.quads.draw]), [1, 1, 1])?;
        let lists = buffers([extents, places, &image.quads.indices]);
        self.cut_pass(frame, key("quad_indices.wgsl"), &work, &lists, groups)
    }

    /// One dispatch of a shader that begins with `CutWork`.
    pub(crate) fn cut_pass(
        &self,
        frame: &mut Frame<'_>,
        key: ShaderKey,
        work: &GpuCutWork,
        resources: &[BindingResource<'_>],
        workgroups: [u32; 3],
    ) -> Result<(), ReconstructionError> {
        let pipeline = self.pipeline(key)?;
        let uniform = self.gpu.buffer_with("cut", std::slice::from_ref(work), BufferUsages::UNIFORM);
        let all = std::iter::once(uniform.as_entire_binding()).chain(resources.iter().cloned());
        let entries: Vec<_> =
            (0..).zip(all).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let bound = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(key.name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        frame.compute(key.name, &pipeline, &bound, workgroups);
        Ok(())
    }
}

pub(crate) fn buffers<const N: usize>(buffers: [&wgpu::Buffer; N]) -> [BindingResource<'_>; N] {
    buffers.map(wgpu::Buffer::as_entire_binding)
}

/// As `quads.wgsl` has it.
fn vertex_in_world(camera: &PinholeCamera, cut: Cut, vertex: u32, inverse_depth_per_m: f32) -> Vec3 {
    let (sample, offset) = match cut {
        Cut::Mesh => (vertex, Vec2::splat(0.5)),
        Cut::Hybrid(_) => (vertex / 4, UVec2::new(vertex & 1, vertex >> 1 & 1).as_vec2()),
    };
    let texel = UVec2::new(sample % camera.size_px.x, sample / camera.size_px.x);
    camera.ray(texel.as_vec2() + offset).at(inverse_depth_per_m.recip())
}
