//! Unit vectors in two 16-bit numbers: the scalar reference of normal.wgsl.

use glam::{Vec2, Vec3};

use crate::encoding::unit_from_flat;

/// The inverse of [`crate::oct16_from_unit`]; the result has unit length.
#[must_use]
pub fn unit_from_oct16(packed: u32) -> Vec3 {
    let [x, y] = [packed, packed >> 16].map(|bits| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0));
    unit_from_flat(Vec2::new(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oct16_from_unit;

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
