//! The errors and the costs of representations, measured on one device.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use codec::{
    DecodeError, DecodeLimits, EncodeError, EncodedImage, FrameCodec, FrameError, decode_depth_image,
    encode_sample_image, encode_view,
};
use depth_image::{DepthImage, PinholeCamera, View, ViewPlanes};
use metrics::MetricsError;
use node::{Engine, EngineError, SampleWork, SharedSet, Turn, ViewWork, own_time};
use planner::{RowCosts, ViewErrors, median};
use rayon::prelude::*;

use crate::errors_of_views::view_errors;
use crate::sets::{SampledSet, SetKey, Sets};
use crate::subject::{Light, Representation, Subject, Viewpoints};

/// Views that are timed at once, at least, unless they are large: a batch has fixed costs.
const TIMED_VIEWS: usize = 16;
/// Views of one call take no longer than this, in s, but for a single one: other work waits for a call, and so does the end of
/// the process.
const CALL_S: f64 = 1.0;
/// True views of one call, which may be lit by many rays.
const TRUTHS_A_CALL: usize = 8;
/// Times that views are drawn directly for their cost.
const DIRECT_RUNS: usize = 3;
/// The most pixels of views that are only timed.
const TIMED_PIXELS: usize = 1 << 20;
/// The bytes of a true view: colour and depth.
const TRUTH_BYTES_PER_PIXEL: usize = 7;
/// The most bytes of true views in memory; beyond, they are drawn again when they are needed.
const MAX_TRUTH_BYTES: usize = 512 << 20;

/// Why a representation cannot be measured.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming")]
pub enum ProbeError {
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error("a sample image cannot be encoded: {0}")]
    Encode(#[from] EncodeError),
    #[error("a sample image cannot be decoded: {0}")]
    Decode(#[from] DecodeError),
    #[error("codec: {0}")]
    Frame(#[from] FrameError),
    #[error("views cannot be compared: {0}")]
    Metrics(#[from] MetricsError),
}

/// The costs of views that are drawn from the scene, in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectCosts {
    /// g_v.
    pub direct_view_s: f64,
    /// e.
    pub encode_view_s: f64,
}

/// Views of a representation, with what they were made of.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The views.
    pub views: Vec<View>,
    /// The sample images as compositors decode them.
    pub sample_images: Vec<DepthImage>,
    /// Bytes of the encoded set.
    pub set_bytes: usize,
    /// The costs, with g_s in the light of the images.
    pub costs: RowCosts,
}

/// Measures representations of one subject. Work is in `turn` among other work of the device, and the time for which it
/// waits does not count. The views of one call have one size.
pub struct Prober {
    engine: Arc<dyn Engine>,
    subject: Subject,
    turn: Turn,
    truths: BTreeMap<(Light, CameraBits), Arc<View>>,
    sets: Sets,
    /// Shaders that are built: the first run of an operation is not timed.
    warm: BTreeSet<String>,
}

/// A camera's numbers, bit by bit.
type CameraBits = Vec<u32>;

impl Prober {
    /// A prober of a subject whose scene is loaded.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>, subject: Subject, turn: Turn) -> Self {
        let warm = BTreeSet::new();
        Self { engine, subject, turn, truths: BTreeMap::new(), sets: Sets::default(), warm }
    }

    /// The subject.
    #[must_use]
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// The errors of a representation on some views in a light, and its costs in the light of the session.
    ///
    /// # Errors
    /// The device fails, or refuses the representation.
    pub fn probe(
        &mut self,
        of: &Representation,
        light: Light,
        cameras: &[PinholeCamera],
    ) -> Result<(Vec<ViewErrors>, RowCosts), ProbeError> {
        let truths = self.truths(light, cameras)?;
        let measured = self.measure(of, light, cameras, self.subject.planes)?;
        let pairs: Vec<_> = cameras.iter().zip(&truths).zip(&measured.views).collect();
        let errors = pairs
            .into_par_iter()
            .map(|((camera, truth), made)| view_errors(camera, truth, made, &measured.sample_images, None));
        let errors = errors.collect::<Result<_, _>>()?;
        let sample_image_s = self.sample_image_s(of, light, measured.costs.sample_image_s)?;
        Ok((errors, RowCosts { sample_image_s, ..measured.costs }))
    }

    /// Views of a representation in a light with some planes, and its costs in that light with these planes.
    ///
    /// # Errors
    /// As [`Prober::probe`].
    pub fn measure(
        &mut self,
        of: &Representation,
        light: Light,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> Result<Measured, ProbeError> {
        let sampled = self.sampled(of, light)?;
        let images = &sampled.images[..of.sample_cameras.len()];
        let (set, load_set_s, view_s) = self.loaded(of, light, planes, images, &cameras[..1])?;
        let views_a_call = views_of(CALL_S, view_s, usize::MAX);
        let mut views = Vec::with_capacity(cameras.len());
        let mut seconds = 0.0;
        let timed = timed_cameras(cameras, views_a_call);
        for cameras in timed.chunks(views_a_call) {
            let work = ViewWork { cameras: cameras.to_vec(), method: of.method.clone(), planes };
            let (made, call_s) = self.timed(|engine, turn| engine.reconstruct(set.as_ref(), &work, turn))?;
            seconds += call_s;
            views.extend(made);
        }
        let reconstruct_view_s = seconds / views.len().max(1) as f64;
        views.truncate(cameras.len());
        Ok(Measured {
            views,
            sample_images: images.to_vec(),
            set_bytes: sampled.encoded_bytes[..images.len()].iter().sum(),
            costs: RowCosts { sample_image_s: sampled.sample_image_s, load_set_s, reconstruct_view_s },
        })
    }

    /// The costs of a representation in the light of the session. Nothing is kept from earlier measurements.
    ///
    /// # Errors
    /// As [`Prober::probe`].
    pub fn time(&mut self, of: &Representation, cameras: &[PinholeCamera]) -> Result<RowCosts, ProbeError> {
        self.sets = Sets::default();
        Ok(self.measure(of, Light::Session, cameras, self.subject.planes)?.costs)
    }

    /// The same views drawn from the scene, with depth.
    ///
    /// # Errors
    /// The device fails.
    pub fn truths(&mut self, light: Light, cameras: &[PinholeCamera]) -> Result<Vec<Arc<View>>, ProbeError> {
        let light = self.same_light(light);
        let keys: Vec<_> = cameras.iter().map(|camera| (light, bits(camera))).collect();
        let mut missing: BTreeMap<_, _> = keys.iter().cloned().zip(cameras.iter().copied()).collect();
        missing.retain(|key, _| !self.truths.contains_key(key));
        let kept_pixels = self.truths.values().map(|view| view.size_px.element_product() as usize);
        let pixels: usize = kept_pixels.chain(missing.values().map(PinholeCamera::pixel_count)).sum();
        if pixels * TRUTH_BYTES_PER_PIXEL > MAX_TRUTH_BYTES {
            self.truths.retain(|key, _| keys.contains(key));
        }
        let (missing, cameras): (Vec<_>, Vec<_>) = missing.into_iter().unzip();
        let planes = ViewPlanes { inverse_depth: true, ..self.subject.planes };
        for (keys, cameras) in missing.chunks(TRUTHS_A_CALL).zip(cameras.chunks(TRUTHS_A_CALL)) {
            let work = self.subject.direct_work(cameras.to_vec(), light, planes);
            let drawn = self.engine.draw_direct(&work, self.turn)?;
            self.truths.extend(keys.iter().cloned().zip(drawn.into_iter().map(Arc::new)));
        }
        Ok(keys.iter().map(|key| self.truths[key].clone()).collect())
    }

    /// The costs of drawing views directly in the light of the session, and of encoding them.
    ///
    /// # Errors
    /// The device fails.
    pub fn direct_costs(&mut self, viewpoints: &Viewpoints, codec: FrameCodec) -> Result<DirectCosts, ProbeError> {
        let planes = self.subject.planes;
        let alone = self.subject.direct_work(viewpoints.first(1), Light::Session, planes);
        let (_, alone_s) = self.median_s(|engine, turn| engine.draw_direct(&alone, turn))?;
        let batch = viewpoints.first(views_of(CALL_S, alone_s, TIMED_VIEWS));
        let batch = self.subject.direct_work(batch, Light::Session, planes);
        let (drawn, direct_s) = self.median_s(|engine, turn| engine.draw_direct(&batch, turn))?;
        let (encoded, encode_s) =
            own_time(self.engine.as_ref(), || drawn.iter().try_for_each(|view| encode_view(view, codec).map(drop)));
        encoded?;
        let views = drawn.len().max(1) as f64;
        Ok(DirectCosts { direct_view_s: direct_s / views, encode_view_s: encode_s / views })
    }

    /// The median time of some runs after a warm-up, in which shaders are built.
    fn median_s<T>(&self, run: impl Fn(&dyn Engine, Turn) -> Result<T, EngineError>) -> Result<(T, f64), ProbeError> {
        let done = run(self.engine.as_ref(), self.turn)?;
        let mut seconds = Vec::with_capacity(DIRECT_RUNS);
        for _ in 0..DIRECT_RUNS {
            seconds.push(self.timed(&run)?.1);
        }
        Ok((done, median(seconds)))
    }

    /// g_s in the light of the session, from as few images as possible if another light was measured.
    fn sample_image_s(&mut self, of: &Representation, light: Light, measured_s: f64) -> Result<f64, ProbeError> {
        if self.same_light(light) == Light::Session {
            return Ok(measured_s);
        }
        let work = self.fewest(self.subject.sample_work(self.engine.as_ref(), of, Light::Session)?)?;
        Ok(self.encoded(&work)?.1)
    }

    /// Images as they leave a sampler, and g_s.
    fn encoded(&mut self, work: &SampleWork) -> Result<(Vec<EncodedImage>, f64), ProbeError> {
        if self.is_first(&format!("sample {} {:?} {}", work.sampling, work.planes, work.lighting)) {
            self.engine.sample(&self.fewest(work.clone())?, self.turn)?;
        }
        let (encoded, seconds) = own_time(self.engine.as_ref(), || {
            let images = self.engine.sample(work, self.turn)?;
            let encoded = images.iter().map(encode_sample_image);
            Ok::<_, ProbeError>(encoded.collect::<Result<Vec<_>, _>>()?)
        });
        let encoded = encoded?;
        let sample_image_s = seconds / encoded.len().max(1) as f64;
        Ok((encoded, sample_image_s))
    }

    /// The fewest images of a set that can be sampled alone.
    fn fewest(&self, work: SampleWork) -> Result<SampleWork, ProbeError> {
        let is_independent = self.engine.images_are_independent(&work.sampling)?;
        Ok(if is_independent { SampleWork { wanted: vec![0], ..work } } else { work })
    }

    /// The set of a representation, at least.
    fn sampled(&mut self, of: &Representation, light: Light) -> Result<Arc<SampledSet>, ProbeError> {
        let work = self.subject.sample_work(self.engine.as_ref(), of, light)?;
        let key = SetKey { sampling: of.sampling.clone(), planes: work.planes, light: self.same_light(light) };
        let is_independent = self.engine.images_are_independent(&of.sampling)?;
        if let Some(set) = self.sets.find(&key, &of.sample_cameras, is_independent) {
            return Ok(set);
        }
        let (encoded, sample_image_s) = self.encoded(&work)?;
        let decoded = encoded.iter().zip(&of.sample_cameras).map(|(image, camera)| {
            decode_depth_image(&image.header, *camera, &image.payload, &DecodeLimits::default())
        });
        let set = Arc::new(SampledSet {
            images: decoded.collect::<Result<_, _>>()?,
            encoded_bytes: encoded.iter().map(|image| image.payload.len()).collect(),
            sample_image_s,
        });
        self.sets.keep(key, set.clone());
        Ok(set)
    }

    /// The set on the device, and d: its upload, and what its first view costs more than others, such as quads; with the time
    /// of a view alone.
    fn loaded(
        &mut self,
        of: &Representation,
        light: Light,
        planes: ViewPlanes,
        images: &[DepthImage],
        first: &[PinholeCamera],
    ) -> Result<(SharedSet, f64, f64), ProbeError> {
        let sample_set = self.subject.sample_set(images, light);
        let one = ViewWork { cameras: first.to_vec(), method: of.method.clone(), planes };
        if self.is_first(&format!("view {} {} {planes:?}", of.method, images.len())) {
            let set = self.engine.upload(&sample_set, self.turn)?;
            self.engine.reconstruct(set.as_ref(), &one, self.turn)?;
        }
        let (set, upload_s) = self.timed(|engine, turn| engine.upload(&sample_set, turn))?;
        let mut view_s = [0.0; 2];
        for seconds in &mut view_s {
            *seconds = self.timed(|engine, turn| engine.reconstruct(set.as_ref(), &one, turn))?.1;
        }
        let [first_s, next_s] = view_s;
        Ok((set, upload_s + (first_s - next_s).max(0.0), next_s))
    }

    /// Two lights of one text are one light.
    fn same_light(&self, light: Light) -> Light {
        if self.subject.lighting == self.subject.screening_lighting { Light::Session } else { light }
    }

    fn is_first(&mut self, operation: &str) -> bool {
        self.warm.insert(operation.to_owned())
    }

    fn timed<T>(&self, run: impl FnOnce(&dyn Engine, Turn) -> Result<T, EngineError>) -> Result<(T, f64), ProbeError> {
        let (done, seconds) = own_time(self.engine.as_ref(), || run(self.engine.as_ref(), self.turn));
        Ok((done?, seconds))
    }
}

/// The views that take no longer than `seconds` together, one at least.
fn views_of(seconds: f64, view_s: f64, most: usize) -> usize {
    ((seconds / view_s.max(1e-3)) as usize).clamp(1, most)
}

/// The cameras, repeated up to the size of a timed batch, or to that of a call where it is smaller.
fn timed_cameras(cameras: &[PinholeCamera], views_a_call: usize) -> Vec<PinholeCamera> {
    let pixels = cameras.first().map_or(1, PinholeCamera::pixel_count).max(1);
    let count = TIMED_VIEWS.min(TIMED_PIXELS / pixels).min(views_a_call).max(cameras.len());
    cameras.iter().copied().cycle().take(count).collect()
}

fn bits(camera: &PinholeCamera) -> CameraBits {
    let PinholeCamera { eye_in_world, world_from_camera, focal_px, principal_px, size_px, near_m } = camera;
    let lens = [focal_px.x, focal_px.y, principal_px.x, principal_px.y, *near_m];
    let floats = eye_in_world.to_array().into_iter().chain(world_from_camera.to_array()).chain(lens);
    floats.map(f32::to_bits).chain(size_px.to_array()).collect()
}
