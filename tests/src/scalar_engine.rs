//! A device made of plain loops: rays against a ball over a floor, and samples splatted into views. Slow,
//! but real: depth images hold true depths, and views are reconstructed from them.

use std::any::Any;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::Duration;

use cluster::{CommonKind, DIRECT, Refinement, SamplePlanes};
use depth_image::{
    Antialias, BACKGROUND_INVERSE_DEPTH, Camera, DepthImage, Environment, Illumination, LayeredDepthImage,
    LayeredLightField, Light, LightFieldCamera, LightPlanes, ParallelCamera, PinholeCamera, PixelDepth, Provenance,
    ProvenanceKind, Ray, SampleCamera, SampleImage, SampleImages, Texel, ToneMapping, View, ViewPlanes,
    linear_from_rgb9e5, linear_from_srgb8, oct8_from_unit, oct16_from_unit, rgb9e5_from_linear, srgb8_from_linear,
};
use glam::{UVec2, Vec2, Vec3};
use node::{CommonSet, DirectWork, Engine, EngineError, SampleSet, SampleWork, SharedSet, Turn, UploadedSet, ViewWork};
use parking_lot::{Condvar, Mutex};

/// The floor's colour.
pub const FLOOR_LINEAR: Vec3 = Vec3::new(0.1, 0.6, 0.2);
/// The colour of rays that leave the scene.
pub const SKY_LINEAR: Vec3 = Vec3::new(0.0, 0.0, 0.25);

/// The ball's radius.
pub const BALL_RADIUS_M: f32 = 0.5;

/// The middle of the ball, which rolls to the right.
#[must_use]
pub fn ball_center(scene_time_s: f32) -> Vec3 {
    Vec3::new(scene_time_s * 0.4 - 0.4, 0.6, 0.0)
}

/// A lamp above the ball, and a sky; the scalar device checks that they arrive and shades with neither.
#[must_use]
pub fn illumination() -> Illumination {
    let lamp = Light::Point { position_in_world: Vec3::Y * 4.0, intensity_linear: Vec3::splat(9.0), radius_m: 0.2 };
    Illumination { lights: vec![lamp], environment: Environment::uniform(SKY_LINEAR) }
}

/// Times of the scene that look different.
const STEPS: u32 = 100;

/// The ball's colour encodes the scene's time and its missing refinement steps, so that a view of two sets shows two
/// colours.
#[must_use]
pub fn ball_linear(scene_time_s: f32, refinement: Refinement) -> Vec3 {
    let lacks = refinement.steps - 1 - refinement.step;
    // Two codes from one time step to the next, so that quantisation keeps neighbours apart.
    let step = (scene_time_s / 0.05).round() as u32 % STEPS;
    Vec3::new(linear_from_srgb8(40 + 2 * step as u8), 0.02, 0.01 + 0.08 * lacks as f32)
}

/// A colour as it arrives in a view.
#[must_use]
pub fn srgb8(linear: Vec3) -> [u8; 3] {
    linear_from_rgb9e5(rgb9e5_from_linear(linear)).to_array().map(srgb8_from_linear)
}

/// Number of times that each image was sampled, by eye and first row, scene time and step.
pub type SampleCounts = HashMap<([u32; 4], u32, Refinement), usize>;

/// Least times of the device, which give it a stated speed on any machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    /// Time of one sample image.
    pub image: Duration,
    /// Time of one reconstructed view.
    pub view: Duration,
    /// Time of one directly drawn view.
    pub direct: Duration,
}

impl Pace {
    /// Times in milliseconds.
    #[must_use]
    pub fn from_ms(image_ms: u64, view_ms: u64) -> Self {
        Self { image: Duration::from_millis(image_ms), view: Duration::from_millis(view_ms), ..Self::default() }
    }
}

/// Work that waits until a test releases it.
#[derive(Debug, Default)]
struct Holds {
    eyes: Vec<Vec3>,
    sizes_px: Vec<UVec2>,
    /// Calls that wait.
    calls: usize,
}

/// A device of plain loops. Clones share their counters.
#[derive(Debug, Clone, Default)]
pub struct ScalarEngine {
    counts: Arc<Mutex<SampleCounts>>,
    scenes: Arc<Mutex<HashSet<String>>>,
    is_lost: Arc<AtomicBool>,
    /// Calls from now on that run out of memory.
    shortages: Arc<AtomicUsize>,
    /// Views of one call that memory has no room for; 0 for any number.
    too_many_views: Arc<AtomicUsize>,
    pace: Arc<Mutex<Pace>>,
    reconstructed: Arc<AtomicUsize>,
    holds: Arc<(Mutex<Holds>, Condvar)>,
}

struct Meets {
    planar_depth_m: f32,
    color_linear: Vec3,
}

fn ball(ray: &Ray, scene_time_s: f32, refinement: Refinement) -> Option<Meets> {
    let nearest = ball_sides(ray, scene_time_s).next()?;
    (nearest > 0.0).then_some(Meets { planar_depth_m: nearest, color_linear: ball_linear(scene_time_s, refinement) })
}

/// Where a ray's line enters the ball and leaves it.
fn ball_sides(ray: &Ray, scene_time_s: f32) -> impl Iterator<Item = f32> {
    let to_eye = ray.origin_in_world - ball_center(scene_time_s);
    let d = ray.direction_in_world;
    let a = d.dot(d);
    let b = to_eye.dot(d);
    let c = to_eye.dot(to_eye) - BALL_RADIUS_M * BALL_RADIUS_M;
    let root = (b * b - a * c).sqrt();
    [(-b - root) / a, (-b + root) / a].into_iter().filter(|t| t.is_finite())
}

fn floor(ray: &Ray) -> Option<Meets> {
    let t = -ray.origin_in_world.y / ray.direction_in_world.y;
    (t > 0.0 && t < 50.0).then_some(Meets { planar_depth_m: t, color_linear: FLOOR_LINEAR })
}

fn first_met(ray: &Ray, scene_time_s: f32, refinement: Refinement) -> Option<Meets> {
    let both = [ball(ray, scene_time_s, refinement), floor(ray)];
    both.into_iter().flatten().min_by(|a, b| a.planar_depth_m.total_cmp(&b.planar_depth_m))
}

fn pixels(size_px: UVec2) -> impl Iterator<Item = Vec2> {
    (0..size_px.y).flat_map(move |y| (0..size_px.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)))
}

fn depth_image(camera: &Camera, scene_time_s: f32, refinement: Refinement) -> DepthImage {
    let meets = |pixel| first_met(&camera.ray(pixel), scene_time_s, refinement);
    let met: Vec<_> = pixels(camera.size_px()).map(meets).collect();
    DepthImage {
        camera: *camera,
        inverse_depth_per_m: met
            .iter()
            .map(|met| met.as_ref().map_or(BACKGROUND_INVERSE_DEPTH, |met| met.planar_depth_m.recip()))
            .collect(),
        color_rgb9e5: met
            .iter()
            .map(|met| rgb9e5_from_linear(met.as_ref().map_or(SKY_LINEAR, |met| met.color_linear)))
            .collect(),
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

/// The same image with its colours as the light of lamps.
fn with_light(image: DepthImage) -> DepthImage {
    let texels = image.color_rgb9e5.len();
    let normals = vec![oct16_from_unit(Vec3::Y); texels];
    let light = LightPlanes {
        triangle_normal_oct16: normals.clone(),
        lamps_rgb9e5: image.color_rgb9e5,
        environment_rgb9e5: vec![rgb9e5_from_linear(Vec3::ZERO); texels],
        share8: Vec::new(),
    };
    DepthImage { color_rgb9e5: Vec::new(), normal_oct16: Some(normals), light: Some(light), ..image }
}

/// The surfaces of the ball and of the floor's upper side on each line.
fn layered_image(camera: &ParallelCamera, scene_time_s: f32, refinement: Refinement) -> LayeredDepthImage {
    let mut first = vec![0];
    let mut met = Vec::new();
    for pixel in pixels(camera.size_px) {
        let ray = camera.ray(pixel);
        let mut line: Vec<(f32, Vec3, Vec3)> = ball_sides(&ray, scene_time_s)
            .map(|t| (t, ray.at(t) - ball_center(scene_time_s), ball_linear(scene_time_s, refinement)))
            .chain(floor(&ray).map(|met| (met.planar_depth_m, Vec3::Y, met.color_linear)))
            .filter(|(t, ..)| (0.0..=camera.range_m).contains(t))
            .collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        met.extend(line);
        first.push(met.len() as u32);
    }
    LayeredDepthImage {
        camera: *camera,
        first,
        planar_depth_m: met.iter().map(|met| met.0).collect(),
        plane_normal_oct8: met.iter().map(|met| oct8_from_unit(met.1.normalize_or(Vec3::Y))).collect(),
        color_rgb9e5: met.iter().map(|met| rgb9e5_from_linear(met.2)).collect(),
        normal_oct16: None,
        specular: None,
        truncated: false,
    }
}

/// A view under way: the nearest so far of each pixel.
struct Canvas {
    inverse_depth_per_m: Vec<f32>,
    srgb8: Vec<[u8; 3]>,
    provenance: Vec<Provenance>,
    size_px: UVec2,
}

impl Canvas {
    fn new(camera: &PinholeCamera, background: &Environment) -> Self {
        let size_px = camera.size_px;
        let texels = camera.pixel_count();
        let towards = |pixel| camera.ray(pixel).direction_in_world.normalize_or_zero();
        Self {
            inverse_depth_per_m: vec![0.0; texels],
            srgb8: pixels(size_px).map(|pixel| srgb8(background.radiance_linear(towards(pixel)))).collect(),
            provenance: vec![Provenance::EMPTY; texels],
            size_px,
        }
    }

    fn put(&mut self, pixel: Vec2, planar_depth_m: f32, color_linear: Vec3, camera: usize) {
        let at = (pixel.y as u32 * self.size_px.x + pixel.x as u32) as usize;
        if planar_depth_m.recip() > self.inverse_depth_per_m[at] {
            self.inverse_depth_per_m[at] = planar_depth_m.recip();
            self.srgb8[at] = srgb8(color_linear);
            self.provenance[at] = Provenance::new(ProvenanceKind::Hit, 1 << camera);
        }
    }

    fn view(self, planes: ViewPlanes) -> View {
        View {
            size_px: self.size_px,
            srgb8: self.srgb8.concat(),
            inverse_depth_per_m: planes.inverse_depth.then_some(self.inverse_depth_per_m),
            provenance: planes.provenance.then_some(self.provenance),
        }
    }
}

fn splat(set: &SampleSet, camera: &PinholeCamera, planes: ViewPlanes) -> View {
    let mut canvas = Canvas::new(camera, &set.background);
    for (index, image) in set.images.depth().iter().enumerate() {
        let size_px = image.size_px();
        for (x, y) in (0..size_px.y).flat_map(|y| (0..size_px.x).map(move |x| (x, y))) {
            let (Texel::Sample { color_linear, .. }, Some(point)) = (image.texel(x, y), image.sample_in_world(x, y))
            else {
                continue;
            };
            let light = || Some(image.light.as_ref()?.lamps_rgb9e5[(y * size_px.x + x) as usize]);
            let Some(color_linear) = color_linear.or_else(|| light().map(linear_from_rgb9e5)) else { continue };
            if let Some(at) = camera.project(point).filter(|at| camera.contains(at.pixel)) {
                canvas.put(at.pixel, at.planar_depth_m, color_linear, index);
            }
        }
    }
    if let SampleImages::Cube(cube) = &set.images {
        cube.images.iter().enumerate().for_each(|(index, image)| splat_layers(&mut canvas, camera, image, index));
    }
    canvas.view(planes)
}

/// Nothing mirrors.
fn no_light(camera: &LightFieldCamera) -> LayeredLightField {
    LayeredLightField {
        camera: *camera,
        first: vec![0; camera.line_count() + 1],
        planar_depth_m: Vec::new(),
        radiance_rgb9e5: Vec::new(),
    }
}

fn splat_layers(canvas: &mut Canvas, camera: &PinholeCamera, image: &LayeredDepthImage, index: usize) {
    for (line, pixel) in pixels(image.camera.size_px).enumerate() {
        for sample in image.line(line) {
            let at = PixelDepth { pixel, planar_depth_m: image.planar_depth_m[sample] };
            if let Some(at) = camera.project(image.camera.unproject(at)).filter(|at| camera.contains(at.pixel)) {
                canvas.put(at.pixel, at.planar_depth_m, linear_from_rgb9e5(image.color_rgb9e5[sample]), index);
            }
        }
    }
}

fn draw(camera: &PinholeCamera, scene_time_s: f32, planes: ViewPlanes) -> View {
    let mut canvas = Canvas::new(camera, &Environment::uniform(SKY_LINEAR));
    for pixel in pixels(camera.size_px) {
        if let Some(met) = first_met(&camera.ray(pixel), scene_time_s, Refinement::default()) {
            canvas.put(pixel, met.planar_depth_m, met.color_linear, 0);
        }
    }
    canvas.view(planes)
}

/// A view whose colour is the mean, in linear light, over the positions within its pixels, as its tone shows it.
fn averaged(camera: &PinholeCamera, planes: ViewPlanes, view_of: impl Fn(&PinholeCamera) -> View) -> View {
    if planes.antialias == Antialias::NONE && planes.tone == ToneMapping::NONE {
        return view_of(camera);
    }
    let views: Vec<View> =
        planes.antialias.offsets_px().map(|offset_px| view_of(&camera.with_offset(offset_px))).collect();
    let mean = |byte: usize| {
        let sum: f32 = views.iter().map(|view| linear_from_srgb8(view.srgb8[byte])).sum();
        sum / views.len() as f32
    };
    let shown = |pixel: usize| planes.tone.srgb8(Vec3::from([0, 1, 2].map(|channel| mean(3 * pixel + channel))));
    View { srgb8: (0..camera.pixel_count()).flat_map(shown).collect(), ..view_of(camera) }
}

struct Uploaded {
    set: SampleSet,
    /// What its mirror cells show.
    mirrored: Vec<[u8; 3]>,
}
impl UploadedSet for Uploaded {}

fn uploaded(set: &dyn UploadedSet) -> Result<&Uploaded, EngineError> {
    let any: &dyn Any = set;
    any.downcast_ref().ok_or_else(|| EngineError::Device("a set of another device".to_owned()))
}

/// The method of shared light, with a quality behind a colon. Its views show the samples' colours, as those of `splat` do.
pub const LIGHT_CACHE: &str = "light_cache";

fn known(field: &'static str, value: &str, known: &str) -> Result<(), EngineError> {
    if value == known {
        Ok(())
    } else {
        Err(EngineError::InvalidArgument { field, reason: format!("{value} is unknown, {known} is known") })
    }
}

impl ScalarEngine {
    /// The samples since the last call.
    #[must_use]
    pub fn take_counts(&self) -> SampleCounts {
        std::mem::take(&mut self.counts.lock())
    }

    /// Views reconstructed since the last call.
    #[must_use]
    pub fn take_reconstructed(&self) -> usize {
        self.reconstructed.swap(0, Ordering::Relaxed)
    }

    /// Sets the device's least times.
    pub fn keep_pace(&self, pace: Pace) {
        *self.pace.lock() = pace;
    }

    fn pace(&self) -> Pace {
        *self.pace.lock()
    }

    /// Sampling of images from `eye` waits.
    pub fn hold_samples_from(&self, eye: Vec3) {
        self.holds.0.lock().eyes.push(eye);
    }

    /// Reconstruction of views of a size waits.
    pub fn hold_views_of(&self, size_px: UVec2) {
        self.holds.0.lock().sizes_px.push(size_px);
    }

    /// The number of calls that wait.
    #[must_use]
    pub fn held_calls(&self) -> usize {
        self.holds.0.lock().calls
    }

    /// Lets all calls go on.
    pub fn release(&self) {
        let (holds, released) = &*self.holds;
        let mut holds = holds.lock();
        (holds.eyes, holds.sizes_px) = (Vec::new(), Vec::new());
        released.notify_all();
    }

    fn wait_while(&self, is_held: impl Fn(&Holds) -> bool) {
        let (holds, released) = &*self.holds;
        let mut holds = holds.lock();
        while is_held(&holds) {
            holds.calls += 1;
            released.wait(&mut holds);
            holds.calls -= 1;
        }
    }

    /// A new device in place of one that is lost.
    #[must_use]
    pub fn opened(&self) -> Self {
        self.evict_scenes();
        self.is_lost.store(false, Ordering::Relaxed);
        self.clone()
    }

    /// Loses the device.
    pub fn lose(&self) {
        self.is_lost.store(true, Ordering::Relaxed);
    }

    /// The next calls run out of memory.
    pub fn run_short(&self, calls: usize) {
        self.shortages.store(calls, Ordering::Relaxed);
    }

    /// From now on a call for this number of views or more runs out of memory.
    pub fn run_short_for(&self, views: usize) {
        self.too_many_views.store(views, Ordering::Relaxed);
    }

    /// Scenes leave the device.
    pub fn evict_scenes(&self) {
        self.scenes.lock().clear();
    }

    fn works(&self) -> Result<(), EngineError> {
        self.has_room_for(0)?;
        let is_lost = self.is_lost.load(Ordering::Relaxed);
        if is_lost { Err(EngineError::Lost("as a test wanted".to_owned())) } else { Ok(()) }
    }

    fn has_room_for(&self, views: usize) -> Result<(), EngineError> {
        let most = self.too_many_views.load(Ordering::Relaxed);
        let next = |calls: usize| calls.checked_sub(1);
        let is_short = self.shortages.fetch_update(Ordering::Relaxed, Ordering::Relaxed, next).is_ok();
        if is_short || (most > 0 && views >= most) {
            return Err(EngineError::OutOfMemory("as a test wanted".to_owned()));
        }
        Ok(())
    }

    fn loaded(&self, hash: &str) -> Result<(), EngineError> {
        self.works()?;
        if self.has_scene(hash) { Ok(()) } else { Err(EngineError::UnknownScene { hash: hash.to_owned() }) }
    }
}

impl Engine for ScalarEngine {
    fn device_name(&self) -> String {
        "scalar loops".to_owned()
    }

    fn is_software(&self) -> bool {
        true
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError> {
        if !package.starts_with(b"ball over floor") {
            return Err(EngineError::InvalidArgument { field: "package", reason: "is no scene of mine".to_owned() });
        }
        self.scenes.lock().insert(hash.to_owned());
        Ok(())
    }

    fn has_scene(&self, hash: &str) -> bool {
        self.scenes.lock().contains(hash)
    }

    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError> {
        match sampling {
            "in_order" => Ok(true),
            "cube" => Ok(false),
            _ => known("sampling", sampling, "conventional").map(|()| false),
        }
    }

    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError> {
        Ok(sampling == "conventional" || sampling == "cube")
    }

    fn sample_planes(&self, method: &str) -> Result<SamplePlanes, EngineError> {
        match method.strip_prefix(LIGHT_CACHE) {
            Some(_) => Ok(SamplePlanes { light: true, ..SamplePlanes::default() }),
            None if method == DIRECT => Ok(SamplePlanes::default()),
            None => known("method", method, "splat").map(|()| SamplePlanes::default()),
        }
    }

    fn sample(&self, request: &SampleWork, _: Turn) -> Result<Vec<SampleImage>, EngineError> {
        self.loaded(&request.scene_hash)?;
        self.images_are_sequential(&request.sampling)?;
        known("lighting", &request.lighting, "unlit")?;
        let cameras = request.wanted.iter().filter_map(|&tile| request.camera_of_tile(tile));
        let cameras: Vec<SampleCamera> = cameras.collect();
        let eye = |camera: &SampleCamera| match camera {
            SampleCamera::Depth(camera) => camera.reference().eye_in_world.extend(camera.reference().principal_px.y),
            SampleCamera::Layered(camera) => camera.corner_in_world.extend(camera.world_from_camera.w),
            SampleCamera::LightField(camera) => camera.bounds.center().extend(camera.first_pair as f32),
        };
        for camera in &cameras {
            let image = (eye(camera).to_array().map(f32::to_bits), request.scene_time_s.to_bits(), request.refinement);
            *self.counts.lock().entry(image).or_default() += 1;
        }
        let is_held = |camera: &SampleCamera, holds: &Holds| holds.eyes.contains(&eye(camera).truncate());
        self.wait_while(|holds| cameras.iter().any(|camera| is_held(camera, holds)));
        let image = |camera: &SampleCamera| match camera {
            SampleCamera::Depth(camera) => {
                let image = depth_image(camera, request.scene_time_s, request.refinement);
                SampleImage::Depth(if request.planes.light { with_light(image) } else { image })
            }
            SampleCamera::Layered(camera) => {
                SampleImage::Layered(layered_image(camera, request.scene_time_s, request.refinement))
            }
            SampleCamera::LightField(camera) => SampleImage::LightField(no_light(camera)),
        };
        sleep(self.pace().image * cameras.len() as u32);
        Ok(cameras.iter().map(image).collect())
    }

    fn upload(&self, set: &SampleSet, _: Turn) -> Result<SharedSet, EngineError> {
        self.works()?;
        if set.illumination != illumination() {
            return Err(EngineError::InvalidArgument {
                field: "illumination",
                reason: "is not the scene's".to_owned(),
            });
        }
        Ok(Arc::new(Uploaded { set: set.clone(), mirrored: Vec::new() }))
    }

    /// The first pixels of its views show what the mirrors' images show in their middle, one pixel a mirror cell. A base must be
    /// a cube.
    fn with_common(&self, set: SharedSet, common: Vec<CommonSet>) -> Result<SharedSet, EngineError> {
        self.works()?;
        let (bases, others): (Vec<_>, Vec<_>) = common.into_iter().partition(|(cell, _)| cell.kind == CommonKind::Base);
        let mirrors: Vec<CommonSet> = others.into_iter().filter(|(cell, _)| cell.kind != CommonKind::Block).collect();
        for (_, base) in &bases {
            if !matches!(uploaded(base.as_ref())?.set.images, SampleImages::Cube(..)) {
                return Err(EngineError::Device("a base without a cube".to_owned()));
            }
        }
        let shown = |(_, mirror): &CommonSet| {
            let image = &uploaded(mirror.as_ref())?.set.images.depth()[0];
            let middle = image.size_px() / 2;
            Ok(srgb8(linear_from_rgb9e5(image.color_rgb9e5[(middle.y * image.size_px().x + middle.x) as usize])))
        };
        let mirrored = mirrors.iter().map(shown).collect::<Result<_, EngineError>>()?;
        Ok(Arc::new(Uploaded { set: uploaded(set.as_ref())?.set.clone(), mirrored }))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, _: Turn) -> Result<Vec<View>, EngineError> {
        self.works()?;
        self.has_room_for(work.cameras.len())?;
        self.sample_planes(&work.method)?;
        let Uploaded { set, mirrored } = uploaded(set)?;
        self.wait_while(|holds| work.cameras.iter().any(|camera| holds.sizes_px.contains(&camera.size_px)));
        sleep(self.pace().view * work.cameras.len() as u32);
        self.reconstructed.fetch_add(work.cameras.len(), Ordering::Relaxed);
        let mut views: Vec<View> =
            work.cameras.iter().map(|camera| averaged(camera, work.planes, |c| splat(set, c, work.planes))).collect();
        views.iter_mut().for_each(|view| view.srgb8[..3 * mirrored.len()].copy_from_slice(mirrored.as_flattened()));
        Ok(views)
    }

    fn draw_direct(&self, work: &DirectWork, _: Turn) -> Result<Vec<View>, EngineError> {
        self.loaded(&work.scene_hash)?;
        known("lighting", &work.lighting, "unlit")?;
        sleep(self.pace().direct * work.cameras.len() as u32);
        Ok(work
            .cameras
            .iter()
            .map(|camera| averaged(camera, work.planes, |c| draw(c, work.scene_time_s, work.planes)))
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_a_timeline_has_a_colour_of_its_own() {
        let seen = |step: u32| srgb8(ball_linear(step as f32 * 0.05, Refinement::default()));
        let colours: HashSet<[u8; 3]> = (0..STEPS).map(seen).collect();
        assert_eq!(colours.len(), STEPS as usize);
    }
}
