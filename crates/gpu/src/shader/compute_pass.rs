//! A compute shader that is bound by name and dispatched.

use std::ops::{Deref, Range};

use super::bound_group::BoundGroup;
use super::compiled::Shader;
use super::variant::{Pass, ShaderVariant};
use super::warming::FirstUses;
use crate::sharing::Turn;
use crate::{device::Gpu, error::GpuError, frame::Frame};

/// A compute pipeline with its layout. The shader's entry point is `main`.
pub struct ComputePass {
    shader: Shader,
    pipeline: wgpu::ComputePipeline,
    first_uses: FirstUses,
}

/// The size of a dispatch.
#[derive(Debug, Clone, Copy)]
pub enum DispatchSize<'b> {
    /// At least this many invocations along x, y and z, in whole workgroups.
    Invocations([u32; 3]),
    /// The workgroups that the device has written at `16 · (first + n)` for the n-th of the elements.
    Indirect(&'b wgpu::Buffer, u32),
}

impl ComputePass {
    /// Builds the pipeline.
    #[must_use]
    pub fn new(gpu: &Gpu, shader: Shader) -> Self {
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&shader.interface.shader),
            layout: Some(&shader.layout),
            module: &shader.module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        Self { shader, pipeline, first_uses: FirstUses::default() }
    }

    /// Records one dispatch, which sees the first element of buffers at dynamic offsets. `groups` are all groups, from 0.
    pub fn dispatch(&self, frame: &mut Frame<'_>, groups: &[&BoundGroup], size: DispatchSize<'_>) {
        self.dispatch_each(frame, groups, 0..1, size);
    }

    /// Records one dispatch for each element: it sees that element of buffers at dynamic offsets.
    pub fn dispatch_each(
        &self,
        frame: &mut Frame<'_>,
        groups: &[&BoundGroup],
        elements: Range<u32>,
        size: DispatchSize<'_>,
    ) {
        self.first_uses.make_ready(frame, &self.shader, groups, use_without_work);
        let interface = &self.shader.interface;
        let label = Some(interface.shader.as_str());
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes: None });
        pass.set_pipeline(&self.pipeline);
        for (number, element) in (0..).zip(elements) {
            for (group, bound) in groups.iter().enumerate() {
                let offsets: Vec<u32> = interface.strides(group).map(|stride| element * stride).collect();
                if number == 0 || !offsets.is_empty() {
                    pass.set_bind_group(group as u32, &***bound, &offsets);
                }
            }
            match size {
                DispatchSize::Invocations(invocations) => {
                    let size = interface.workgroup_size;
                    let [x, y, z] = std::array::from_fn(|axis| invocations[axis].div_ceil(size[axis]));
                    pass.dispatch_workgroups(x, y, z);
                }
                DispatchSize::Indirect(arguments, first) => {
                    pass.dispatch_workgroups_indirect(arguments, 16 * u64::from(first + number));
                }
            }
        }
    }
}

/// Uses a shader on a device, which compiles it.
fn use_without_work(gpu: &Gpu, shader: Shader, groups: &[BoundGroup]) -> Result<(), GpuError> {
    let mut frame = Frame::begin(gpu, "compile", Turn::default());
    let groups: Vec<&BoundGroup> = groups.iter().collect();
    ComputePass::new(gpu, shader).dispatch(&mut frame, &groups, DispatchSize::Invocations([0; 3]));
    frame.submit()?.wait().map(drop)
}

impl Deref for ComputePass {
    type Target = Shader;
    fn deref(&self) -> &Shader {
        &self.shader
    }
}

impl<V: ShaderVariant> Pass<V> for ComputePass {
    fn build(gpu: &Gpu, shader: Shader, _: &V) -> Self {
        Self::new(gpu, shader)
    }
}
