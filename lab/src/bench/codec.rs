//! The packed depth plane against raw LZ4, on the sampled images.

use std::hint::black_box;
use std::time::Instant;

use codec::{DecodeLimits, decode_depth_plane, encode_depth_plane, inverse_depth_codes};
use depth_image::DepthImage;
use report::{Bar, Check, Report, Table};

use crate::statistics::median;

/// Repeats of one coding, some hundred microseconds each.
const RUNS: usize = 25;
const BYTES_A_CODE: f64 = 2.0;

/// Sizes, and megabytes of 16-bit codes a second on one core.
pub fn measure(images: &[DepthImage], report: &mut Report) -> anyhow::Result<()> {
    let limits = DecodeLimits::default();
    let mut table = Table::new(
        "Packed depth planes",
        &[
            ("image", ""),
            ("raw", "bytes"),
            ("raw LZ4", "bytes"),
            ("packed", "bytes"),
            ("encode", "MB/s"),
            ("decode", "MB/s"),
        ],
    );
    let (mut lz4_bytes, mut packed_bytes, mut encode, mut decode) = (0, 0, Vec::new(), Vec::new());
    for (index, image) in images.iter().enumerate() {
        let plane = &image.inverse_depth_per_m;
        let raw: Vec<u8> = inverse_depth_codes(plane).iter().flat_map(|code| code.to_le_bytes()).collect();
        let lz4 = lz4_flex::block::compress(&raw).len();
        let packed = encode_depth_plane(plane);
        let size_px = image.size_px();
        decode_depth_plane(&packed, size_px.x, size_px.y, &limits)?;
        let mb = plane.len() as f64 * BYTES_A_CODE * 1e-6;
        encode.push(mb / median_s(|| drop(black_box(encode_depth_plane(black_box(plane))))));
        decode.push(
            mb / median_s(|| drop(black_box(decode_depth_plane(black_box(&packed), size_px.x, size_px.y, &limits)))),
        );
        lz4_bytes += lz4;
        packed_bytes += packed.packed.len();
        let speeds = [encode[index], decode[index]];
        table.push(
            [index, raw.len(), lz4, packed.packed.len()].map(Into::into).into_iter().chain(speeds.map(Into::into)),
        )?;
    }
    report.tables.push(table);
    report.checks.push(Check::new(
        "packed depth plane, of raw LZ4's bytes",
        packed_bytes as f64 / lz4_bytes as f64,
        "",
        Bar::AtMost(0.5),
    ));
    report.checks.push(Check::new("depth plane, encode on one core", median(encode), "MB/s", Bar::AtLeast(500.0)));
    report.checks.push(Check::new("depth plane, decode on one core", median(decode), "MB/s", Bar::AtLeast(500.0)));
    Ok(())
}

fn median_s(mut run: impl FnMut()) -> f64 {
    let timed = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    median((0..RUNS).map(timed).collect())
}
