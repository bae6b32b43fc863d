//! Compiling outside the device's queue. The software device compiles a shader at its first use, for seconds, in the middle of
//! its work. While a live stream is open, a second device of the same driver therefore uses the shader first: without work,
//! and with resources of the same form. The driver keeps what it compiled on disk, where the device of the queue finds it.

use std::collections::HashMap;
use std::error::Error;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Once};

use parking_lot::Mutex;
use wgpu::{BindingResource, BindingType, BufferUsages, TextureUsages, TextureView};

use super::bound_group::{BoundGroup, Form};
use super::compiled::Shader;
use super::interface::Resource;
use crate::device::{DevicePreference, Gpu};
use crate::error::GpuError;
use crate::frame::Frame;
use crate::sharing::WorkKind;

/// The forms that a pass remembers; all are forgotten when there are more.
const MOST_FORMS: usize = 1024;
/// Uniforms are at most this large on every device, and no shader here asks for larger storage.
const BUFFER_BYTES: u64 = 64 << 10;
/// Sides of textures: a power of two, or not.
const SIDES_PX: [u32; 2] = [3, 4];

/// The forms with which a pass was used; others of a form wait while it is made ready.
#[derive(Debug, Default)]
pub(super) struct FirstUses(Mutex<HashMap<u64, Arc<Once>>>);

/// A resource without contents.
enum Empty {
    Buffer(wgpu::Buffer),
    Texture(TextureView),
    Sampler(wgpu::Sampler),
}

impl Empty {
    fn of(gpu: &Gpu, resource: &Resource, form: Option<Form>) -> Self {
        let (dimension, usage, form) = match (resource.layout.ty, form) {
            (BindingType::Sampler(_), _) => return Self::Sampler(gpu.texture_sampler([wgpu::AddressMode::Repeat; 2])),
            (BindingType::StorageTexture { view_dimension, .. }, Some(form)) => {
                (view_dimension, TextureUsages::STORAGE_BINDING, form)
            }
            (BindingType::Texture { view_dimension, .. }, Some(form)) => {
                (view_dimension, TextureUsages::TEXTURE_BINDING, form)
            }
            _ => return Self::Buffer(gpu.buffer("empty", BUFFER_BYTES, BufferUsages::UNIFORM | BufferUsages::STORAGE)),
        };
        let Form { format, is_power_of_two, has_mips } = form;
        let [width, height] = is_power_of_two.map(|is| SIDES_PX[usize::from(is)]);
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("empty"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: if has_mips { 2 } else { 1 },
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        let view = wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() };
        Self::Texture(texture.create_view(&view))
    }

    fn resource(&self) -> BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texture(view) => BindingResource::TextureView(view),
            Self::Sampler(sampler) => BindingResource::Sampler(sampler),
        }
    }
}

impl FirstUses {
    /// Warms a shader at its first use with resources of these forms, and counts that use as work of the frame.
    pub fn make_ready(
        &self,
        frame: &mut Frame<'_>,
        shader: &Shader,
        groups: &[&BoundGroup],
        use_it: impl FnOnce(&Gpu, Shader, &[BoundGroup]) -> Result<(), GpuError>,
    ) {
        let mut hasher = DefaultHasher::new();
        groups.iter().for_each(|bound| bound.forms.hash(&mut hasher));
        let mut uses = self.0.lock();
        if uses.len() >= MOST_FORMS {
            uses.clear();
        }
        let first_use = uses.entry(hasher.finish()).or_insert_with(|| Arc::new(Once::new())).clone();
        drop(uses);
        // A thread that waits for another's first use has waited, too.
        if !first_use.is_completed() {
            frame.work.push((WorkKind::FIRST_USE, 1));
        }
        // Where an earlier thread panicked, the pass goes on without.
        first_use.call_once_force(|_| warm(frame.gpu, shader, groups, use_it));
    }
}

/// Has the second device use a shader with resources of these forms, where the device compiles at the first use and others
/// would wait for it.
fn warm(
    gpu: &Gpu,
    shader: &Shader,
    groups: &[&BoundGroup],
    use_it: impl FnOnce(&Gpu, Shader, &[BoundGroup]) -> Result<(), GpuError>,
) {
    if !gpu.is_software() || !gpu.device_queue.cuts() {
        return;
    }
    // One shader is compiled at a time: on one core.
    let mut count = gpu.compiled_outside.lock();
    let done = Gpu::open(DevicePreference::Software).map_err(Box::<dyn Error>::from).and_then(|second| {
        second.catching(|| {
            let twin = shader.on(&second)?;
            let groups =
                groups.iter().zip(0..).map(|(bound, number)| empty_group(&second, &twin, number, &bound.forms));
            let groups: Vec<BoundGroup> = groups.collect();
            Ok(use_it(&second, twin, &groups)?)
        })
    });
    // With the second device closed, the driver has written what it compiled.
    match done {
        Ok(()) => count.compiled += 1,
        Err(error) => {
            count.failed += 1;
            tracing::warn!(%error, "a shader was not compiled ahead of its use");
        }
    }
}

fn empty_group(gpu: &Gpu, shader: &Shader, number: u32, forms: &[Option<Form>]) -> BoundGroup {
    let resources = &shader.interface.groups[number as usize];
    let empty: Vec<Empty> =
        resources.iter().zip(forms).map(|(resource, &form)| Empty::of(gpu, resource, form)).collect();
    shader.bind_in_order(number, resources.iter().zip(empty.iter().map(Empty::resource)).collect())
}

#[cfg(test)]
mod tests {
    use wgpu::TextureFormat;

    use super::*;
    use crate::shader::{Binding, ComputePass, DispatchSize};
    use crate::sharing::Turn;

    const WGSL: &str = "
        struct Camera { eye: vec3f, near: f32 }
        @group(0) @binding(0) var<uniform> camera: Camera;
        @group(0) @binding(1) var words: texture_2d<u32>;
        @group(0) @binding(2) var layers: texture_2d_array<u32>;
        @group(0) @binding(3) var colors: texture_2d<f32>;
        @group(0) @binding(4) var smooth_sampler: sampler;
        @group(0) @binding(5) var drawn: texture_storage_2d<r32float, write>;
        @group(1) @binding(0) var<storage, read_write> sums: array<f32>;
        @compute @workgroup_size(8) fn main(@builtin(global_invocation_id) id: vec3u) {
            let color = textureSampleLevel(colors, smooth_sampler, vec2f(0.5), 1.0);
            let word = textureLoad(words, id.xy, 0).x + textureLoad(layers, id.xy, 0, 0).x;
            textureStore(drawn, id.xy, color);
            sums[id.x] = camera.near + color.x + f32(word);
        }
    ";
    const DYNAMIC_UNIFORMS: crate::DynamicUniforms = &["camera"];

    fn texture(gpu: &Gpu, size: [u32; 3], format: TextureFormat, dimension: wgpu::TextureViewDimension) -> TextureView {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING;
        let usage = if format == TextureFormat::Rgba8UnormSrgb { TextureUsages::TEXTURE_BINDING } else { usage };
        let descriptor = wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() };
        gpu.texture("test", size, format, usage).create_view(&descriptor)
    }

    /// Whether the shader was compiled on the second device for a dispatch of this width.
    fn is_warmed(gpu: &Gpu, pass: &ComputePass, width_px: u32) -> bool {
        use wgpu::TextureViewDimension::{D2, D2Array};
        let before = gpu.compiled_outside().compiled;
        let uniform = gpu.buffer("camera", 16, BufferUsages::UNIFORM);
        let sums = gpu.buffer("sums", 1024, BufferUsages::STORAGE);
        let words = texture(gpu, [width_px, 8, 1], TextureFormat::Rg32Uint, D2);
        let layers = texture(gpu, [8, 8, 3], TextureFormat::Rgba32Uint, D2Array);
        let colors = texture(gpu, [8, 8, 1], TextureFormat::Rgba8UnormSrgb, D2);
        let drawn = texture(gpu, [8, 8, 1], TextureFormat::R32Float, D2);
        let sampler = gpu.texture_sampler([wgpu::AddressMode::Repeat; 2]);
        let own = [
            Binding::texture("words", &words),
            Binding::buffer("camera", &uniform),
            Binding::texture("layers", &layers),
            Binding::texture("colors", &colors),
            Binding::sampler("smooth_sampler", &sampler),
            Binding::texture("drawn", &drawn),
        ];
        let groups =
            [pass.bind(0, own), pass.bind(1, [Binding::buffer("sums", &sums)])].map(|bound| bound.expect("all"));
        let mut frame = Frame::begin(gpu, "test", Turn::default());
        pass.dispatch(&mut frame, &groups.each_ref(), DispatchSize::Invocations([8, 1, 1]));
        frame.submit().and_then(|submitted| submitted.wait()).expect("a result");
        gpu.compiled_outside().compiled > before
    }

    #[test]
    fn a_shader_is_compiled_on_a_second_device_at_its_first_use_of_a_form_beside_a_live_stream() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let pass = || ComputePass::new(&gpu, Shader::new(&gpu, "test", WGSL, DYNAMIC_UNIFORMS).expect("a shader"));
        assert!(!is_warmed(&gpu, &pass(), 8), "nobody watches");
        let _live = gpu.device_queue.live_stream();
        let pass = pass();
        let warmed = [8, 16, 12, 24].map(|width_px| is_warmed(&gpu, &pass, width_px));
        assert_eq!(warmed, [true, false, true, false], "powers of two are another form");
    }
}
