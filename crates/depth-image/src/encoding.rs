//! Encodings: 8-bit sRGB at the client, octahedral unit vectors in two signed 16-bit numbers (Cigolle et al. 2014).

use glam::{Vec2, Vec3};

/// One channel of sRGB (IEC 61966-2-1) to linear.
#[must_use]
pub fn linear_from_srgb8(encoded: u8) -> f32 {
    let v = f32::from(encoded) / 255.0;
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// One channel of linear to sRGB, clamped to 0…1; NaN gives 0.
#[must_use]
pub fn srgb8_from_linear(linear: f32) -> u8 {
    let v = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    let encoded = if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

/// Packs a unit vector. Any other input unpacks to some unit vector, never NaN.
#[must_use]
pub fn oct16_from_unit(unit: Vec3) -> u32 {
    let length = unit.abs().element_sum();
    let n = if length > 0.0 { unit / length } else { Vec3::Z };
    let flat = n.truncate();
    let folded = if n.z < 0.0 { wrapped(flat) } else { flat };
    let quantise = |v: f32| u32::from(((v.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    quantise(folded.x) | quantise(folded.y) << 16
}

/// The octahedron's lower half, turned outwards; its own inverse.
pub(crate) fn wrapped(v: Vec2) -> Vec2 {
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    Vec2::new((1.0 - v.y.abs()) * sign(v.x), (1.0 - v.x.abs()) * sign(v.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trips_every_code() {
        assert!((0..=255).all(|code| srgb8_from_linear(linear_from_srgb8(code)) == code));
    }
}
