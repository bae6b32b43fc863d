//! The samples that images of a set hold, for tests of the redundancy of later ones (`known_samples.wgsl`).

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{DMat4, DVec4, UVec2};
use gpu::{Binding, Gpu, GpuError, Lent, Pool};
use minijinja::{Value, context};
use wgpu::{BufferUsages, TextureFormat, TextureView};

use crate::layers::{LayerKind, Layers};
use crate::redundancy_test::{Evidence, RedundancyTest};
use crate::surfaces::SURFACE_ID_FORMAT;

/// Cosine of the most grazing angle at which a footprint still grows (`footprint.wgsl`).
pub const LEAST_FACING: f32 = 0.01;

/// `KnownCamera` of `known_samples.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct KnownCamera {
    pub homogeneous_pixel_from_own: [[f32; 4]; 3],
    pub eye_in_world: [f32; 3],
    pub near_m: f32,
    pub columns: f32,
    pub rows: f32,
    pub padding: [f32; 2],
}

/// The switches of `known_samples.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct RedundancyVariant {
    test: RedundancyTest,
    /// Images before.
    earlier: usize,
}

/// The cameras of a set and, where a test consults them, the samples of their images.
pub(crate) struct KnownSamples {
    pub cameras: Vec<PinholeCamera>,
    pub test: RedundancyTest,
    layers: Lent<LayerKind, Layers>,
}

/// The images of a set that are drawn one after the other; each omits the samples that those before it hold.
#[derive(Clone, Copy)]
pub(crate) struct ImageSequence<'a> {
    pub known: &'a KnownSamples,
    /// Places in the set of the images to be drawn, and which of them is the batch's first.
    pub wanted: &'a [u32],
    pub first: usize,
    /// The samples of this many images are kept for those after them.
    pub kept: usize,
}

/// The images before one, whose samples it does not show again.
pub(crate) struct Predecessors {
    pub variant: RedundancyVariant,
    samples: TextureView,
    cameras: wgpu::Buffer,
}

impl RedundancyVariant {
    /// Each test after few and many images.
    pub fn all(tests: &[RedundancyTest]) -> Vec<Self> {
        tests.iter().flat_map(|&test| [1, 3, 15].map(|earlier| Self { test, earlier })).collect()
    }

    /// The values of `known_samples.wgsl`, whose resources are in `group`.
    pub fn context(variant: Option<Self>, group: u32) -> Value {
        context! {
            redundancy_test => variant.map(|variant| variant.test.shader),
            test_traces_rays => variant.is_some_and(|variant| variant.test.traces_rays()),
            earlier => variant.map_or(0, |variant| variant.earlier),
            known_group => group,
        }
    }
}

impl KnownSamples {
    /// Layers for the images of a set, which hold nothing yet.
    pub fn of(
        gpu: &Gpu,
        pool: &Pool<LayerKind, Layers>,
        cameras: &[PinholeCamera],
        test: RedundancyTest,
    ) -> Result<Self, GpuError> {
        let limits = &gpu.device.limits();
        GpuError::check_limit("images of a set", cameras.len() as u64, limits.max_texture_array_layers.into())?;
        let bytes = (size_of::<KnownCamera>() * cameras.len()) as u64;
        GpuError::check_limit("the cameras of a set (bytes)", bytes, limits.max_uniform_buffer_binding_size)?;
        let largest = cameras.iter().map(|camera| camera.size_px).fold(UVec2::ONE, UVec2::max);
        let size_px = if test.traces_rays() { UVec2::ONE } else { largest };
        let by_id = test.consults == Evidence::SurfaceIds;
        let format = if by_id { SURFACE_ID_FORMAT } else { TextureFormat::R32Uint };
        let size = [size_px.x, size_px.y, cameras.len().max(1) as u32];
        Ok(Self {
            cameras: cameras.to_vec(),
            test,
            layers: pool.lend((size, format), |&(size, format)| Layers::new(gpu, size, format)),
        })
    }

    /// The switches of tests for an image after `earlier` others.
    pub fn variant(&self, earlier: usize) -> RedundancyVariant {
        RedundancyVariant { test: self.test, earlier }
    }

    /// The first `earlier` images, for the next one, whose camera is `own`.
    pub fn predecessors(&self, gpu: &Gpu, earlier: usize, own: &PinholeCamera) -> Predecessors {
        let samples = self.layers.first(earlier);
        let cameras = KnownCamera::uniform(gpu, &self.cameras[..earlier], own);
        Predecessors { variant: self.variant(earlier), samples, cameras }
    }
}

impl<'a> ImageSequence<'a> {
    /// The place in its set of an image of the batch, which is also the number of images before it.
    pub fn number(&self, place: usize) -> usize {
        self.wanted[self.first + place] as usize
    }

    /// The layer that an image leaves this evidence in for images after it, and the layer's size.
    pub fn layer(&self, place: usize, evidence: Evidence) -> Option<(&'a TextureView, UVec2)> {
        let number = self.number(place);
        let layers = &self.known.layers;
        let is_kept = self.known.test.consults == evidence && number < self.kept;
        is_kept.then(|| (&layers.each[number], layers.size_px))
    }
}

impl Predecessors {
    /// The variables of `known_samples.wgsl`.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::texture("known_samples", &self.samples), Binding::buffer("known_cameras", &self.cameras)]
    }
}

impl KnownCamera {
    fn uniform(gpu: &Gpu, cameras: &[PinholeCamera], own: &PinholeCamera) -> wgpu::Buffer {
        let cameras: Vec<Self> = cameras.iter().map(|camera| Self::of(camera, own)).collect();
        gpu.buffer_with("known cameras", &cameras, BufferUsages::UNIFORM)
    }

    /// `own` is the camera of the image that consults this one.
    fn of(camera: &PinholeCamera, own: &PinholeCamera) -> Self {
        let [columns, rows] = camera.size_px.as_vec2().to_array();
        Self {
            homogeneous_pixel_from_own: homogeneous_pixel_from_own(camera, own),
            eye_in_world: camera.eye_in_world.to_array(),
            near_m: camera.near_m,
            columns,
            rows,
            padding: [0.0; 2],
        }
    }
}

/// Rows that take (column · w, row · w, w, 1) of `own` to the same, without the 1, of `camera`; w is planar depth. In
/// double precision: both cameras may be far from the origin.
fn homogeneous_pixel_from_own(camera: &PinholeCamera, own: &PinholeCamera) -> [[f32; 4]; 3] {
    let [camera_from_world, own_from_world] = [camera, own].map(|camera| {
        let [column, row, depth] = camera.homogeneous_pixel_from_world().map(|row| row.as_dvec4());
        DMat4::from_cols(column, row, depth, DVec4::W).transpose()
    });
    let rows = (camera_from_world * own_from_world.inverse()).transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.as_vec4().to_array())
}
