//! Resources that are bound to a group of a shader, and their forms.

use std::ops::Deref;

use wgpu::{BindGroup, BindingResource, TextureFormat};

/// Resources that are bound to a group of a shader.
pub struct BoundGroup {
    pub(super) group: BindGroup,
    /// Of each resource in the order of the group's layout.
    pub(super) forms: Vec<Option<Form>>,
}

/// The properties of a texture that are part of compiled code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Form {
    pub format: TextureFormat,
    /// Whether columns and rows are powers of two.
    pub is_power_of_two: [bool; 2],
    pub has_mips: bool,
}

impl Form {
    /// `None` for a buffer or sampler, whose layout says all.
    pub fn of(resource: &BindingResource<'_>) -> Option<Self> {
        let BindingResource::TextureView(view) = resource else { return None };
        let texture = view.texture();
        Some(Self {
            format: texture.format(),
            is_power_of_two: [texture.width(), texture.height()].map(u32::is_power_of_two),
            has_mips: texture.mip_level_count() > 1,
        })
    }
}

impl Deref for BoundGroup {
    type Target = BindGroup;
    fn deref(&self) -> &BindGroup {
        &self.group
    }
}
