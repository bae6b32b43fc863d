//! Resources that are bound to a group of a shader, and their forms.

use std::ops::Deref;

use wgpu::{BindGroup, BindingResource, TextureFormat};

/// Resources that are bound to a group of a shader.
pub struct BoundGroup {
    pub(super) group: BindGroup,
    /// Of each resource in the order of the group's layout.
    pub(super) forms: Vec<Form>,
}

/// The properties of a resource that are part of compiled code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Form {
    /// A buffer or sampler: its layout says all.
    OfLayout,
    Texture {
        format: TextureFormat,
        /// Whether columns and rows are powers of two.
        is_power_of_two: [bool; 2],
        has_mips: bool,
    },
}

impl Form {
    pub(super) fn of(resource: &BindingResource<'_>) -> Self {
        let BindingResource::TextureView(view) = resource else { return Self::OfLayout };
        let texture = view.texture();
        Self::Texture {
            format: texture.format(),
            is_power_of_two: [texture.width(), texture.height()].map(u32::is_power_of_two),
            has_mips: texture.mip_level_count() > 1,
        }
    }
}

impl Deref for BoundGroup {
    type Target = BindGroup;
    fn deref(&self) -> &BindGroup {
        &self.group
    }
}
