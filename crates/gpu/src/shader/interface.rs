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

/// A property of a resource that WGSL does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResourceTrait {
    /// One element of a buffer, chosen by each dispatch or draw.
    DynamicOffset,
    /// A texture of floats that a sampler filters.
    Filterable,
}

/// Names of resources with their traits.
pub type ResourceTraits = &'static [(&'static str, ResourceTrait)];

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
    /// WGSL that cannot be parsed, or a trait of a resource that is not declared.
    pub fn of(shader: &str, wgsl: &str, traits: ResourceTraits) -> Result<Self, ShaderError> {
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
        for (_, variable) in module.global_variables.iter() {
            let Some(place) = variable.binding else { continue };
            let name = variable.name.clone().unwrap_or_default();
            let has_dynamic_offset = traits.contains(&(name.as_str(), ResourceTrait::DynamicOffset));
            let is_filterable = traits.contains(&(name.as_str(), ResourceTrait::Filterable));
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
        let mut names = traits.iter().map(|(name, _)| name);
        match names.find(|name| !interface.groups.iter().flatten().any(|resource| resource.name == **name)) {
            Some(name) => Err(invalid(shader, format!("{name} has a trait but is not declared"))),
            None => Ok(interface),
        }
    }

    /// The bytes from one element to the next of each dynamic resource of a group.
    pub(crate) fn strides(&self, group: usize) -> impl Iterator<Item = u32> {
        let resources = self.groups.get(group).into_iter().flatten();
        resources.filter_map(|resource| resource.element_bytes).map(uniform_stride)
    }

    /// Checks that bindings name all variables of a group, each once.
    ///
    /// # Errors
    /// A name that is missing, not in the group, or there twice.
    pub fn check(&self, group: u32, bindings: &[Binding<'_>]) -> Result<(), ShaderError> {
        self.matched(group, bindings.iter().map(|binding| binding.name)).map(|_| ())
    }

    /// The resources of a group that `names` are bound to, in their order; fails as [`ShaderInterface::check`] does.
    pub(crate) fn matched<'n>(
        &self,
        group: u32,
        names: impl Iterator<Item = &'n str>,
    ) -> Result<Vec<&Resource>, ShaderError> {
        let resources =
            self.groups.get(group as usize).ok_or_else(|| self.misbound(group, "the group", "is not declared"))?;
        let mut matched: Vec<&Resource> = Vec::with_capacity(resources.len());
        for name in names {
            let resource = resources.iter().find(|resource| resource.name == name);
            let resource = resource.ok_or_else(|| self.misbound(group, name, "is bound, but is not declared"))?;
            if matched.iter().any(|other| other.name == name) {
                return Err(self.misbound(group, name, "is bound twice"));
            }
            matched.push(resource);
        }
        match resources.iter().find(|resource| !matched.iter().any(|other| other.name == resource.name)) {
            Some(Resource { name, .. }) => Err(self.misbound(group, name, "is not bound")),
            None => Ok(matched),
        }
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

    const WGSL: &str = "
        struct Camera { eye: vec3f, near: f32 }
        @group(0) @binding(0) var<uniform> camera: Camera;
        @group(0) @binding(1) var depth: texture_depth_2d;
        @group(1) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(8, 4) fn main() { words[0] = u32(camera.near); }
    ";
    const CAMERA: ResourceTraits = &[("camera", ResourceTrait::DynamicOffset)];

    fn interface() -> ShaderInterface {
        ShaderInterface::of("test", WGSL, CAMERA).expect("an interface")
    }

    fn fault(group: u32, names: &[&str]) -> String {
        interface().matched(group, names.iter().copied()).map(|_| ()).expect_err("a fault").to_string()
    }

    #[test]
    fn resources_are_found_with_their_types() {
        let interface = interface();
        assert_eq!(interface.workgroup_size, [8, 4, 1]);
        assert_eq!(interface.strides(0).collect::<Vec<_>>(), [256]);
        let storage = BufferBindingType::Storage { read_only: false };
        let words = BindingType::Buffer { ty: storage, has_dynamic_offset: false, min_binding_size: None };
        assert_eq!(interface.groups[1][0].layout.ty, words);
        let found = interface.matched(0, ["depth", "camera"].into_iter()).expect("both names");
        assert_eq!(found.len(), 2);
    }

    #[test]
    fn a_missing_an_extra_and_a_repeated_name_are_errors() {
        assert_eq!(fault(0, &["camera"]), "shader test, group 0: depth is not bound");
        let extra = fault(0, &["camera", "depth", "words"]);
        assert_eq!(extra, "shader test, group 0: words is bound, but is not declared");
        let twice = fault(0, &["camera", "depth", "depth"]);
        assert_eq!(twice, "shader test, group 0: depth is bound twice");
        assert_eq!(fault(2, &[]), "shader test, group 2: the group is not declared");
    }

    #[test]
    fn a_trait_of_an_undeclared_resource_and_invalid_wgsl_are_errors() {
        let unknown = ShaderInterface::of("test", WGSL, &[("cameras", ResourceTrait::DynamicOffset)]);
        assert!(matches!(unknown, Err(ShaderError::Invalid { .. })));
        assert!(matches!(ShaderInterface::of("test", "fn f( {", &[]), Err(ShaderError::Invalid { .. })));
    }
}
