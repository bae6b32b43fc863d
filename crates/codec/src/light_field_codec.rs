//! A layered light field to header and payload, and back.

use depth_image::{LayeredError, LayeredLightField, LightFieldCamera};

use crate::color_codec::{pack_colors, unpack_colors};
use crate::image_codec::{Packer, unpack_plane};
use crate::image_header::wrong_kinds;
use crate::layered_codec::{gather, layer_by_layer, pack_depths, pack_layer_counts, scatter, unpack_depths};
use crate::layered_image_codec::{PackedLines, encoded, unpack_lines};
use crate::{DecodeError, DecodeLimits, EncodedImage, ImageHeader, LayeredCounts, PlaneKind};

/// Packs a light field. Depth is quantised to 16 bits over the camera's range; radiance is kept to the bit.
///
/// # Errors
/// Samples that are not those of the camera's lines.
pub fn encode_light_field(field: &LayeredLightField) -> Result<EncodedImage, LayeredError> {
    field.validate()?;
    let places = layer_by_layer(&field.first);
    let mut packer = Packer::default();
    packer.write(PlaneKind::LayerCount8, |out| pack_layer_counts(&field.first, out));
    packer.write(PlaneKind::LayerDepth, |out| {
        pack_depths(&gather(&field.planar_depth_m, &places), field.camera.range_m(), out);
    });
    packer.write(PlaneKind::ColorRgb9e5, |out| pack_colors(&gather(&field.radiance_rgb9e5, &places), out));
    let counts = LayeredCounts { sample_count: places.len() as u32, truncated: false };
    Ok(encoded(packer, field.camera.size_px(), counts))
}

/// Unpacks a light field. The camera must have passed its own validation.
///
/// # Errors
/// A header that is inconsistent, over the limits or not of the camera's size. A payload that does not decode to exactly
/// the planes of the header.
pub fn decode_light_field(
    header: &ImageHeader,
    camera: LightFieldCamera,
    payload: &[u8],
    limits: &DecodeLimits,
) -> Result<LayeredLightField, DecodeError> {
    let PackedLines { first, places, truncated, planes, payload: mut packed } =
        unpack_lines(header, camera.size_px(), payload, limits)?;
    if truncated {
        return Err(DecodeError::Header { field: "layered.truncated", reason: "of layered depth images alone" });
    }
    let [depths, colors] = planes else {
        return Err(wrong_kinds("not those of a light field"));
    };
    let depths_m = unpack_plane(depths, &mut packed, |input| unpack_depths(input, places.len(), camera.range_m()))?;
    let colors = unpack_plane(colors, &mut packed, |input| unpack_colors(input, places.len()))?;
    let planar_depth_m = scatter(&depths_m, &places);
    let radiance_rgb9e5 = scatter(&colors, &places);
    let field = LayeredLightField { camera, first, planar_depth_m, radiance_rgb9e5 };
    field.validate().map_err(|_| DecodeError::Corrupt { field: "layer_depth", reason: "falls along a line" })?;
    Ok(field)
}

#[cfg(test)]
mod tests {
    use depth_image::{Aabb, LightDirections};
    use glam::Vec3;

    use super::*;
    use crate::test_support::Random;

    fn field() -> LayeredLightField {
        let mut random = Random::new(24);
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::new(2.0, 1.0, 3.0) };
        let camera = LightFieldCamera { pairs: 2, ..LightFieldCamera::around(bounds, LightDirections::D66, 16) };
        let mut first = vec![0u32];
        let mut planar_depth_m = Vec::new();
        for _ in 0..camera.line_count() {
            let mut depths: Vec<f32> = (0..random.below(5)).map(|_| random.unit() * camera.range_m()).collect();
            depths.sort_by(f32::total_cmp);
            planar_depth_m.extend(depths);
            first.push(planar_depth_m.len() as u32);
        }
        let radiance_rgb9e5 = planar_depth_m.iter().map(|_| random.next_u32()).collect();
        LayeredLightField { camera, first, planar_depth_m, radiance_rgb9e5 }
    }

    #[test]
    fn light_fields_survive_but_for_half_a_code_of_depth() {
        let field = field();
        let EncodedImage { header, payload } = encode_light_field(&field).unwrap();
        let back = decode_light_field(&header, field.camera, &payload, &DecodeLimits::default()).unwrap();
        let most_m = 0.51 * field.camera.range_m() / f32::from(u16::MAX);
        let gap_m = |(a, b): (&f32, &f32)| (a - b).abs();
        assert!(field.planar_depth_m.iter().zip(&back.planar_depth_m).map(gap_m).all(|gap_m| gap_m <= most_m));
        assert_eq!(LayeredLightField { planar_depth_m: field.planar_depth_m.clone(), ..back }, field);
    }

    #[test]
    fn planes_of_other_images_and_damaged_ones_are_refused() {
        let field = field();
        let EncodedImage { header, payload } = encode_light_field(&field).unwrap();
        let limits = DecodeLimits::default();
        let decode = |header: &ImageHeader, payload: &[u8]| decode_light_field(header, field.camera, payload, &limits);
        let with = |change: fn(&mut ImageHeader)| {
            let mut other = header.clone();
            change(&mut other);
            decode(&other, &payload)
        };
        assert!(with(|header| header.layered = None).is_err());
        assert!(with(|header| header.layered.as_mut().unwrap().truncated = true).is_err());
        assert!(with(|header| header.height += 1).is_err());
        assert!(with(|header| header.planes.swap(0, 1)).is_err());
        assert!(with(|header| header.planes.truncate(2)).is_err());
        assert!(with(|header| header.planes[1].kind = PlaneKind::PlaneNormalOct8).is_err());
        assert!(decode(&header, &payload[..payload.len() - 1]).is_err());
        let mut random = Random::new(25);
        for _ in 0..500 {
            let mut damaged = payload.to_vec();
            let at = random.below(damaged.len());
            damaged[at] ^= 1 << random.below(8);
            let decoded = decode(&header, &damaged);
            assert!(decoded.is_err() || decoded.is_ok_and(|field| field.validate().is_ok()));
        }
    }
}
