//! Encodings: 8-bit sRGB at the client, RGB9E5 for radiance, octahedral unit vectors in two signed 16-bit numbers (Cigolle
//! et al. 2014).

use glam::{Vec2, Vec2Swizzles as _, Vec3};

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

/// Shared-exponent linear RGB, the layout of `VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`. Negative and NaN
/// become 0; larger values are clamped to 65,408.
#[must_use]
pub fn rgb9e5_from_linear(linear: Vec3) -> u32 {
    const MAX: f32 = 65_408.0;
    let c = linear.to_array().map(|v| if v > 0.0 { v.min(MAX) } else { 0.0 });
    let largest = c[0].max(c[1]).max(c[2]);
    let floor_log2 = ((largest.to_bits() >> 23) as i32 - 127).max(-16);
    let mut exponent = floor_log2 + 16;
    if mantissa(largest, exponent) == 512 {
        exponent += 1;
    }
    let [r, g, b] = c.map(|v| mantissa(v, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

fn mantissa(v: f32, exponent: i32) -> u32 {
    (v * 2f32.powi(24 - exponent) + 0.5).floor() as u32
}

/// The inverse of [`rgb9e5_from_linear`].
#[must_use]
pub fn linear_from_rgb9e5(packed: u32) -> Vec3 {
    let scale = 2f32.powi((packed >> 27) as i32 - 24);
    Vec3::new((packed & 511) as f32, (packed >> 9 & 511) as f32, (packed >> 18 & 511) as f32) * scale
}

/// Packs a unit vector. Any other input unpacks to some unit vector, never NaN.
#[must_use]
pub fn oct16_from_unit(unit: Vec3) -> u32 {
    let length = unit.abs().element_sum();
    let n = if length > 0.0 { unit / length } else { Vec3::Z };
    let flat = n.truncate();
    let folded = if n.z < 0.0 { wrapped(flat) } else { flat };
    let [x, y] = folded.to_array().map(|v| u32::from(((v.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16));
    x | y << 16
}

/// Packs a unit vector in two signed bytes. Any other input unpacks to some unit vector, never NaN.
#[must_use]
pub fn oct8_from_unit(unit: Vec3) -> u16 {
    oct8_from_oct16(oct16_from_unit(unit))
}

/// An octahedral vector in two signed bytes, of one in two signed 16-bit numbers.
#[must_use]
pub fn oct8_from_oct16(packed: u32) -> u16 {
    let halves = [packed, packed >> 16].map(|bits| f32::from(bits as u16 as i16) / 32767.0);
    u16::from_le_bytes(halves.map(|v| ((v * 127.0).round() as i8) as u8))
}

/// The inverse of [`oct8_from_unit`]; the result has unit length.
#[must_use]
pub fn unit_from_oct8(packed: u16) -> Vec3 {
    let [x, y] = packed.to_le_bytes().map(|byte| (f32::from(byte as i8) / 127.0).max(-1.0));
    unit_from_flat(Vec2::new(x, y))
}

/// The unit vector of a place on the octahedron that is folded flat.
pub(crate) fn unit_from_flat(flat: Vec2) -> Vec3 {
    let z = 1.0 - flat.x.abs() - flat.y.abs();
    let xy = if z < 0.0 { wrapped(flat) } else { flat };
    xy.extend(z).try_normalize().unwrap_or(Vec3::Z)
}

/// The octahedron's lower half, turned outwards; its own inverse.
fn wrapped(v: Vec2) -> Vec2 {
    (1.0 - v.yx().abs()) * Vec2::select(v.cmpge(Vec2::ZERO), Vec2::ONE, Vec2::NEG_ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trips_every_code() {
        assert!((0..=255).all(|code| srgb8_from_linear(linear_from_srgb8(code)) == code));
    }

    #[test]
    fn a_normal_in_two_bytes_is_within_a_degree() {
        for i in 0..4000 {
            let turn = i as f32 * 2.399_963;
            let up = 1.0 - (i as f32 + 0.5) / 2000.0;
            let unit = (Vec2::from_angle(turn) * (1.0 - up * up).max(0.0).sqrt()).extend(up);
            let degrees = unit_from_oct8(oct8_from_unit(unit)).angle_between(unit).to_degrees();
            assert!(degrees < 1.0, "{unit} {degrees}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_eq!(unit_from_oct8(oct8_from_unit(axis)), axis);
        }
        assert!(unit_from_oct8(oct8_from_unit(Vec3::NAN)).is_finite());
    }

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
}
