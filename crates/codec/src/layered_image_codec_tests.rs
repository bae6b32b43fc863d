//! Round trips, and thousands of damaged headers and payloads.

use depth_image::{Aabb, LightDirections, SpecularPlanes, rgb9e5_from_linear};
use glam::{Quat, UVec2, Vec3};

use super::*;
use crate::PlaneEncoding;
use crate::test_support::Random;

fn camera(columns: u32, rows: u32) -> ParallelCamera {
    ParallelCamera {
        corner_in_world: Vec3::ZERO,
        world_from_camera: Quat::IDENTITY,
        spacing_m: 0.25,
        size_px: UVec2::new(columns, rows),
        range_m: 8.0,
    }
}

/// Lines of 0 to 9 samples.
fn image(columns: u32, rows: u32, reflects: bool) -> LayeredDepthImage {
    let camera = camera(columns, rows);
    let mut random = Random::new(31);
    let mut first = vec![0];
    let mut planar_depth_m = Vec::new();
    for _ in 0..camera.pixel_count() {
        let mut line: Vec<f32> = (0..random.below(10)).map(|_| 8.0 * random.unit()).collect();
        line.sort_by(f32::total_cmp);
        planar_depth_m.extend(line);
        first.push(planar_depth_m.len() as u32);
    }
    let mut words = || planar_depth_m.iter().map(|_| random.next_u32()).collect::<Vec<_>>();
    let plane_normal_oct8 = words().into_iter().map(|word| word as u16).collect();
    let color_rgb9e5 = words();
    let normals = words();
    let specular = SpecularPlanes { reflectance_srgb8_roughness8: words(), visibility8: vec![words(), words()] };
    LayeredDepthImage {
        camera,
        first,
        plane_normal_oct8,
        color_rgb9e5,
        normal_oct16: reflects.then_some(normals),
        specular: reflects.then_some(specular),
        truncated: reflects,
        planar_depth_m,
    }
}

fn decode(image: &EncodedImage) -> Result<LayeredDepthImage, DecodeError> {
    let limits = DecodeLimits { max_texels: 1 << 16, ..DecodeLimits::default() };
    decode_layered_image(&image.header, camera(image.header.width, image.header.height), &image.payload, &limits)
}

#[test]
fn a_layered_image_survives() {
    for (columns, rows, reflects) in [(1, 1, false), (7, 3, true), (150, 120, false), (150, 120, true)] {
        let image = image(columns, rows, reflects);
        let back = decode(&encode_layered_image(&image).unwrap()).unwrap();
        let most_m = 0.51 * image.camera.range_m / f32::from(u16::MAX);
        let depths = image.planar_depth_m.iter().zip(&back.planar_depth_m);
        assert!(depths.clone().all(|(was, is)| (was - is).abs() <= most_m));
        assert_eq!(back, LayeredDepthImage { planar_depth_m: back.planar_depth_m.clone(), ..image });
    }
}

#[test]
fn a_wall_and_what_is_behind_it_pack_to_a_byte_a_sample() {
    let camera = camera(200, 200);
    let lines = camera.pixel_count();
    let depth_m = |sample: usize| if sample.is_multiple_of(2) { 1.0 + (sample / 2 % 200) as f32 * 0.01 } else { 6.0 };
    let image = LayeredDepthImage {
        camera,
        first: (0..=lines as u32).map(|line| 2 * line).collect(),
        planar_depth_m: (0..2 * lines).map(depth_m).collect(),
        plane_normal_oct8: (0..2 * lines).map(|sample| if sample.is_multiple_of(2) { 77 } else { 1234 }).collect(),
        color_rgb9e5: vec![rgb9e5_from_linear(Vec3::splat(0.3)); 2 * lines],
        normal_oct16: None,
        specular: None,
        truncated: false,
    };
    let encoded = encode_layered_image(&image).unwrap();
    assert!(encoded.payload.len() < 2 * lines, "{} bytes", encoded.payload.len());
    assert_eq!(decode(&encoded).unwrap().first, image.first);
}

#[test]
fn damaged_payloads_never_panic() {
    let good = encode_layered_image(&image(40, 20, true)).unwrap();
    let mut random = Random::new(33);
    for _ in 0..3000 {
        let mut payload = good.payload.to_vec();
        for _ in 0..1 + random.below(4) {
            let at = random.below(payload.len());
            payload[at] ^= 1 << random.below(8);
        }
        if let Ok(image) = decode(&EncodedImage { payload: payload.into(), ..good.clone() }) {
            assert_eq!(image.validate(), Ok(()));
        }
    }
    for length in (0..good.payload.len()).step_by(7) {
        assert!(decode(&EncodedImage { payload: good.payload.slice(..length), ..good.clone() }).is_err());
    }
}

#[test]
fn damaged_headers_are_refused_by_field() {
    let good = encode_layered_image(&image(40, 20, true)).unwrap();
    type Damage = fn(&mut ImageHeader);
    let cases: [(&str, Damage); 14] = [
        ("inverse_depth_range", |h| {
            h.inverse_depth_range = InverseDepthRange { least_per_m: 0.1, greatest_per_m: 1.0 }
        }),
        ("size", |h| h.width = 0),
        ("texels", |h| (h.width, h.height) = (16_384, 16_384)),
        ("must begin with inverse depth", |h| h.layered = None),
        ("sample_count", |h| h.layered = Some(LayeredCounts { sample_count: u32::MAX, truncated: false })),
        ("not as many", |h| h.layered = Some(LayeredCounts { sample_count: 7000, truncated: false })),
        ("must begin with those of a layered", |h| h.planes.swap(0, 1)),
        ("must begin with those of a layered", |h| h.planes.clear()),
        ("of depth images alone", |h| h.planes.push(PlaneHeader { kind: PlaneKind::Passed1, ..h.planes[0] })),
        ("of depth images alone", |h| h.planes.push(PlaneHeader { kind: PlaneKind::LightShare8, ..h.planes[0] })),
        ("out of order", |h| h.planes.push(h.planes[4])),
        ("planes.encoding", |h| h.planes[1].encoding = PlaneEncoding::DifferenceTaggedLz4),
        ("planes.raw_bytes", |h| h.planes[2].raw_bytes = u32::MAX),
        ("payload_bytes", |h| h.planes[3].packed_bytes = u32::MAX),
    ];
    for (name, damage) in cases {
        let mut bad = good.clone();
        damage(&mut bad.header);
        let error = decode(&bad).expect_err(name).to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
    let wide = decode_layered_image(&good.header, camera(20, 40), &good.payload, &DecodeLimits::default());
    assert!(matches!(wide, Err(DecodeError::CameraSize { .. })));
    let small = DecodeLimits { max_image_bytes: 60_000, ..DecodeLimits::default() };
    let large = decode_layered_image(&good.header, camera(40, 20), &good.payload, &small);
    assert!(matches!(large, Err(DecodeError::Limit { field: "image_bytes", .. })), "{large:?}");
}

#[test]
fn highlights_without_normals_are_refused() {
    let bad = LayeredDepthImage { normal_oct16: None, ..image(4, 4, true) };
    assert!(matches!(encode_layered_image(&bad), Err(SampleImageError::Plane { plane: "normal", .. })));
}

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
