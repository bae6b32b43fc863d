//! Times of the codecs, and the bytes that they save, on one core.
//!
//! `cargo run --release -p codec --example depth_codec_bench [-- PLANE.f32 WIDTH HEIGHT]...`
//!
//! Without arguments it takes a made-up tree over terrain. A file holds inverse depths per metre as
//! little-endian `f32`, rows top-down, 0 for background, negative for holes. Speeds are of the 16-bit
//! plane's bytes (colour and what highlights need: 32-bit; frames: 24-bit), quantising and LZ4 included, medians.

use std::{error::Error, hint::black_box, time::Instant};

use codec::{
    DecodeLimits, FrameCodec, InverseDepthRange, decode_depth_image, decode_frame, encode_depth_image, encode_frame,
};
use depth_image::{Camera, DepthImage, PinholeCamera, SpecularPlanes, rgb9e5_from_linear};
use glam::{UVec2, Vec3};

#[path = "../src/test_support.rs"]
#[allow(dead_code)] // The tests use more of it.
mod test_support;

fn main() -> Result<(), Box<dyn Error>> {
    println!("| what | raw bytes | raw LZ4 | ours | of LZ4 | encode MB/s | decode MB/s |");
    println!("|---|---|---|---|---|---|---|");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.is_empty() {
        for (width, height) in [(400, 300), (1024, 1024)] {
            report("tree", &test_support::tree_over_terrain(width, height, 1), width as u32, height as u32)?;
        }
    }
    for plane in arguments.chunks(3) {
        let [path, width, height] = plane else {
            return Err("each plane needs FILE WIDTH HEIGHT".into());
        };
        let bytes = std::fs::read(path)?;
        let values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
        report(path, &values, width.parse()?, height.parse()?)?;
    }
    Ok(())
}

fn report(name: &str, plane: &[f32], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    report_depth(&format!("{name} {width}×{height} depth"), plane, width, height)?;
    let mut random = test_support::Random::new(2);
    let shade = |&inverse: &f32| {
        let light = inverse * (1.5 + 0.02 * random.unit());
        if inverse > 0.0 { Vec3::new(light, light * 1.3, light * 0.4) } else { Vec3::ZERO }
    };
    let colors: Vec<Vec3> = plane.iter().map(shade).collect();
    report_color(&format!("{name} {width}×{height} colour"), plane, &colors, width, height)?;
    for (what, words) in [
        ("reflectance", reflectance(plane, &mut random)),
        ("visibility, 16 rays", visibility(plane, width as usize, 16, &mut random)),
        ("visibility, 256 rays", visibility(plane, width as usize, 256, &mut random)),
        ("visibility, hard", visibility(plane, width as usize, 1, &mut random)),
    ] {
        report_words(&format!("{name} {width}×{height} {what}"), plane, words, width, height)?;
    }
    report_frame(&format!("{name} {width}×{height} frame"), &colors, width, height)
}

/// The depths of a black image, whose colours take next to no time.
fn report_depth(name: &str, plane: &[f32], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let image = black(plane, width, height);
    let header = encode_depth_image(&image)?.header;
    let codes = plane.iter().map(|&inverse| code_of(inverse, header.inverse_depth_range));
    let raw: Vec<u8> = codes.flat_map(u16::to_le_bytes).collect();
    let (_, encode_s, decode_s) = image_costs(&image)?;
    print_row(name, &raw, header.planes[0].packed_bytes as usize, encode_s, decode_s);
    Ok(())
}

/// The 16-bit code of an inverse depth: 0 for a hole, 1 for background, and the others over the range of the plane.
fn code_of(inverse_depth_per_m: f32, range: InverseDepthRange) -> u16 {
    let InverseDepthRange { least_per_m, greatest_per_m } = range;
    let share = (inverse_depth_per_m - least_per_m) / (greatest_per_m - least_per_m).max(f32::MIN_POSITIVE);
    match inverse_depth_per_m {
        inverse if inverse > 0.0 => 2 + (f64::from(share) * f64::from(u16::MAX - 2)).round() as u16,
        inverse => u16::from(inverse == 0.0),
    }
}

/// The colour plane's share of a whole image: what it adds to a black one.
fn report_color(name: &str, plane: &[f32], colors: &[Vec3], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let color_rgb9e5 = colors.iter().map(|&color| rgb9e5_from_linear(color)).collect();
    let black = black(plane, width, height);
    let image = DepthImage { color_rgb9e5, ..black.clone() };
    let header = encode_depth_image(&image)?.header;
    let without = image_costs(&black)?;
    let with = image_costs(&image)?;
    let raw: Vec<u8> = image.color_rgb9e5.iter().flat_map(|color| color.to_le_bytes()).collect();
    print_row(name, &raw, header.planes[1].packed_bytes as usize, with.1 - without.1, with.2 - without.2);
    Ok(())
}

fn black(plane: &[f32], width: u32, height: u32) -> DepthImage {
    let size_px = UVec2::new(width, height);
    DepthImage {
        camera: Camera::Pinhole(PinholeCamera::looking_at(Vec3::Y, Vec3::ZERO, Vec3::Y, 0.8, size_px)),
        inverse_depth_per_m: plane.to_vec(),
        color_rgb9e5: vec![0; plane.len()],
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

/// Two materials by depth, one of them of uneven roughness; nothing where there is no sample.
fn reflectance(plane: &[f32], random: &mut test_support::Random) -> Vec<u32> {
    let mut word = |&inverse: &f32| match inverse {
        inverse if inverse <= 0.0 => 0,
        inverse if inverse * 40.0 % 2.0 < 1.0 => 0x6038_3838,
        inverse => ((150.0 + 20.0 * (inverse * 90.0).sin() + 6.0 * random.unit()) as u32) << 24 | 0x0038_3838,
    };
    plane.iter().map(&mut word).collect()
}

/// Shares of four lights by a number of rays; one ray from the light's middle casts a hard shadow.
fn visibility(plane: &[f32], width: usize, rays: u32, random: &mut test_support::Random) -> Vec<u32> {
    let mut share = |at: usize, light: usize| {
        let x = (at % width) as f32 / width as f32;
        let y = (at / width) as f32 / width as f32;
        let lit = ((x * 9.0 + light as f32).sin() + (y * 13.0 + plane[at]).cos()) * 2.0 + 0.5;
        let seen = (0..rays).filter(|_| if rays == 1 { lit > 0.5 } else { random.unit() < lit }).count();
        seen as u32 * 255 / rays
    };
    let mut word = |at| (0..4).fold(0, |word, light| word | share(at, light) << (8 * light));
    (0..plane.len()).map(|at| if plane[at] > 0.0 { word(at) } else { 0 }).collect()
}

/// A plane of four bytes a texel: what it adds to an image without highlights. Raw are its samples alone.
fn report_words(name: &str, plane: &[f32], words: Vec<u32>, width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let samples = plane.iter().zip(&words).filter(|(inverse, _)| **inverse > 0.0);
    let raw: Vec<u8> = samples.flat_map(|(_, word)| word.to_le_bytes()).collect();
    let dull = DepthImage { normal_oct16: Some(vec![0; plane.len()]), ..black(plane, width, height) };
    let specular = SpecularPlanes { reflectance_srgb8_roughness8: words, visibility8: Vec::new() };
    let shiny = DepthImage { specular: Some(specular), ..dull.clone() };
    let without = image_costs(&dull)?;
    let with = image_costs(&shiny)?;
    print_row(name, &raw, with.0 - without.0, with.1 - without.1, with.2 - without.2);
    Ok(())
}

/// Bytes, and seconds to encode and decode.
fn image_costs(image: &DepthImage) -> Result<(usize, f64, f64), Box<dyn Error>> {
    let limits = DecodeLimits::default();
    let encoded = encode_depth_image(image)?;
    let decode = || decode_depth_image(&encoded.header, image.camera, &encoded.payload, &limits);
    decode()?;
    let encode_s = median_secs(|| drop(black_box(encode_depth_image(image))));
    Ok((encoded.payload.len(), encode_s, median_secs(|| drop(black_box(decode())))))
}

fn report_frame(name: &str, colors: &[Vec3], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let srgb = |color: &Vec3| color.to_array().map(depth_image::srgb8_from_linear);
    let rgb: Vec<u8> = colors.iter().flat_map(srgb).collect();
    for codec in [FrameCodec::Lz4, FrameCodec::Jpeg { quality: 90 }] {
        let size_px = UVec2::new(width, height);
        let data = encode_frame(codec, size_px, &rgb)?;
        let limits = DecodeLimits::default();
        decode_frame(codec, size_px, &data, &limits)?;
        let encode_s = median_secs(|| drop(black_box(encode_frame(codec, size_px, &rgb))));
        let decode_s = median_secs(|| drop(black_box(decode_frame(codec, size_px, &data, &limits))));
        print_row(&format!("{name} {codec}"), &rgb, data.len(), encode_s, decode_s);
    }
    Ok(())
}

fn print_row(name: &str, raw: &[u8], packed_bytes: usize, encode_s: f64, decode_s: f64) {
    let lz4_bytes = lz4_flex::block::compress(raw).len();
    let speed_mb_s = |seconds: f64| raw.len() as f64 / seconds / 1e6;
    println!(
        "| {name} | {} | {lz4_bytes} | {packed_bytes} | {:.3} | {:.0} | {:.0} |",
        raw.len(),
        packed_bytes as f64 / lz4_bytes as f64,
        speed_mb_s(encode_s),
        speed_mb_s(decode_s),
    );
}

fn median_secs(mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..101)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
