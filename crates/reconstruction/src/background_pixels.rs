//! Gives pixels without a surface the background in their own direction.

use gpu::{Binding, shader_variant};

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, recording::Recording};

shader_variant!(BackgroundPixels(SetVariant), "background_pixels.wgsl", ONE_VIEW);

/// After the method, which writes the same background everywhere, and before the fill, which looks at it.
pub(crate) fn record(recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
    let Some(background) = &recording.set.background else { return Ok(()) };
    let variant = BackgroundPixels(recording.set.variant());
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = recording.view_bindings();
    bindings.extend([
        Binding::buffer("background", background),
        Binding::buffer("srgb8", &recording.batch.srgb8),
        Binding::buffer("provenance", &recording.batch.provenance),
    ]);
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, None);
    Ok(())
}
