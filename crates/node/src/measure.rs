//! What operations cost on this node, each alone and warm.

use std::time::Instant;

use depth_image::{Camera, PinholeCamera, View};
use tonic::Status;
use wire::codec::{DecodeLimits, EncodedDepthImage, FrameCodec, PlaneSet, decode_depth_image, encode_depth_image};
use wire::{Costs, MeasureCosts, Workload, encode_view};

use crate::{DirectWork, Engine, EngineError, SampleSet, SampleWork, ViewWork};

/// Runs of one operation, after one that does not count.
const RUNS: usize = 3;

/// Why costs could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The device.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// Encoding or decoding; the text names what.
    #[error("codec: {0}")]
    Codec(String),
}

impl From<MeasureError> for Status {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Engine(error) => error.into(),
            MeasureError::Codec(_) => Self::internal(error.to_string()),
        }
    }
}

/// Measures g_s, g_v, c, d and e one after the other. Nothing else may run on the device meanwhile.
///
/// # Errors
/// Where one of the operations fails.
pub fn measure_costs(engine: &dyn Engine, request: &MeasureCosts) -> Result<Costs, MeasureError> {
    let workload = &request.workload;
    let cameras = vec![request.typical_view; request.batch_count as usize];
    let views = f64::from(request.batch_count);
    let sample = sample_work(workload);
    let (images, sample_s) = timed(|| Ok(engine.sample(&sample)?))?;
    let encoded = images
        .iter()
        .map(|image| encode_depth_image(image, PlaneSet::ALL).map_err(codec))
        .collect::<Result<Vec<_>, _>>()?;
    let (set, load_set_s) = timed(|| Ok(engine.upload(&decoded(workload, &encoded)?)?))?;
    let work = ViewWork { cameras: cameras.clone(), method: workload.method.clone(), planes: request.planes };
    let (made, reconstruct_s) = timed(|| Ok(engine.reconstruct(set.as_ref(), &work)?))?;
    let direct = direct_work(workload, cameras, request);
    let ((), direct_s) = timed(|| Ok(engine.draw_direct(&direct).map(drop)?))?;
    Ok(Costs {
        sample_image_s: sample_s / images.len().max(1) as f64,
        direct_view_s: direct_s / views,
        reconstruct_view_s: reconstruct_s / views,
        load_set_s,
        encode_view_s: encode_s(&made, &workload.codec)?,
    })
}

fn codec(error: impl ToString) -> MeasureError {
    MeasureError::Codec(error.to_string())
}

fn sample_work(workload: &Workload) -> SampleWork {
    SampleWork {
        scene_hash: workload.scene.hash.to_string(),
        cameras: workload.sample_cameras.clone(),
        sampling: workload.sampling.clone(),
        lighting: workload.lighting.clone(),
        scene_time_s: workload.timeline.start_s as f32,
    }
}

fn direct_work(workload: &Workload, cameras: Vec<PinholeCamera>, request: &MeasureCosts) -> DirectWork {
    DirectWork {
        scene_hash: workload.scene.hash.to_string(),
        cameras,
        lighting: workload.lighting.clone(),
        scene_time_s: workload.timeline.start_s as f32,
        planes: request.planes,
    }
}

fn decoded(workload: &Workload, encoded: &[EncodedDepthImage]) -> Result<SampleSet, MeasureError> {
    let limits = DecodeLimits::default();
    let decode = |(image, camera): (&EncodedDepthImage, &Camera)| {
        decode_depth_image(&image.header, *camera, &image.payload, &limits).map_err(codec)
    };
    let images = encoded.iter().zip(&workload.sample_cameras).map(decode).collect::<Result<_, _>>()?;
    Ok(SampleSet { images, volume: workload.volume, background_linear: workload.background_linear })
}

fn encode_s(made: &[View], codec_name: &str) -> Result<f64, MeasureError> {
    let frame_codec: FrameCodec = codec_name.parse().map_err(codec)?;
    let Some(view) = made.first() else { return Ok(0.0) };
    let (_, seconds) = timed(|| encode_view(view, frame_codec).map_err(codec))?;
    Ok(seconds)
}

/// The result of one run that does not count, and the median time of those that do.
fn timed<T>(mut run: impl FnMut() -> Result<T, MeasureError>) -> Result<(T, f64), MeasureError> {
    let result = run()?;
    let mut seconds = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let start = Instant::now();
        run()?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    Ok((result, seconds[RUNS / 2]))
}
