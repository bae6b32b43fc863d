//! What the images of a set hold, for tests of what later ones may leave out.

use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{DMat4, DVec4, UVec2};
use gpu::{Frame, Gpu, GpuError};
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

use crate::{
    RenderError,
    binding::{Slot, bind_group, texture, window},
    form::{ComputePipelines, Form, Pass},
    pixel_camera::{PIXEL_CAMERA_BYTES, PIXEL_CAMERA_STRIDE},
    surfaces::Surfaces,
};

/// A test of one candidate sample against one camera before the image's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LeaveOut {
    /// The template that holds `fn is_known(candidate: Candidate, number: u32, camera: KnownCamera) -> bool`.
    pub shader: &'static str,
    /// Whom it asks.
    pub asks: Asks,
    /// Whether all images have one camera, so that pixels are compared with the same pixel.
    pub from_one_place: bool,
    /// Whether samples that were kept at another moment are kept on unless they are redundant by a margin: `known.wgsl`.
    pub settled: bool,
    /// Whether what no viewpoint near the cameras can see past its blockers is left out, too (`useful.wgsl`).
    pub only_useful: bool,
}

/// What a test asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Asks {
    /// The scene, by rays.
    Scene,
    /// Which triangle each texel of the images before shows: instance and primitive, all bits set where it shows none.
    SurfaceIds,
    /// How far each sample of the images before lies, where it faces and how coarse it is (`keep.wgsl`).
    Samples,
}

impl LeaveOut {
    /// Whether it asks the scene by rays; else it asks what the images before hold.
    #[must_use]
    pub fn traces_rays(self) -> bool {
        self.asks == Asks::Scene
    }
}

/// `KnownCamera` of `known.wgsl`.
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

/// The cameras of a set and, where a test asks for it, what their images hold.
pub(crate) struct Known {
    /// The greatest distance between two of the viewpoints.
    pub view_cell_m: f32,
    pub cameras: Vec<PinholeCamera>,
    asks: Asks,
    layers: Arc<Layers>,
    before: Option<Settled>,
    keeps_last: bool,
}

/// What all images of a set held at one moment, for the same images at another.
#[derive(Clone)]
pub struct Settled {
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
pub(crate) struct KeptLayers(Mutex<Option<Arc<Layers>>>);

/// What is bound to a test.
pub(crate) const KNOWN_SLOTS: [Slot; 4] =
    [Slot::WordTextureArray, Slot::Uniform, Slot::WordTextureArray, Slot::Uniform];

impl KeptLayers {
    /// Nobody else uses them; what they hold is left over.
    fn of(&self, gpu: &Gpu, size: wgpu::Extent3d, format: TextureFormat) -> Arc<Layers> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
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

    /// The first `count`, to be read, while others are written.
    fn first(&self, count: usize) -> wgpu::TextureView {
        self.held.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            array_layer_count: Some(count as u32),
            ..Default::default()
        })
    }
}

impl Known {
    /// Nothing is held yet.
    pub fn of(gpu: &Gpu, kept: &KeptLayers, cameras: &[PinholeCamera], test: LeaveOut) -> Result<Self, GpuError> {
        let limits = &gpu.device.limits();
        at_most("images of a set", cameras.len(), limits.max_texture_array_layers)?;
        let bytes = size_of::<KnownCamera>() * cameras.len();
        at_most("the cameras of a set (bytes)", bytes, limits.max_uniform_buffer_binding_size as u32)?;
        let side = |side: fn(&PinholeCamera) -> u32| {
            if test.traces_rays() { 1 } else { cameras.iter().map(side).max().unwrap_or(1) }
        };
        let size = wgpu::Extent3d {
            width: side(|camera| camera.size_px.x),
            height: side(|camera| camera.size_px.y),
            depth_or_array_layers: cameras.len().max(1) as u32,
        };
        let format = if test.asks == Asks::SurfaceIds { TextureFormat::Rg32Uint } else { TextureFormat::Rgba32Uint };
        Ok(Self {
            view_cell_m: view_cell_m(cameras),
            cameras: cameras.to_vec(),
            asks: test.asks,
            layers: kept.of(gpu, size, format),
            before: None,
            keeps_last: false,
        })
    }

    /// After another moment of the same set.
    pub fn after(self, before: Option<&Settled>) -> Self {
        Self { before: before.cloned(), ..self }
    }

    /// To be [`Known::settle`]d: the last image's samples are kept, too.
    pub fn keeping_all(self) -> Self {
        Self { keeps_last: true, ..self }
    }

    /// Once all images are drawn.
    pub fn settle(self) -> Settled {
        Settled { cameras: self.cameras, layers: self.layers }
    }

    /// What tests for an image of the camera `own`, after `earlier` others, are bound to.
    pub fn bind(
        &self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        own: &PinholeCamera,
        earlier: usize,
    ) -> wgpu::BindGroup {
        let cameras: Vec<KnownCamera> =
            self.cameras[..earlier].iter().map(|camera| KnownCamera::of(camera, own)).collect();
        let cameras = gpu.buffer_with("known cameras", &cameras, BufferUsages::UNIFORM);
        let held = self.layers.first(earlier);
        // Bound in any case, and read only by tests that settle.
        let (before, camera) = match &self.before {
            Some(before) => (before.layers.first(before.cameras.len()), before.cameras[earlier]),
            None => (held.clone(), *own),
        };
        let camera = gpu.buffer_with("settled camera", &[KnownCamera::of(&camera, own)], BufferUsages::UNIFORM);
        let resources = [texture(&held), cameras.as_entire_binding(), texture(&before), camera.as_entire_binding()];
        bind_group(gpu, layout, resources)
    }

    /// Where the `number`-th image's surface ids are to be drawn, if they are asked for as they are.
    pub fn surface_ids(&self, number: usize) -> Option<&wgpu::TextureView> {
        (self.asks == Asks::SurfaceIds && self.is_asked_for(number)).then(|| &self.layers.each[number])
    }

    fn is_asked_for(&self, number: usize) -> bool {
        self.keeps_last || number + 1 < self.layers.each.len()
    }

    /// The largest image's.
    pub fn size_px(&self) -> UVec2 {
        let size = self.layers.held.size();
        UVec2::new(size.width, size.height)
    }

    /// Records what later images ask of the `number`-th camera's image, which is the `place`-th of its submission.
    pub fn keep(
        &self,
        gpu: &Arc<Gpu>,
        pipelines: &ComputePipelines,
        frame: &mut Frame<'_>,
        (number, place): (usize, u32),
        (surfaces, by_rays): (&Surfaces, bool),
        cameras: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        if self.asks != Asks::Samples || !self.is_asked_for(number) {
            return Ok(());
        }
        let pipeline = pipelines.get(Form { pass: Pass::Keep, by_rays, ..Form::default() })?;
        let resources = [
            window(cameras, PIXEL_CAMERA_BYTES),
            texture(&surfaces.surface),
            texture(&surfaces.depth),
            texture(&self.layers.each[number]),
        ];
        let bound = bind_group(gpu, &pipeline.get_bind_group_layout(0), resources);
        let groups = surfaces.size_px().map(|side| side.div_ceil(8));
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bound, &[place * PIXEL_CAMERA_STRIDE]);
        pass.dispatch_workgroups(groups.x, groups.y, 1);
        Ok(())
    }
}

impl KnownCamera {
    /// `own` is the camera whose image asks.
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

fn at_most(what: &str, needed: usize, limit: u32) -> Result<(), GpuError> {
    let (needed, limit) = (needed as u64, u64::from(limit));
    if needed <= limit { Ok(()) } else { Err(GpuError::Limit { what: what.to_owned(), needed, limit }) }
}
