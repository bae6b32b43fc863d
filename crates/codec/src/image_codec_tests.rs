//! Round trips, and thousands of damaged headers and payloads.

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};

use super::*;
use crate::{
    InverseDepthRange, MAX_LIGHT_SHARE_PLANES, PlaneEncoding,
    test_support::{Random, tree_over_terrain},
};

fn camera(width: u32, height: u32) -> Camera {
    Camera::Pinhole(PinholeCamera::looking_at(Vec3::Y, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(width, height)))
}

fn image(width: u32, height: u32) -> DepthImage {
    let mut random = Random::new(8);
    let mut inverse_depth_per_m = tree_over_terrain(width as usize, height as usize, 9);
    inverse_depth_per_m.iter_mut().skip(5).step_by(97).for_each(|texel| *texel = depth_image::HOLE_INVERSE_DEPTH);
    // As decoded: nothing where there is no sample.
    let mut word = |inverse: &f32, bits: u32| {
        if *inverse > 0.0 { random.next_u32() >> (32 - bits) } else { 0 }
    };
    let color_rgb9e5 = inverse_depth_per_m.iter().map(|inverse| word(inverse, 25)).collect();
    let normal_oct16 = Some(inverse_depth_per_m.iter().map(|inverse| word(inverse, 32)).collect());
    let id = |inverse| SurfaceId { instance: word(inverse, 2), primitive: word(inverse, 17) };
    let surface_id = Some(inverse_depth_per_m.iter().map(id).collect());
    DepthImage {
        camera: camera(width, height),
        inverse_depth_per_m,
        color_rgb9e5,
        normal_oct16,
        surface_id,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

/// An image with a number of planes of visibility.
fn shiny(width: u32, height: u32, visibilities: usize) -> DepthImage {
    let mut random = Random::new(20);
    let image = image(width, height);
    let mut plane = || {
        let word = |&inverse: &f32| if inverse > 0.0 { random.next_u32() } else { 0 };
        image.inverse_depth_per_m.iter().map(word).collect::<Vec<_>>()
    };
    let reflectance_srgb8_roughness8 = plane();
    let visibility8 = (0..visibilities).map(|_| plane()).collect();
    DepthImage { specular: Some(SpecularPlanes { reflectance_srgb8_roughness8, visibility8 }), ..image }
}

/// An image with light in place of colour, and a number of planes of shares.
fn lit(width: u32, height: u32, shares: usize) -> DepthImage {
    let mut random = Random::new(30);
    let image = image(width, height);
    let mut plane = || {
        let word = |&inverse: &f32| if inverse > 0.0 { random.next_u32() } else { 0 };
        image.inverse_depth_per_m.iter().map(word).collect::<Vec<_>>()
    };
    let light = LightPlanes {
        triangle_normal_oct16: plane(),
        lamps_rgb9e5: plane(),
        environment_rgb9e5: plane(),
        share8: (0..shares).map(|_| plane()).collect(),
    };
    DepthImage { color_rgb9e5: Vec::new(), surface_id: None, light: Some(light), ..image }
}

fn decode(image: &EncodedImage) -> Result<DepthImage, DecodeError> {
    let limits = DecodeLimits { max_texels: 1 << 16, ..DecodeLimits::default() };
    decode_depth_image(&image.header, camera(image.header.width, image.header.height), &image.payload, &limits)
}

#[test]
fn an_image_survives() {
    for size in [(1, 1), (7, 3), (160, 120)] {
        let image = image(size.0, size.1);
        let encoded = encode_depth_image(&image).expect("consistent planes");
        let back = decode(&encoded).expect("own encoding");
        let half_step = encoded.header.inverse_depth_range.step_per_m() as f32 * 0.505;
        for (&was, &is) in image.inverse_depth_per_m.iter().zip(&back.inverse_depth_per_m) {
            assert!((was - is).abs() <= half_step && (was > 0.0 || was == is));
        }
        let DepthImage { inverse_depth_per_m, .. } = &back;
        assert_eq!(back, DepthImage { inverse_depth_per_m: inverse_depth_per_m.clone(), ..image });
    }
}

/// The bits of an image that skips samples of other images.
fn apart(width: u32, height: u32) -> DepthImage {
    let image = image(width, height);
    let passed = Some(image.inverse_depth_per_m.iter().map(|d| !(0.0..=0.3).contains(d)).collect());
    let corner_inverse_depth_per_m = Some(tree_over_terrain(width as usize + 1, height as usize + 1, 4));
    DepthImage { passed, corner_inverse_depth_per_m, ..image }
}

#[test]
fn passed_bits_and_corners_survive() {
    for (width, height) in [(1, 1), (7, 3), (160, 120)] {
        let image = apart(width, height);
        let encoded = encode_depth_image(&image).expect("consistent planes");
        let back = decode(&encoded).expect("own encoding");
        assert_eq!(back.passed, image.passed);
        let corners = |image: &DepthImage| image.corner_inverse_depth_per_m.clone().expect("corners");
        let was = corners(&image);
        let is = corners(&back);
        assert_eq!(was.len(), is.len());
        assert!(was.iter().zip(&is).all(|(was, is)| (was - is).abs() < 1e-4 && (*was > 0.0 || was == is)));
    }
}

#[test]
fn damaged_planes_of_images_apart_are_refused() {
    let good = encode_depth_image(&apart(48, 32)).expect("consistent planes");
    type Damage = fn(&mut Vec<PlaneHeader>);
    let cases: [(&str, Damage); 5] = [
        ("repeated or out of order", |p| p.swap(4, 5)),
        ("repeated or out of order", |p| p.push(p[5])),
        ("repeated or out of order", |p| p.swap(3, 4)),
        ("planes.raw_bytes", |p| p[4].raw_bytes = u32::MAX),
        ("planes.raw_bytes", |p| p[5].raw_bytes = u32::MAX),
    ];
    for (name, damage) in cases {
        let mut bad = good.clone();
        damage(&mut bad.header.planes);
        let error = decode(&bad).expect_err(name).to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
    let mut random = Random::new(3);
    for _ in 0..3000 {
        let mut payload = good.payload.to_vec();
        let place = random.next_u32() as usize % payload.len();
        payload[place] ^= 1 << (random.next_u32() % 8);
        // Every result is of the right size, or an error.
        if let Ok(image) = decode(&EncodedImage { payload: payload.into(), ..good.clone() }) {
            image.validate().expect("planes of one size");
        }
    }
}

#[test]
fn images_with_light_survive_with_all_of_their_planes() {
    for (width, height, shares) in [(1, 1, 1), (7, 3, 0), (160, 120, 2), (20, 20, MAX_LIGHT_SHARE_PLANES)] {
        let passed = apart(width, height).passed;
        for image in [lit(width, height, shares), DepthImage { passed, ..lit(width, height, shares) }] {
            let encoded = encode_depth_image(&image).expect("consistent planes");
            let back = decode(&encoded).expect("own encoding");
            let half_step = encoded.header.inverse_depth_range.step_per_m() as f32 * 0.505;
            for (&was, &is) in image.inverse_depth_per_m.iter().zip(&back.inverse_depth_per_m) {
                assert!((was - is).abs() <= half_step && (was > 0.0 || was == is));
            }
            let inverse_depth_per_m = back.inverse_depth_per_m.clone();
            assert_eq!(back, DepthImage { inverse_depth_per_m, ..image.clone() });
            // All of their planes are needed, but for surface keys, which stay with the sampler.
            let id = SurfaceId { instance: 1, primitive: 2 };
            let with_keys = DepthImage { surface_id: Some(vec![id; image.inverse_depth_per_m.len()]), ..image };
            assert_eq!(encode_depth_image(&with_keys), Ok(encoded));
        }
    }
}

#[test]
fn planes_of_highlights_survive() {
    for visibilities in [0, 1, 2, 64] {
        let image = shiny(20, 20, visibilities);
        let back = decode(&encode_depth_image(&image).expect("consistent planes")).expect("own encoding");
        assert_eq!((back.normal_oct16, back.specular), (image.normal_oct16, image.specular));
    }
    let dull = encode_depth_image(&image(20, 20)).expect("consistent planes");
    assert_eq!((dull.header.planes.len(), decode(&dull).expect("own encoding").specular), (4, None));
}

#[test]
fn only_samples_are_encoded() {
    let mut image = shiny(20, 20, 1);
    let good = encode_depth_image(&image).expect("consistent planes");
    let empty: Vec<_> = (0..400).filter(|&i| image.inverse_depth_per_m[i] <= 0.0).collect();
    assert!(empty.len() > 10);
    let specular = image.specular.as_mut().expect("made so");
    for at in empty {
        specular.reflectance_srgb8_roughness8[at] = u32::MAX;
        specular.visibility8[0][at] = u32::MAX;
    }
    assert_eq!(encode_depth_image(&image).expect("consistent planes"), good);
}

#[test]
fn inconsistent_planes_are_refused() {
    let mut bad = image(20, 20);
    bad.color_rgb9e5.pop();
    assert!(encode_depth_image(&bad).is_err());
    let mut bad = shiny(20, 20, 2);
    bad.specular.as_mut().expect("made so").visibility8[1].pop();
    assert!(encode_depth_image(&bad).is_err());
    let bad = DepthImage { color_rgb9e5: vec![0; 400], ..lit(20, 20, 2) };
    let error = encode_depth_image(&bad).expect_err("colour and light").to_string();
    assert!(error.contains("has the plane color"), "{error}");
    let bad = DepthImage { normal_oct16: None, ..shiny(20, 20, 2) };
    let error = encode_depth_image(&bad).expect_err("no normals").to_string();
    assert!(error.contains("plane normal has 0"), "{error}");
}

/// Damaged images may decode to something, but never to nonsense.
fn assert_sound(result: Result<DepthImage, DecodeError>) {
    let Ok(image) = result else { return };
    assert_eq!(image.validate(), Ok(()));
    let sound = |&inverse: &f32| inverse.is_finite() && (inverse >= 0.0 || inverse == depth_image::HOLE_INVERSE_DEPTH);
    assert!(image.inverse_depth_per_m.iter().all(sound));
}

#[test]
fn damaged_payloads_never_panic() {
    let mut random = Random::new(10);
    for image in [shiny(48, 32, 2), lit(48, 32, 2)] {
        let good = encode_depth_image(&image).expect("consistent planes");
        for _ in 0..6000 {
            let mut bad = good.clone();
            let mut payload = good.payload.to_vec();
            for _ in 0..1 + random.below(4) {
                let at = random.below(payload.len());
                payload[at] ^= 1 << random.below(8);
            }
            bad.payload = payload.into();
            assert_sound(decode(&bad));
        }
    }
}

#[test]
fn damaged_planes_behind_a_sound_lz4_never_panic() {
    let good = image(48, 32);
    let depth = encode_depth(&good.inverse_depth_per_m);
    let mut random = Random::new(11);
    for _ in 0..6000 {
        let mut bytes = depth.bytes.clone();
        let at = random.below(bytes.len());
        bytes[at] = random.next_u32() as u8;
        bytes.truncate(if random.below(4) == 0 { random.below(bytes.len()) } else { bytes.len() });
        if let Ok((_, plane)) = decode_depth(&bytes, 48 * 32, depth.range) {
            assert!(plane.iter().all(|&inverse| inverse.is_finite() && inverse <= depth.range.greatest_per_m));
        }
    }
}

#[test]
fn damaged_words_behind_a_sound_lz4_never_panic() {
    let mut random = Random::new(14);
    let words: Vec<u32> = (0..500).map(|_| random.next_u32() >> random.below(32)).collect();
    for layout in [WordLayout::Whole, WordLayout::Halves, WordLayout::TwoBytes, WordLayout::Bytes] {
        let mut good = Vec::new();
        pack_words(&words, layout, &mut good);
        for _ in 0..2000 {
            let mut bytes = good.clone();
            let at = random.below(bytes.len());
            bytes[at] = random.next_u32() as u8;
            bytes.truncate(if random.below(4) == 0 { random.below(bytes.len()) } else { bytes.len() });
            let back = unpack_words(&mut &bytes[..], words.len(), layout);
            assert!(back.is_err() || back.is_ok_and(|back| back.len() == words.len()));
        }
    }
}

#[test]
fn cut_and_random_payloads_are_refused() {
    let mut random = Random::new(12);
    for image in [shiny(48, 32, 2), lit(48, 32, 2)] {
        let good = encode_depth_image(&image).expect("consistent planes");
        for length in 0..good.payload.len() {
            assert!(decode(&EncodedImage { payload: good.payload.slice(..length), ..good.clone() }).is_err());
        }
        for _ in 0..2000 {
            let payload: Vec<u8> = (0..good.payload.len()).map(|_| random.next_u32() as u8).collect();
            assert_sound(decode(&EncodedImage { payload: payload.into(), ..good.clone() }));
        }
    }
}

#[test]
fn damaged_headers_are_refused_by_field() {
    let good = encode_depth_image(&image(48, 32)).expect("consistent planes");
    type Damage = fn(&mut ImageHeader);
    let cases: [(&str, Damage); 13] = [
        ("size", |h| h.width = 0),
        ("width", |h| h.width = 65_535),
        ("texels", |h| (h.width, h.height) = (16_384, 16_384)),
        ("payload runs", |h| h.height += 1),
        ("inverse_depth_range", |h| h.inverse_depth_range.least_per_m = f32::NAN),
        ("payload runs", |h| h.inverse_depth_range = InverseDepthRange { least_per_m: 0.0, greatest_per_m: 0.0 }),
        ("planes.kind", |h| h.planes.clear()),
        ("planes.kind", |h| h.planes[2].kind = PlaneKind::ColorRgb9e5),
        ("planes.encoding", |h| h.planes[1].encoding = PlaneEncoding::SlopeTaggedLz4),
        ("planes.encoding", |h| h.planes[1].encoding = PlaneEncoding::DifferenceTaggedLz4),
        ("planes.raw_bytes", |h| h.planes[3].raw_bytes = u32::MAX),
        ("payload_bytes", |h| h.planes[3].packed_bytes = u32::MAX),
        ("LZ4 block is too short", |h| h.planes[0].raw_bytes += 1),
    ];
    for (name, damage) in cases {
        let mut bad = good.clone();
        damage(&mut bad.header);
        let error = decode(&bad).expect_err(name).to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}

#[test]
fn planes_of_highlights_out_of_order_are_refused() {
    let good = encode_depth_image(&shiny(48, 32, 2)).expect("consistent planes");
    let kinds = |header: &ImageHeader| header.planes.iter().map(|plane| plane.kind).collect::<Vec<_>>();
    assert_eq!(
        kinds(&good.header)[2..],
        [
            PlaneKind::NormalOct16,
            PlaneKind::SurfaceId,
            PlaneKind::ReflectanceRoughness8,
            PlaneKind::Visibility8,
            PlaneKind::Visibility8
        ]
    );
    type Damage = fn(&mut Vec<PlaneHeader>);
    let cases: [(&str, Damage); 9] = [
        ("reflectance without normals", |p| drop(p.drain(2..3))),
        ("reflectance without normals", |p| drop(p.drain(2..4))),
        ("visibility without reflectance", |p| drop(p.drain(4..5))),
        ("out of order", |p| p.swap(4, 5)),
        ("out of order", |p| p.swap(3, 4)),
        ("out of order", |p| p.swap(2, 6)),
        ("repeated", |p| p.insert(4, p[4])),
        ("planes.visibility8 is 65", |p| p.extend([p[6]; 63])),
        ("planes.raw_bytes", |p| p[6].raw_bytes = u32::MAX),
    ];
    for (name, damage) in cases {
        let mut bad = good.clone();
        damage(&mut bad.header.planes);
        let error = decode(&bad).expect_err(name).to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}

#[test]
fn planes_of_light_out_of_order_are_refused() {
    let good = encode_depth_image(&lit(48, 32, 2)).expect("consistent planes");
    let kinds: Vec<_> = good.header.planes.iter().map(|plane| plane.kind).collect();
    assert_eq!(
        kinds,
        [
            PlaneKind::InverseDepth,
            PlaneKind::TriangleNormalOct16,
            PlaneKind::NormalOct16,
            PlaneKind::LampsRgb9e5,
            PlaneKind::EnvironmentRgb9e5,
            PlaneKind::LightShare8,
            PlaneKind::LightShare8
        ]
    );
    let other = encode_depth_image(&shiny(48, 32, 2)).expect("consistent planes");
    let color_and_highlights = [1, 4, 5].map(|place: usize| other.header.planes[place]);
    type Damage = fn(&mut Vec<PlaneHeader>, &[PlaneHeader; 3]);
    let cases: [(&str, Damage); 15] = [
        ("must begin with inverse depth", |p, _| drop(p.drain(0..=0))),
        ("must begin with inverse depth, normals of triangles", |p, _| drop(p.drain(1..=1))),
        ("must begin with inverse depth", |p, _| drop(p.drain(2..=2))),
        ("must begin with inverse depth", |p, _| drop(p.drain(3..=3))),
        ("must begin with inverse depth", |p, _| p.truncate(4)),
        ("must begin with inverse depth", |p, _| p.swap(1, 2)),
        ("must begin with inverse depth", |p, _| p.swap(3, 4)),
        ("must begin with inverse depth", |p, color| p.insert(1, color[0])),
        ("repeated or out of order", |p, _| p.push(p[4])),
        ("not of an image with light", |p, color| p.push(color[0])),
        ("not of an image with light", |p, color| p.extend(&color[1..])),
        ("planes.light_share8 is 6", |p, _| p.extend([p[6]; 4])),
        ("planes.encoding", |p, _| p[1].encoding = PlaneEncoding::DifferenceTaggedLz4),
        ("planes.raw_bytes", |p, _| p[3].raw_bytes = u32::MAX),
        ("planes.raw_bytes", |p, _| p[6].raw_bytes = u32::MAX),
    ];
    for (number, (name, damage)) in cases.into_iter().enumerate() {
        let mut bad = good.clone();
        damage(&mut bad.header.planes, &color_and_highlights);
        let error = decode(&bad).expect_err(name).to_string();
        assert!(error.contains(name), "case {number}, {name}: {error}");
    }
    let mut beside_color = other;
    beside_color.header.planes.push(good.header.planes[5]);
    let error = decode(&beside_color).expect_err("a plane of light beside colour").to_string();
    assert!(error.contains("must begin with inverse depth, normals of triangles"), "{error}");
}

#[test]
fn planes_of_light_claim_bounded_memory() {
    let mut bad = encode_depth_image(&lit(48, 32, MAX_LIGHT_SHARE_PLANES)).expect("consistent planes");
    (bad.header.width, bad.header.height) = (4096, 4096);
    let limits = DecodeLimits { max_image_bytes: 37 << 24, ..DecodeLimits::default() };
    let result = decode_depth_image(&bad.header, camera(4096, 4096), &bad.payload, &limits);
    assert!(matches!(result, Err(DecodeError::Limit { field: "image_bytes", .. })), "{result:?}");
}

#[test]
fn planes_that_pack_well_claim_bounded_memory() {
    let mut bad = encode_depth_image(&shiny(48, 32, 64)).expect("consistent planes");
    (bad.header.width, bad.header.height) = (4096, 4096);
    let result = decode_depth_image(&bad.header, camera(4096, 4096), &bad.payload, &DecodeLimits::default());
    assert!(matches!(result, Err(DecodeError::Limit { field: "image_bytes", .. })), "{result:?}");
}

#[test]
fn a_camera_of_another_size_than_the_image_is_refused() {
    let good = encode_depth_image(&image(48, 32)).expect("consistent planes");
    let result = decode_depth_image(&good.header, camera(32, 48), &good.payload, &DecodeLimits::default());
    assert!(matches!(result, Err(DecodeError::CameraSize { .. })));
}

#[test]
fn a_small_payload_claims_no_large_buffer() {
    let two_planes = DepthImage { normal_oct16: None, surface_id: None, ..image(200, 200) };
    let mut bad = encode_depth_image(&two_planes).expect("consistent planes");
    bad.header.planes[0].packed_bytes = 2;
    bad.header.planes[1].packed_bytes = 2;
    bad.payload = Bytes::from_static(&[0xff, 0xff, 0xff, 0xff]);
    let error = decode(&bad).expect_err("four bytes");
    assert!(error.to_string().contains("claims more"), "{error}");
}
