//! A shader with its layout, and groups of resources that are bound to it by name.

use std::num::NonZeroU64;

use wgpu::{BindGroupLayout, BindingResource};

use super::bound_group::{BoundGroup, Form};
use super::interface::{Binding, DynamicUniforms, Resource, ShaderInterface};
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
    dynamic_uniforms: DynamicUniforms,
}

impl Shader {
    /// Compiles `wgsl`.
    ///
    /// # Errors
    /// WGSL that cannot be parsed, or a variable of a type that is not supported.
    pub fn new(gpu: &Gpu, label: &str, wgsl: &str, dynamic_uniforms: DynamicUniforms) -> Result<Self, ShaderError> {
        let interface = ShaderInterface::of(label, wgsl, dynamic_uniforms)?;
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
        Ok(Self { interface, module, layout, groups, device, wgsl: wgsl.to_owned(), dynamic_uniforms })
    }

    /// The same shader on another device.
    pub(super) fn on(&self, gpu: &Gpu) -> Result<Self, ShaderError> {
        Self::new(gpu, &self.interface.shader, &self.wgsl, self.dynamic_uniforms)
    }

    /// Binds resources to all variables of a group by name. Of several resources of one name, the first counts.
    ///
    /// # Errors
    /// A group that is not declared, or a variable that has no resource.
    pub fn bind<'r>(
        &self,
        group: u32,
        bindings: impl IntoIterator<Item = Binding<'r>>,
    ) -> Result<BoundGroup, ShaderError> {
        let bindings: Vec<Binding<'r>> = bindings.into_iter().collect();
        Ok(self.bind_in_order(group, self.interface.matched(group, &bindings)?))
    }

    /// Binds resources to the variables of all groups, as [`Shader::bind`] does.
    ///
    /// # Errors
    /// A variable that has no resource.
    pub fn bind_all(&self, bindings: &[Binding<'_>]) -> Result<Vec<BoundGroup>, ShaderError> {
        let groups = 0..self.groups.len() as u32;
        groups.map(|group| Ok(self.bind_in_order(group, self.interface.matched(group, bindings)?))).collect()
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
