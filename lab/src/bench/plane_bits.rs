//! Bits of depth images by plane, and the time of packing them on one core.
//!
//! Sets are three images of 1024² of the scenes of `study sampling`, conventional and non-redundant. Bits are
//! those of the packed planes over the set's samples; milliseconds are medians, of an image.

use std::hint::black_box;
use std::time::Instant;

use app_core::exit::Outcome;
use app_core::setup::DeviceArgs;
use clap::Args;
use codec::{DecodeLimits, EncodedImage, PlaneKind, PlaneSet, decode_depth_image, encode_depth_image};
use depth_image::DepthImage;
use engine::GpuEngine;
use glam::UVec2;
use render::SamplePlanes;
use report::{Cell, Table};
use sampling::{Redundancy, SamplingMethod};

use crate::sampling_study::{SCENES, Subject};
use crate::statistics::median;

const SIZE_PX: UVec2 = UVec2::splat(1024);
const METHODS: [SamplingMethod; 2] = [SamplingMethod::CONVENTIONAL, SamplingMethod::NonRedundant(Redundancy::Pixel)];
const PLANES: [PlaneKind; 3] = [PlaneKind::InverseDepth, PlaneKind::ColorRgb9e5, PlaneKind::Passed1];
const RUNS: usize = 15;

/// Prints the bits of each plane of depth images, and the time of packing them on one core.
#[derive(Debug, Args)]
pub struct PlaneBitsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Only these scenes of `study sampling`
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
}

/// Measures and prints the table.
///
/// # Errors
/// The device or the codec fails.
pub fn run(args: &PlaneBitsArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let mut table = Table::new(
        "Bits a sample",
        &[
            ("scene", ""),
            ("sampling", ""),
            ("samples", ""),
            ("samples a run", ""),
            ("depth", ""),
            ("colour", ""),
            ("passed", ""),
            ("all", ""),
            ("a set", "kB"),
            ("encode", "ms"),
            ("decode", "ms"),
        ],
    );
    for scene in SCENES.iter().filter(|scene| args.scenes.is_empty() || args.scenes.iter().any(|name| name == *scene)) {
        let subject = Subject::load(&engine, scene)?;
        for method in METHODS {
            let images = subject.sample(method, SIZE_PX, SamplePlanes::default())?;
            let head = [scene.to_string().into(), method.to_string().into()];
            table.push(head.into_iter().chain(numbers(&images)?))?;
        }
    }
    println!("{}", table.to_text());
    Ok(Outcome::Done)
}

fn numbers(images: &[DepthImage]) -> anyhow::Result<Vec<Cell>> {
    let encoded = images.iter().map(|image| encode_depth_image(image, PlaneSet::DEPTH_COLOR));
    let encoded = encoded.collect::<Result<Vec<_>, _>>()?;
    let samples: usize = images.iter().map(samples).sum();
    let runs: usize = images.iter().map(sample_runs).sum();
    let bits = |bytes: usize| 8.0 * bytes as f64 / samples as f64;
    let bytes: usize = encoded.iter().map(|image| image.payload.len()).sum();
    let [encode_ms, decode_ms] = times_ms(images, &encoded)?;
    let mut cells = vec![samples.into(), (samples as f64 / runs as f64).into()];
    cells.extend(PLANES.map(|kind| bits(encoded.iter().map(|image| plane_bytes(image, kind)).sum()).into()));
    cells.extend([bits(bytes), bytes as f64 / 1e3, encode_ms, decode_ms].map(Cell::from));
    Ok(cells)
}

fn samples(image: &DepthImage) -> usize {
    image.inverse_depth_per_m.iter().filter(|&&inverse| inverse > 0.0).count()
}

/// The number of runs of samples along the rows.
fn sample_runs(image: &DepthImage) -> usize {
    let is_sample = |inverse: &f32| *inverse > 0.0;
    image.inverse_depth_per_m.chunk_by(|a, b| is_sample(a) == is_sample(b)).filter(|run| is_sample(&run[0])).count()
}

fn plane_bytes(image: &EncodedImage, kind: PlaneKind) -> usize {
    let planes = image.header.planes.iter().filter(|plane| plane.kind == kind);
    planes.map(|plane| plane.packed_bytes as usize).sum()
}

/// Milliseconds to encode and to decode an image.
fn times_ms(images: &[DepthImage], encoded: &[EncodedImage]) -> anyhow::Result<[f64; 2]> {
    let limits = DecodeLimits::default();
    let decode = |(image, encoded): (&DepthImage, &EncodedImage)| {
        decode_depth_image(&encoded.header, image.camera, &encoded.payload, &limits)
    };
    images.iter().zip(encoded).try_for_each(|pair| decode(pair).map(drop))?;
    let encode_all = || {
        images.iter().for_each(|image| drop(black_box(encode_depth_image(image, PlaneSet::DEPTH_COLOR))));
    };
    let decode_all = || images.iter().zip(encoded).for_each(|pair| drop(black_box(decode(pair))));
    Ok([median_ms(encode_all), median_ms(decode_all)].map(|set_ms| set_ms / images.len() as f64))
}

fn median_ms(run: impl Fn()) -> f64 {
    let timed = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e3
    };
    median((0..RUNS).map(timed).collect())
}
