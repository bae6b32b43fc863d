//! The wgpu device, WGSL templates, frames of passes, read-back and timing.
//!
//! A pass records into a [`Frame`] and never submits or reads back; the owner of the frame does, once for many passes. Work
//! waits for its [`Turn`] in the [`DeviceQueue`], which everything that uses the device shares. Shaders
//! are [templates](Templates): numbers that are known when a pipeline is built (how many cameras, which planes) are written
//! into the text, because indexing cameras dynamically costs several times as much as naming them. A [`ShaderVariant`] holds
//! the switches of one shader, and a [`PassCache`] its pipelines. Resources are bound to a shader's variables by name.

mod catching;
pub mod cube_walk;
mod device;
mod environment;
mod error;
mod faults;
mod frame;
mod illumination;
#[cfg(test)]
mod illumination_tests;
mod pool;
mod shader;
mod sharing;
mod table;
mod tone;

pub use device::{CompiledOutside, DevicePreference, Gpu};
pub use environment::GpuEnvironment;
pub use error::{GpuError, ShaderError};
pub use frame::{Frame, FrameResult, Readback, Submitted};
pub use illumination::{background_bytes, highlight_name, illumination_bytes, light_slots};
pub use pool::{BufferPool, Lent, Pool, PooledBuffer};
pub use shader::{
    Binding, BoundGroup, ComputePass, DispatchSize, DrawPass, DrawState, DrawVariant, DynamicUniforms, Pass, PassCache,
    Shader, ShaderInterface, ShaderSource, ShaderVariant, Templates, WgslLiteral, source, sources, switches,
    uniform_elements, uniform_stride,
};
pub use sharing::{DeviceQueue, Job, JobLimit, LiveStream, SLICE_S, Turn, WorkClass, WorkKind, waited_s};
pub use table::{TABLE_WIDTH, Table, TablePool, texture_bytes};
pub use tone::GpuTone;
