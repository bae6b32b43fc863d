//! Colours in RGB9E5 and unit vectors in two 16-bit numbers: the scalar reference of color.wgsl and normal.wgsl.

use glam::{Vec2, Vec3};

use crate::encoding::wrapped;

/// Shared-exponent linear RGB, the layout of `VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`. Negative and NaN
/// become 0; larger values are clamped to 65,408.
#[must_use]
pub fn rgb9e5_from_linear(linear: Vec3) -> u32 {
    const MAX: f32 = 65_408.0;
    let clamp = |v: f32| if v > 0.0 { v.min(MAX) } else { 0.0 };
    let c = linear.to_array().map(clamp);
    let largest = c[0].max(c[1]).max(c[2]);
    let floor_log2 = ((largest.to_bits() >> 23) as i32 - 127).max(-16);
    let quantise = |v: f32, exponent: i32| (v * 2f32.powi(24 - exponent) + 0.5).floor() as u32;
    let mut exponent = floor_log2 + 16;
    if quantise(largest, exponent) == 512 {
        exponent += 1;
    }
    let [r, g, b] = c.map(|v| quantise(v, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The inverse of [`rgb9e5_from_linear`].
#[must_use]
pub fn linear_from_rgb9e5(packed: u32) -> Vec3 {
    let scale = 2f32.powi((packed >> 27) as i32 - 24);
    Vec3::new((packed & 511) as f32, (packed >> 9 & 511) as f32, (packed >> 18 & 511) as f32) * scale
}

/// The inverse of [`crate::oct16_from_unit`]; the result has unit length.
#[must_use]
pub fn unit_from_oct16(packed: u32) -> Vec3 {
    let signed = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let flat = Vec2::new(signed(packed), signed(packed >> 16));
    let z = 1.0 - flat.x.abs() - flat.y.abs();
    let xy = if z < 0.0 { wrapped(flat) } else { flat };
    xy.extend(z).try_normalize().unwrap_or(Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oct16_from_unit;

    #[test]
    fn rgb9e5_keeps_nine_bits_of_the_largest_channel() {
        for i in 0..2000 {
            let c = Vec3::new(i as f32 * 0.001, (i * 7 % 2000) as f32 * 0.0005, 0.3);
            let error = (linear_from_rgb9e5(rgb9e5_from_linear(c)) - c).abs().max_element();
            assert!(error <= c.max_element() / 511.0, "{c} {error}");
        }
        assert_eq!(linear_from_rgb9e5(rgb9e5_from_linear(Vec3::ZERO)), Vec3::ZERO);
        assert_eq!(linear_from_rgb9e5(rgb9e5_from_linear(Vec3::NAN)), Vec3::ZERO);
        assert_eq!(linear_from_rgb9e5(rgb9e5_from_linear(Vec3::splat(1e9))), Vec3::splat(65_408.0));
    }

    #[test]
    fn round_trip_is_within_a_hundredth_of_a_degree() {
        for i in 0..5000 {
            let a = i as f32 * 0.731;
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 5000.0;
            let r = (1.0 - z * z).sqrt();
            let unit = Vec3::new(r * a.cos(), r * a.sin(), z);
            let back = unit_from_oct16(oct16_from_unit(unit));
            assert!(unit.cross(back).length() < 1.7e-4, "{unit} {back}");
        }
    }

    #[test]
    fn every_input_gives_a_unit_vector() {
        for v in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert!((unit_from_oct16(oct16_from_unit(v)).length() - 1.0).abs() < 1e-5);
        }
        assert!((0..1000u32).all(|i| unit_from_oct16(i.wrapping_mul(2_654_435_761)).is_normalized()));
    }
}
