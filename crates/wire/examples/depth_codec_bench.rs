//! What the codecs cost and save, on one core.
//!
//! `cargo run --release -p wire --example depth_codec_bench [-- PLANE.f32 WIDTH HEIGHT]...`
//!
//! Without arguments it takes a made-up tree over terrain; a file holds inverse depths per metre as
//! little-endian `f32`, rows top-down, 0 for background, negative for holes. Speeds are of the 16-bit
//! plane's bytes (colour: 32-bit; frames: 24-bit), quantising and LZ4 included, medians.

use std::{error::Error, hint::black_box, time::Instant};

use depth_image::{Camera, DepthImage, PinholeCamera, rgb9e5_from_linear};
use glam::{UVec2, Vec3};
use wire::{
    DecodeLimits, FrameCodec, PlaneSet, decode_depth_image, decode_depth_plane, decode_frame, encode_depth_image,
    encode_depth_plane, encode_frame, inverse_depth_codes,
};

#[path = "../src/codec/test_planes.rs"]
#[allow(dead_code)] // The tests use more of it.
mod test_planes;

fn main() -> Result<(), Box<dyn Error>> {
    println!("| what | raw bytes | raw LZ4 | ours | of LZ4 | encode MB/s | decode MB/s |");
    println!("|---|---|---|---|---|---|---|");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.is_empty() {
        for (width, height) in [(400, 300), (1024, 1024)] {
            report("tree", &test_planes::tree_over_terrain(width, height, 1), width as u32, height as u32)?;
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
    let mut random = test_planes::Random::new(2);
    let shade = |&inverse: &f32| {
        let light = inverse * (1.5 + 0.02 * random.unit());
        if inverse > 0.0 { Vec3::new(light, light * 1.3, light * 0.4) } else { Vec3::ZERO }
    };
    let colors: Vec<Vec3> = plane.iter().map(shade).collect();
    report_color(&format!("{name} {width}×{height} colour"), plane, &colors, width, height)?;
    report_frame(&format!("{name} {width}×{height} frame"), &colors, width, height)
}

fn report_depth(name: &str, plane: &[f32], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let limits = DecodeLimits::default();
    let raw: Vec<u8> = inverse_depth_codes(plane).iter().flat_map(|code| code.to_le_bytes()).collect();
    let encoded = encode_depth_plane(plane);
    decode_depth_plane(&encoded, width, height, &limits)?;
    let encode_s = median_secs(|| drop(black_box(encode_depth_plane(black_box(plane)))));
    let decode_s = median_secs(|| drop(black_box(decode_depth_plane(black_box(&encoded), width, height, &limits))));
    print_row(name, &raw, encoded.packed.len(), encode_s, decode_s);
    Ok(())
}

/// The colour plane's share of a whole image: what it adds to an image without colours.
fn report_color(name: &str, plane: &[f32], colors: &[Vec3], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let size_px = UVec2::new(width, height);
    let image = DepthImage {
        camera: Camera::Pinhole(PinholeCamera::looking_at(Vec3::Y, Vec3::ZERO, Vec3::Y, 0.8, size_px)),
        inverse_depth_per_m: plane.to_vec(),
        color_rgb9e5: colors.iter().map(|&color| rgb9e5_from_linear(color)).collect(),
        normal_oct16: None,
        surface_id: None,
    };
    let limits = DecodeLimits::default();
    let encoded = encode_depth_image(&image, PlaneSet::ALL)?;
    let decode = || decode_depth_image(&encoded.header, image.camera, &encoded.payload, &limits);
    decode()?;
    let depth = encode_depth_plane(plane);
    let encode_s = median_secs(|| drop(black_box(encode_depth_image(&image, PlaneSet::ALL))))
        - median_secs(|| drop(black_box(encode_depth_plane(plane))));
    let decode_s = median_secs(|| drop(black_box(decode())))
        - median_secs(|| drop(black_box(decode_depth_plane(&depth, width, height, &limits))));
    let raw: Vec<u8> = image.color_rgb9e5.iter().flat_map(|color| color.to_le_bytes()).collect();
    print_row(name, &raw, encoded.payload.len() - depth.packed.len(), encode_s, decode_s);
    Ok(())
}

fn report_frame(name: &str, colors: &[Vec3], width: u32, height: u32) -> Result<(), Box<dyn Error>> {
    let srgb = |color: &Vec3| color.to_array().map(depth_image::srgb8_from_linear);
    let rgb: Vec<u8> = colors.iter().flat_map(srgb).collect();
    for codec in [FrameCodec::Lz4, FrameCodec::Jpeg { quality: 90 }] {
        let frame = encode_frame(codec, width, height, &rgb)?;
        let limits = DecodeLimits::default();
        decode_frame(&frame, &limits)?;
        let encode_s = median_secs(|| drop(black_box(encode_frame(codec, width, height, &rgb))));
        let decode_s = median_secs(|| drop(black_box(decode_frame(&frame, &limits))));
        print_row(&format!("{name} {codec}"), &rgb, frame.data.len(), encode_s, decode_s);
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
