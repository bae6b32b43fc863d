//! Resources with the names that they are bound by.

use wgpu::BindingResource;

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
