//! The samples that images of a set hold, for tests of the redundancy of later ones (`known_samples.wgsl`).

use std::{collections::HashSet, sync::Arc};

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{DMat4, DVec4, UVec2};
use gpu::{Binding, Gpu, GpuError, ShaderError};
use minijinja::{Value, context};
use parking_lot::Mutex;
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

use crate::{
    redundancy_test::{Evidence, RedundancyTest},
    surfaces::SURFACE_ID_FORMAT,
};

/// A sample of the temporal reference is the same as a candidate within this many footprints: a steep surface may change its
/// depth more from texel to texel.
pub const REFERENCE_FOOTPRINTS: f32 = 4.0;
/// Cosine of the most grazing angle at which a footprint still grows (`footprint.wgsl`).
pub const LEAST_FACING: f32 = 0.01;

/// `KnownCamera` of `known_samples.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct KnownCamera {
    pub homogeneous_pixel_from_own: [[f32; 4]; 3],
    pub eye_in_world: [f32; 3],
    pub footprint: f32,
    pub column_in_world: [f32; 3],
    pub columns: f32,
    pub row_in_world: [f32; 3],
    pub rows: f32,
    pub near_m: f32,
    pub padding_0: f32,
    pub padding_1: f32,
    pub padding_2: f32,
}

/// The switches of `known_samples.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct RedundancyVariant {
    shader: &'static str,
    traces_rays: bool,
    temporal_reference: bool,
    /// The number of images before.
    earlier: usize,
}

/// The cameras of a set and, where a test consults them, the samples of their images.
pub(crate) struct KnownSamples {
    /// The greatest distance between two of the viewpoints.
    pub view_cell_m: f32,
    pub cameras: Vec<PinholeCamera>,
    test: RedundancyTest,
    layers: Arc<Layers>,
    reference: Option<TemporalReference>,
    keeps_last: bool,
}

/// The samples of all images of a set at one moment, for the same images at another.
#[derive(Clone)]
pub struct TemporalReference {
    cameras: Vec<PinholeCamera>,
    layers: Arc<Layers>,
}

/// A texel for each sample, a layer for each image.
struct Layers {
    held: wgpu::Texture,
    /// Each layer, to be written.
    each: Vec<wgpu::TextureView>,
}

/// The last layers that were made: making and clearing them costs as much as drawing a picture.
#[derive(Default)]
pub(crate) struct LayerCache(Mutex<Option<Arc<Layers>>>);

impl RedundancyVariant {
    /// Each test after few and many images, with a temporal reference where samples are consulted.
    pub fn all(tests: &[RedundancyTest]) -> HashSet<Self> {
        let with_reference = |test: &RedundancyTest| [false, test.consults == Evidence::Samples];
        let after = |test: &RedundancyTest, earlier| {
            let (shader, traces_rays) = (test.shader, test.traces_rays());
            let variant = |temporal_reference| Self { shader, traces_rays, temporal_reference, earlier };
            with_reference(test).map(variant)
        };
        tests.iter().flat_map(|test| [1, 3, 15].into_iter().flat_map(|earlier| after(test, earlier))).collect()
    }

    /// The values of `known_samples.wgsl`, whose resources are in `group`.
    pub fn context(variant: Option<Self>, group: u32) -> Value {
        context! {
            redundancy_test => variant.map(|variant| variant.shader),
            test_traces_rays => variant.is_some_and(|variant| variant.traces_rays),
            temporal_reference => variant.is_some_and(|variant| variant.temporal_reference),
            earlier => variant.map_or(0, |variant| variant.earlier),
            known_group => group,
        }
    }
}

impl LayerCache {
    /// Layers that nobody else uses; they hold what is left over.
    fn of(&self, gpu: &Gpu, size: wgpu::Extent3d, format: TextureFormat) -> Arc<Layers> {
        let mut kept = self.0.lock();
        let fits = |layers: &&Arc<Layers>| layers.held.size() == size && layers.held.format() == format;
        match kept.as_ref().filter(fits).filter(|layers| Arc::strong_count(layers) == 1) {
            Some(layers) => layers.clone(),
            None => kept.insert(Arc::new(Layers::new(gpu, size, format))).clone(),
        }
    }
}

impl Layers {
    fn new(gpu: &Gpu, size: wgpu::Extent3d, format: TextureFormat) -> Self {
        let held = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("held samples"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let layer = |base_array_layer| {
            held.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        Self { each: (0..size.depth_or_array_layers).map(layer).collect(), held }
    }

    /// The first `count` layers, to be read while others are written.
    fn first(&self, count: usize) -> wgpu::TextureView {
        self.held.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            array_layer_count: Some(count as u32),
            ..Default::default()
        })
    }
}

impl KnownSamples {
    /// Layers for the images of a set, which hold nothing yet.
    pub fn of(
        gpu: &Gpu,
        cache: &LayerCache,
        cameras: &[PinholeCamera],
        test: RedundancyTest,
    ) -> Result<Self, GpuError> {
        let limits = &gpu.device.limits();
        GpuError::check_limit("images of a set", cameras.len() as u64, limits.max_texture_array_layers.into())?;
        let bytes = (size_of::<KnownCamera>() * cameras.len()) as u64;
        GpuError::check_limit("the cameras of a set (bytes)", bytes, limits.max_uniform_buffer_binding_size)?;
        let side = |side: fn(&PinholeCamera) -> u32| {
            if test.traces_rays() { 1 } else { cameras.iter().map(side).max().unwrap_or(1) }
        };
        let size = wgpu::Extent3d {
            width: side(|camera| camera.size_px.x),
            height: side(|camera| camera.size_px.y),
            depth_or_array_layers: cameras.len().max(1) as u32,
        };
        let by_id = test.consults == Evidence::SurfaceIds;
        Ok(Self {
            view_cell_m: view_cell_m(cameras),
            cameras: cameras.to_vec(),
            test,
            layers: cache.of(gpu, size, if by_id { SURFACE_ID_FORMAT } else { TextureFormat::Rgba32Uint }),
            reference: None,
            keeps_last: false,
        })
    }

    /// After another moment of the same set.
    pub fn after(self, reference: Option<&TemporalReference>) -> Self {
        Self { reference: reference.cloned(), ..self }
    }

    /// The last image's samples are kept, too.
    pub fn keeping_all(self) -> Self {
        Self { keeps_last: true, ..self }
    }

    /// All images' samples, once they are drawn.
    pub fn into_reference(self) -> TemporalReference {
        TemporalReference { cameras: self.cameras, layers: self.layers }
    }

    pub fn test(&self) -> RedundancyTest {
        self.test
    }

    /// The switches of tests for an image after `earlier` others.
    pub fn variant(&self, earlier: usize) -> RedundancyVariant {
        RedundancyVariant {
            shader: self.test.shader,
            traces_rays: self.test.traces_rays(),
            temporal_reference: self.reference.is_some(),
            earlier,
        }
    }

    /// Binds the variables of `known_samples.wgsl`, for an image of the camera `own` after `earlier` others.
    pub fn bind(
        &self,
        gpu: &Gpu,
        own: &PinholeCamera,
        earlier: usize,
        bind: impl FnOnce(Vec<Binding<'_>>) -> Result<wgpu::BindGroup, ShaderError>,
    ) -> Result<wgpu::BindGroup, ShaderError> {
        let uniform = |cameras: &[PinholeCamera]| {
            let cameras: Vec<_> = cameras.iter().map(|camera| KnownCamera::of(camera, own)).collect();
            gpu.buffer_with("known cameras", &cameras, BufferUsages::UNIFORM)
        };
        let (held, cameras) = (self.layers.first(earlier), uniform(&self.cameras[..earlier]));
        let reference = self.reference.as_ref().map(|TemporalReference { cameras, layers }| {
            (layers.first(cameras.len()), uniform(&cameras[earlier..=earlier]))
        });
        let mut bindings = vec![Binding::texture("known_samples", &held), Binding::buffer("known_cameras", &cameras)];
        if let Some((samples, camera)) = &reference {
            bindings
                .extend([Binding::texture("reference_samples", samples), Binding::buffer("reference_camera", camera)]);
        }
        bind(bindings)
    }

    /// The layer for the `number`-th image's surface ids, where a test consults them.
    pub fn surface_ids(&self, number: usize) -> Option<&wgpu::TextureView> {
        self.layer(number, Evidence::SurfaceIds)
    }

    /// The layer for the `number`-th image's samples, where a test consults them.
    pub fn samples(&self, number: usize) -> Option<&wgpu::TextureView> {
        self.layer(number, Evidence::Samples)
    }

    fn layer(&self, number: usize, evidence: Evidence) -> Option<&wgpu::TextureView> {
        let is_consulted = self.keeps_last || number + 1 < self.layers.each.len();
        (self.test.consults == evidence && is_consulted).then(|| &self.layers.each[number])
    }

    /// The largest image's size.
    pub fn size_px(&self) -> UVec2 {
        let size = self.layers.held.size();
        UVec2::new(size.width, size.height)
    }
}

impl KnownCamera {
    /// `own` is the camera of the image that consults this one.
    fn of(camera: &PinholeCamera, own: &PinholeCamera) -> Self {
        let column = camera.world_from_camera * glam::Vec3::X / camera.focal_px.x;
        let row = camera.world_from_camera * glam::Vec3::NEG_Y / camera.focal_px.y;
        let size = camera.size_px.as_vec2();
        Self {
            homogeneous_pixel_from_own: homogeneous_pixel_from_own(camera, own),
            eye_in_world: camera.eye_in_world.to_array(),
            footprint: camera.focal_px.min_element().recip(),
            column_in_world: column.to_array(),
            columns: size.x,
            row_in_world: row.to_array(),
            rows: size.y,
            near_m: camera.near_m,
            ..Self::zeroed()
        }
    }
}

/// Rows that take (column · w, row · w, w, 1) of `own` to the same, without the 1, of `camera`; w is planar depth. In
/// double precision: both cameras may be far from the origin.
fn homogeneous_pixel_from_own(camera: &PinholeCamera, own: &PinholeCamera) -> [[f32; 4]; 3] {
    let from_world = |camera: &PinholeCamera| {
        let [column, row, depth] = camera.homogeneous_pixel_from_world().map(|row| row.as_dvec4());
        DMat4::from_cols(column, row, depth, DVec4::W).transpose()
    };
    let rows = (from_world(camera) * from_world(own).inverse()).transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.as_vec4().to_array())
}

/// The greatest distance between two of the viewpoints: the size of the cell that views are asked for in.
#[must_use]
pub fn view_cell_m(cameras: &[PinholeCamera]) -> f32 {
    let pairs = cameras.iter().flat_map(|a| cameras.iter().map(|b| a.eye_in_world.distance(b.eye_in_world)));
    pairs.fold(0.0, f32::max)
}
