//! The range of vertex colours, which files of numbers do not state.

/// Above this no colour of the range 0…1 lies, even where its program rounds or overexposes.
const MAX_OF_UNIT_RANGE: f32 = 2.0;

/// The factor from a file's colours to bytes: colours are 0…1, or 0…255, or 0…65535, of which the smallest range that holds
/// all is taken.
pub(crate) fn scale_to_bytes(channels: impl Iterator<Item = f32>) -> f32 {
    let most = channels.filter(|c| c.is_finite()).fold(0.0, f32::max);
    if most <= MAX_OF_UNIT_RANGE {
        255.0
    } else if most <= 255.0 {
        1.0
    } else {
        255.0 / 65_535.0
    }
}

/// A channel that is not there, or no number, is 255.
pub(crate) fn bytes(color: [f32; 4], scale: f32) -> [u8; 4] {
    color.map(|c| if c.is_finite() { (c * scale + 0.5) as u8 } else { 255 })
}
