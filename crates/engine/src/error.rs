//! Errors of the device crates in the terms of services.

use std::str::FromStr;

use gpu::GpuError;
use node::EngineError;
use reconstruction::ReconstructionError;
use render::RenderError;
use sampling::SamplingError;

pub(crate) fn device(error: impl ToString) -> EngineError {
    EngineError::Device(error.to_string())
}

pub(crate) fn invalid(field: &'static str, reason: impl ToString) -> EngineError {
    EngineError::InvalidArgument { field, reason: reason.to_string() }
}

pub(crate) fn render_error(error: RenderError) -> EngineError {
    match error {
        RenderError::Camera { .. } => invalid("camera", error),
        RenderError::Gpu(GpuError::Lost(reason)) => EngineError::Lost(reason),
        _ => device(error),
    }
}

pub(crate) fn reconstruction_error(error: ReconstructionError) -> EngineError {
    match error {
        ReconstructionError::Camera { .. } => invalid("camera", error),
        ReconstructionError::Sample { .. } | ReconstructionError::SampleCount(_) => invalid("sample_images", error),
        ReconstructionError::Volume => invalid("volume", error),
        ReconstructionError::Gpu(GpuError::Lost(reason)) => EngineError::Lost(reason),
        _ => device(error),
    }
}

/// Parses a setting.
pub(crate) fn parsed<T: FromStr<Err: ToString>>(field: &'static str, text: &str) -> Result<T, EngineError> {
    text.parse().map_err(|error: T::Err| invalid(field, error.to_string()))
}

pub(crate) fn sampling_error(error: SamplingError) -> EngineError {
    match error {
        SamplingError::Render(error) => render_error(error),
        SamplingError::Layer { .. } => invalid("sample_cameras", error),
        SamplingError::Selection { .. } => invalid("image_indices", error),
    }
}
