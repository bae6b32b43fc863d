//! The resources that a shader declares, read from its WGSL, and those that are bound to them by name.

use naga::{
    AddressSpace, GlobalVariable, ImageClass, ImageDimension, Module, ScalarKind, ShaderStage, StorageAccess,
    StorageFormat, TypeInner,
    front::wgsl::{Frontend, Options},
    valid::Capabilities,
};
use wgpu::{BindingResource, BindingType, BufferBindingType, SamplerBindingType, ShaderStages, TextureFormat};

use crate::error::ShaderError;

/// Dynamic offsets are multiples of this on every device.
const ALIGNMENT_BYTES: u32 = 256;

/// The bytes from one element of a uniform to the next, where each dispatch or draw sees one at a dynamic offset.
#[must_use]
pub const fn uniform_stride(element_bytes: u32) -> u32 {
    element_bytes.next_multiple_of(ALIGNMENT_BYTES)
}

/// Elements of one size, each at its dynamic offset.
#[must_use]
pub fn uniform_elements<E: AsRef<[u8]>>(elements: impl IntoIterator<Item = E>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for element in elements {
        bytes.extend_from_slice(element.as_ref());
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT_BYTES as usize), 0);
    }
    bytes
}

/// A resource, and the variable of a shader that it is bound to.
#[derive(Debug, Clone)]
pub struct Binding<'r> {
    pub(super) name: &'static str,
    pub(super) resource: BindingResource<'r>,
}

impl<'r> Binding<'r> {
    /// A whole buffer; one element at a time where the variable has a dynamic offset.
    #[must_use]
    pub fn buffer(name: &'static str, buffer: &'r wgpu::Buffer) -> Self {
        Self { name, resource: buffer.as_entire_binding() }
    }

    /// A texture.
    #[must_use]
    pub fn texture(name: &'static str, view: &'r wgpu::TextureView) -> Self {
        Self { name, resource: BindingResource::TextureView(view) }
    }

    /// A sampler of textures.
    #[must_use]
    pub fn sampler(name: &'static str, sampler: &'r wgpu::Sampler) -> Self {
        Self { name, resource: BindingResource::Sampler(sampler) }
    }
}

/// Names of uniforms that have an element for each dispatch or draw, which sees its own at a dynamic offset.
pub type DynamicUniforms = &'static [&'static str];

/// A resource at its binding.
#[derive(Debug, Clone)]
pub(crate) struct Resource {
    pub name: String,
    pub layout: wgpu::BindGroupLayoutEntry,
    /// The size of one element where the offset is dynamic.
    pub element_bytes: Option<u32>,
}

/// A shader's resources and entry points.
#[derive(Debug, Clone)]
pub struct ShaderInterface {
    pub(crate) shader: String,
    /// The resources of each group.
    pub(crate) groups: Vec<Vec<Resource>>,
    /// Stages that have an entry point.
    pub(crate) stages: ShaderStages,
    /// The invocations of one workgroup, 0 in drawing shaders.
    pub(crate) workgroup_size: [u32; 3],
}

impl ShaderInterface {
    /// Reads `wgsl`.
    ///
    /// # Errors
    /// WGSL that cannot be parsed, or a variable of a type that is not supported.
    pub fn of(shader: &str, wgsl: &str, dynamic_uniforms: DynamicUniforms) -> Result<Self, ShaderError> {
        let mut options = Options::new();
        options.capabilities = Capabilities::all();
        let module = Frontend::new_with_options(options).parse(wgsl);
        let module = module.map_err(|error| invalid(shader, error.emit_to_string_with_path(wgsl, shader)))?;
        let mut interface = Self {
            shader: shader.to_owned(),
            groups: Vec::new(),
            stages: module.entry_points.iter().map(|entry| stage(entry.stage)).collect(),
            workgroup_size: module.entry_points.first().map_or([0; 3], |entry| entry.workgroup_size),
        };
        let computes = interface.stages.contains(ShaderStages::COMPUTE);
        let visibility = if computes { ShaderStages::COMPUTE } else { ShaderStages::VERTEX_FRAGMENT };
        // Textures beside a sampler are filtered.
        let variables = module.global_variables.iter().map(|(_, variable)| variable);
        let samplers =
            variables.filter(|variable| matches!(module.types[variable.ty].inner, TypeInner::Sampler { .. }));
        let filtered: Vec<u32> = samplers.filter_map(|sampler| Some(sampler.binding.as_ref()?.group)).collect();
        for (_, variable) in module.global_variables.iter() {
            let Some(place) = variable.binding else { continue };
            let name = variable.name.clone().unwrap_or_default();
            let has_dynamic_offset = dynamic_uniforms.contains(&name.as_str());
            let is_filterable = filtered.contains(&place.group);
            let ty = binding_type(&module, variable, has_dynamic_offset, is_filterable)
                .ok_or_else(|| invalid(shader, format!("{name} has a type that is not supported")))?;
            let bytes = module.types[variable.ty].inner.try_size(module.to_ctx());
            let element_bytes = bytes.filter(|_| has_dynamic_offset);
            let groups = interface.groups.len().max(place.group as usize + 1);
            interface.groups.resize(groups, Vec::new());
            // Vertices write nothing.
            let is_written =
                matches!(ty, BindingType::Buffer { ty: BufferBindingType::Storage { read_only: false }, .. });
            let visibility = if is_written && !computes { ShaderStages::FRAGMENT } else { visibility };
            let layout = wgpu::BindGroupLayoutEntry { binding: place.binding, visibility, ty, count: None };
            interface.groups[place.group as usize].push(Resource { name, layout, element_bytes });
        }
        interface.groups.iter_mut().for_each(|group| group.sort_by_key(|resource| resource.layout.binding));
        Ok(interface)
    }

    /// The bytes from one element to the next of each dynamic resource of a group.
    pub(crate) fn strides(&self, group: usize) -> impl Iterator<Item = u32> {
        let resources = self.groups.get(group).into_iter().flatten();
        resources.filter_map(|resource| resource.element_bytes).map(uniform_stride)
    }

    /// The variables of a group in the order of its layout, each with the first resource of its name. Resources that no
    /// variable names are left out.
    pub(crate) fn matched<'r>(
        &self,
        group: u32,
        bindings: &[Binding<'r>],
    ) -> Result<Vec<(&Resource, BindingResource<'r>)>, ShaderError> {
        let variables = self.groups.get(group as usize);
        let variables = variables.ok_or_else(|| self.misbound(group, "the group", "is not declared"))?;
        let matched = variables.iter().map(|variable| {
            let binding = bindings.iter().find(|binding| binding.name == variable.name);
            let binding = binding.ok_or_else(|| self.misbound(group, &variable.name, "is not bound"))?;
            Ok((variable, binding.resource.clone()))
        });
        matched.collect()
    }

    fn misbound(&self, group: u32, name: &str, fault: &'static str) -> ShaderError {
        ShaderError::Binding { shader: self.shader.clone(), group, name: name.to_owned(), fault }
    }
}

fn invalid(shader: &str, message: String) -> ShaderError {
    ShaderError::Invalid { shader: shader.to_owned(), message }
}

fn stage(stage: ShaderStage) -> ShaderStages {
    match stage {
        ShaderStage::Vertex => ShaderStages::VERTEX,
        ShaderStage::Fragment => ShaderStages::FRAGMENT,
        _ => ShaderStages::COMPUTE,
    }
}

/// The type of a variable's binding; `None` for types that no shader here uses.
fn binding_type(
    module: &Module,
    variable: &GlobalVariable,
    has_dynamic_offset: bool,
    is_filterable: bool,
) -> Option<BindingType> {
    let ty = match (variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, _) => BufferBindingType::Uniform,
        (AddressSpace::Storage { access }, _) => {
            BufferBindingType::Storage { read_only: !access.contains(StorageAccess::STORE) }
        }
        (AddressSpace::Handle, &TypeInner::Image { dim, arrayed, class }) => {
            return image_type(dim, arrayed, class, is_filterable);
        }
        (AddressSpace::Handle, TypeInner::Sampler { comparison: false }) => {
            return Some(BindingType::Sampler(SamplerBindingType::Filtering));
        }
        _ => return None,
    };
    Some(BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None })
}

fn image_type(dim: ImageDimension, arrayed: bool, class: ImageClass, filterable: bool) -> Option<BindingType> {
    if dim != ImageDimension::D2 {
        return None;
    }
    let view_dimension = if arrayed { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
    let sample_type = match class {
        ImageClass::Sampled { kind: ScalarKind::Float, multi: false } => wgpu::TextureSampleType::Float { filterable },
        ImageClass::Sampled { kind: ScalarKind::Uint, multi: false } => wgpu::TextureSampleType::Uint,
        ImageClass::Depth { multi: false } => wgpu::TextureSampleType::Depth,
        ImageClass::Storage { format, access: StorageAccess::STORE } => {
            let access = wgpu::StorageTextureAccess::WriteOnly;
            return Some(BindingType::StorageTexture { access, format: texture_format(format)?, view_dimension });
        }
        _ => return None,
    };
    Some(BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

fn texture_format(format: StorageFormat) -> Option<TextureFormat> {
    match format {
        StorageFormat::R32Float => Some(TextureFormat::R32Float),
        StorageFormat::Rg32Uint => Some(TextureFormat::Rg32Uint),
        StorageFormat::R32Uint => Some(TextureFormat::R32Uint),
        StorageFormat::Rgba32Uint => Some(TextureFormat::Rgba32Uint),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{DevicePreference, Gpu};

    const WGSL: &str = "
        struct Camera { eye: vec3f, near: f32 }
        @group(0) @binding(0) var<uniform> camera: Camera;
        @group(0) @binding(1) var depth: texture_depth_2d;
        @group(1) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(8, 4) fn main() { words[0] = u32(camera.near); }
    ";
    const CAMERA: DynamicUniforms = &["camera"];

    fn interface() -> ShaderInterface {
        ShaderInterface::of("test", WGSL, CAMERA).expect("an interface")
    }

    #[test]
    fn resources_are_found_with_their_types() {
        let interface = interface();
        assert_eq!(interface.workgroup_size, [8, 4, 1]);
        assert_eq!(interface.strides(0).collect::<Vec<_>>(), [256]);
        let storage = BufferBindingType::Storage { read_only: false };
        let words = BindingType::Buffer { ty: storage, has_dynamic_offset: false, min_binding_size: None };
        assert_eq!(interface.groups[1][0].layout.ty, words);
    }

    #[test]
    fn variables_take_the_first_resource_of_their_name_and_a_missing_one_is_an_error() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let buffers = [(); 2].map(|()| gpu.buffer("test", 16, wgpu::BufferUsages::UNIFORM));
        let named = ["words", "depth", "camera"].map(|name| Binding::buffer(name, &buffers[0]));
        let all = [&named[..], &[Binding::buffer("camera", &buffers[1])]].concat();
        let interface = interface();
        let matched = interface.matched(0, &all).expect("both names");
        assert_eq!(matched.iter().map(|(variable, _)| &variable.name).collect::<Vec<_>>(), ["camera", "depth"]);
        assert!(matches!(&matched[0].1, BindingResource::Buffer(binding) if *binding.buffer == buffers[0]));
        let unbound = interface.matched(0, &named[2..]).expect_err("a fault");
        assert_eq!(unbound.to_string(), "shader test, group 0: depth is not bound");
        let unknown = interface.matched(2, &all).expect_err("a fault");
        assert_eq!(unknown.to_string(), "shader test, group 2: the group is not declared");
    }

    #[test]
    fn invalid_wgsl_is_an_error() {
        assert!(matches!(ShaderInterface::of("test", "fn f( {", &[]), Err(ShaderError::Invalid { .. })));
    }
}
