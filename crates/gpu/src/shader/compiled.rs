//! A shader with its layout, and groups of resources that are bound to it by name.

use std::num::NonZeroU64;

use wgpu::{BindGroupLayout, BindingResource};

use super::bound_group::{BoundGroup, Form};
use super::interface::{Binding, Resource, ResourceTraits, ShaderInterface};
use crate::{device::Gpu, error::ShaderError};

/// A compiled shader with the layout that its WGSL asks for.
///
/// Layouts hold every declared resource, used or not, for all stages of their kind: groups that are declared alike are
/// shared by all variants of a shader.
pub struct Shader {
    pub(super) interface: ShaderInterface,
    pub(super) module: wgpu::ShaderModule,
    pub(super) layout: wgpu::PipelineLayout,
    groups: Vec<BindGroupLayout>,
    device: wgpu::Device,
    wgsl: String,
    traits: ResourceTraits,
}

impl Shader {
    /// Compiles `wgsl`.
    ///
    /// # Errors
    /// WGSL that cannot be parsed, or a trait of a resource that is not declared.
    pub fn new(gpu: &Gpu, label: &str, wgsl: &str, traits: ResourceTraits) -> Result<Self, ShaderError> {
        let interface = ShaderInterface::of(label, wgsl, traits)?;
        let device = gpu.device.clone();
        let mut groups = Vec::with_capacity(interface.groups.len());
        for group in &interface.groups {
            let entries: Vec<_> = group.iter().map(|resource| resource.layout).collect();
            let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
            groups.push(device.create_bind_group_layout(&descriptor));
        }
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &groups.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let source = wgpu::ShaderSource::Wgsl(wgsl.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source });
        Ok(Self { interface, module, layout, groups, device, wgsl: wgsl.to_owned(), traits })
    }

    /// The same shader on another device.
    pub(super) fn on(&self, gpu: &Gpu) -> Result<Self, ShaderError> {
        Self::new(gpu, &self.interface.shader, &self.wgsl, self.traits)
    }

    /// Binds resources to all variables of a group.
    ///
    /// # Errors
    /// A name that is missing, not in the group, or there twice.
    pub fn bind<'r>(
        &self,
        group: u32,
        bindings: impl IntoIterator<Item = Binding<'r>>,
    ) -> Result<BoundGroup, ShaderError> {
        let bindings: Vec<Binding<'r>> = bindings.into_iter().collect();
        let resources = self.interface.matched(group, bindings.iter().map(|binding| binding.name))?;
        let bound = bindings.into_iter().map(|binding| binding.resource);
        let mut in_order: Vec<_> = resources.into_iter().zip(bound).collect();
        in_order.sort_by_key(|(resource, _)| resource.layout.binding);
        Ok(self.bind_in_order(group, in_order))
    }

    /// Binds, of resources for many shaders, those that a group declares; of several with one name the first.
    ///
    /// # Errors
    /// A variable of the group that none of them is for.
    pub fn bind_declared<'r>(
        &self,
        group: u32,
        bindings: impl IntoIterator<Item = Binding<'r>>,
    ) -> Result<BoundGroup, ShaderError> {
        let declared = self.interface.groups.get(group as usize).map_or(&[][..], Vec::as_slice);
        let mut bound: Vec<Binding<'r>> = Vec::with_capacity(declared.len());
        for binding in bindings {
            let is_declared = declared.iter().any(|resource| resource.name == binding.name);
            if is_declared && bound.iter().all(|other| other.name != binding.name) {
                bound.push(binding);
            }
        }
        self.bind(group, bound)
    }

    /// Binds to all variables of a group, which are in the order of its layout.
    pub(super) fn bind_in_order(&self, group: u32, bound: Vec<(&Resource, BindingResource<'_>)>) -> BoundGroup {
        let forms = bound.iter().map(|(_, resource)| Form::of(resource)).collect();
        let entries: Vec<_> = bound.into_iter().map(|(at, resource)| entry(at, resource)).collect();
        let descriptor = wgpu::BindGroupDescriptor {
            label: Some(&self.interface.shader),
            layout: &self.groups[group as usize],
            entries: &entries,
        };
        BoundGroup { group: self.device.create_bind_group(&descriptor), forms }
    }
}

fn entry<'r>(at: &Resource, bound: BindingResource<'r>) -> wgpu::BindGroupEntry<'r> {
    let resource = match (bound, at.element_bytes) {
        (BindingResource::Buffer(buffer), Some(bytes)) => {
            BindingResource::Buffer(wgpu::BufferBinding { size: NonZeroU64::new(bytes.into()), ..buffer })
        }
        (resource, _) => resource,
    };
    wgpu::BindGroupEntry { binding: at.layout.binding, resource }
}
