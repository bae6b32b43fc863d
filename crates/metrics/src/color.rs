//! Colour spaces of the perceptual metrics: linear Rec. 709 RGB, CIE XYZ relative to D65, CIE L*a*b*, and
//! the linearised YCxCz that FLIP filters in.

use depth_image::View;
use glam::{DMat3, DVec3, Vec3};

use crate::image::pixels;

/// XYZ of linear Rec. 709 RGB, D65: IEC 61966-2-1, unrounded.
pub(crate) const REC_709: DMat3 = DMat3::from_cols(
    DVec3::new(0.412_390_799_3, 0.212_639_005_9, 0.019_330_818_7),
    DVec3::new(0.357_584_339_4, 0.715_168_678_8, 0.119_194_779_8),
    DVec3::new(0.180_480_788_4, 0.072_192_315_4, 0.950_532_152_2),
);

/// XYZ of linear Adobe RGB (1998), D65.
pub(crate) const ADOBE_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(0.576_667, 0.297_345, 0.027_031),
    DVec3::new(0.185_558, 0.627_364, 0.070_689),
    DVec3::new(0.188_229, 0.075_291, 0.991_338),
);

/// Linear RGB to XYZ divided by that of white, and back.
#[derive(Clone, Copy)]
pub(crate) struct WhiteRelative {
    xyz_from_linear: glam::Mat3,
    linear_from_xyz: glam::Mat3,
}

impl WhiteRelative {
    pub(crate) fn new(xyz_from_linear: DMat3) -> Self {
        let white = xyz_from_linear * DVec3::ONE;
        let relative = DMat3::from_diagonal(white.recip()) * xyz_from_linear;
        Self { xyz_from_linear: relative.as_mat3(), linear_from_xyz: relative.inverse().as_mat3() }
    }

    pub(crate) fn xyz_from_linear(&self, linear: Vec3) -> Vec3 {
        self.xyz_from_linear * linear
    }

    pub(crate) fn ycxcz_from_linear(&self, linear: Vec3) -> Vec3 {
        let [x, y, z] = self.xyz_from_linear(linear).to_array();
        Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
    }

    pub(crate) fn linear_from_ycxcz(&self, ycxcz: Vec3) -> Vec3 {
        let y = (ycxcz.x + 16.0) / 116.0;
        self.linear_from_xyz * Vec3::new(y + ycxcz.y / 500.0, y, y - ycxcz.z / 200.0)
    }

    pub(crate) fn lab_from_linear(&self, linear: Vec3) -> Vec3 {
        lab_from_relative_xyz(self.xyz_from_linear(linear))
    }
}

/// CIE 1976 L*a*b* of XYZ relative to white.
pub(crate) fn lab_from_relative_xyz(xyz: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz.to_array().map(|t| match t > DELTA.powi(3) {
        true => t.cbrt(),
        false => t / (3.0 * DELTA * DELTA) + 4.0 / 29.0,
    });
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

/// Every pixel through a curve from 8 bits to linear, then through `convert`.
pub(crate) fn convert_pixels<T>(image: &View, curve: impl Fn(u8) -> f32, convert: impl Fn(Vec3) -> T) -> Vec<T> {
    let table: Vec<f32> = (0..=255).map(curve).collect();
    pixels(image).iter().map(|rgb| convert(Vec3::from(rgb.map(|channel| table[usize::from(channel)])))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_are_the_ends_of_lab() {
        let space = WhiteRelative::new(REC_709);
        assert!((space.lab_from_linear(Vec3::ONE) - Vec3::new(100.0, 0.0, 0.0)).length() < 1e-3);
        assert!(space.lab_from_linear(Vec3::ZERO).length() < 1e-3);
    }

    #[test]
    fn red_has_its_published_lab() {
        let lab = WhiteRelative::new(REC_709).lab_from_linear(Vec3::X);
        assert!((lab - Vec3::new(53.24, 80.09, 67.20)).length() < 0.05, "{lab}");
    }

    #[test]
    fn ycxcz_is_inverted() {
        let space = WhiteRelative::new(REC_709);
        let linear = Vec3::new(0.2, 0.7, 0.05);
        assert!((space.linear_from_ycxcz(space.ycxcz_from_linear(linear)) - linear).length() < 1e-5);
    }
}
