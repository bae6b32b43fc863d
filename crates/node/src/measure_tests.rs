//! The number of runs of each operation, on a device with given times.

use std::any::Any;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use cluster::{Refinement, SamplePlanes, SceneHash, SceneRef, Timeline};
use depth_image::{Aabb, DepthImage, Environment, Illumination, SpecularPlanes, ViewPlanes};
use glam::Vec3;

use super::*;
use crate::engine::{CommonSet, EngineError, SharedSet};

/// A device whose calls take given times of its own clock, and none of this machine's; it notes them.
#[derive(Default)]
pub(crate) struct SimulatedDevice {
    sample_s: f64,
    direct_view_s: f64,
    reconstruct_view_s: f64,
    build_s: f64,
    /// Seconds of a texel of an image.
    texel_s: f64,
    takes_light: bool,
    /// Seconds of an image, and of each of its rows; images are then tileable.
    parts_s: Option<(f64, [f64; 4])>,
    clock: SimulatedClock,
    pub(crate) calls: Mutex<Calls>,
}

struct SimulatedClock {
    made_at: Instant,
    worked_s: Mutex<f64>,
}

impl Default for SimulatedClock {
    fn default() -> Self {
        Self { made_at: Instant::now(), worked_s: Mutex::new(0.0) }
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Calls {
    pub(crate) refinements: Vec<Refinement>,
    sampled_px: Vec<UVec2>,
    pub(crate) drawn_views: Vec<usize>,
    pub(crate) reconstructed_views: Vec<usize>,
    pub(crate) uploads: Vec<(Illumination, bool)>,
    /// The bounds of the mirrors of each set that has some.
    pub(crate) mirrors: Vec<Vec<Aabb>>,
}

struct Nothing;
impl UploadedSet for Nothing {}

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(4))
}

fn image(camera: &SampleCamera) -> SampleImage {
    let size_px = camera.size_px();
    let texels = size_px.element_product() as usize;
    SampleImage::Depth(DepthImage {
        camera: *camera.depth().expect("a camera of a view"),
        inverse_depth_per_m: vec![0.5; texels],
        color_rgb9e5: vec![0; texels],
        normal_oct16: Some(vec![0; texels]),
        surface_id: None,
        specular: Some(SpecularPlanes { reflectance_srgb8_roughness8: vec![9; texels], ..SpecularPlanes::default() }),
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    })
}

fn views(cameras: &[PinholeCamera]) -> Vec<View> {
    let view = |camera: &PinholeCamera| View {
        size_px: camera.size_px,
        srgb8: vec![0; 3 * camera.pixel_count()],
        inverse_depth_per_m: None,
        provenance: None,
    };
    cameras.iter().map(view).collect()
}

impl SimulatedDevice {
    fn work(&self, seconds: f64) {
        *self.clock.worked_s.lock().unwrap() += seconds;
    }

    fn sample_parts_s(&self, part: &SampleCamera) -> f64 {
        let Some((image_s, rows_s)) = self.parts_s else { return 0.0 };
        let first =
            (camera().principal_px.y - part.depth().expect("a camera of a view").reference().principal_px.y) as usize;
        image_s + rows_s[first..first + part.size_px().y as usize].iter().sum::<f64>()
    }
}

impl Engine for SimulatedDevice {
    fn device_name(&self) -> String {
        "simulated".to_owned()
    }

    /// All time that passes here and not on the device's clock.
    fn waited_s(&self) -> f64 {
        self.clock.made_at.elapsed().as_secs_f64() - *self.clock.worked_s.lock().unwrap()
    }

    fn is_software(&self) -> bool {
        true
    }

    fn load_scene(&self, _hash: &str, _package: &[u8]) -> Result<(), EngineError> {
        Ok(())
    }

    fn has_scene(&self, _hash: &str) -> bool {
        true
    }

    fn images_are_independent(&self, _: &str) -> Result<bool, EngineError> {
        Ok(self.parts_s.is_some())
    }

    fn images_are_sequential(&self, _: &str) -> Result<bool, EngineError> {
        Ok(false)
    }

    fn sample_planes(&self, _: &str) -> Result<SamplePlanes, EngineError> {
        Ok(SamplePlanes { normals: true, light: self.takes_light, ..SamplePlanes::default() })
    }

    fn sample(&self, request: &SampleWork, _: Turn) -> Result<Vec<SampleImage>, EngineError> {
        let mut calls = self.calls.lock().unwrap();
        calls.refinements.push(request.refinement);
        let cameras = request.wanted.iter().filter_map(|&tile| request.camera_of_tile(tile));
        let cameras: Vec<SampleCamera> = cameras.collect();
        calls.sampled_px.extend(cameras.iter().map(SampleCamera::size_px));
        let parts_s: f64 = cameras.iter().map(|camera| self.sample_parts_s(camera)).sum();
        let texels: usize = cameras.iter().map(SampleCamera::pixel_count).sum();
        self.work(self.sample_s + parts_s + self.texel_s * texels as f64);
        Ok(cameras.iter().map(image).collect())
    }

    fn upload(&self, set: &SampleSet, _: Turn) -> Result<SharedSet, EngineError> {
        let shiny = set.images.depth().iter().all(|image| image.specular.is_some());
        self.calls.lock().unwrap().uploads.push((set.illumination.clone(), shiny));
        Ok(Arc::new(Nothing))
    }

    fn with_common(&self, set: SharedSet, mirrors: Vec<CommonSet>) -> Result<SharedSet, EngineError> {
        self.calls.lock().unwrap().mirrors.push(mirrors.into_iter().map(|(cell, _)| cell.bounds).collect());
        Ok(set)
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, _: Turn) -> Result<Vec<View>, EngineError> {
        let any: &dyn Any = set;
        assert!(any.is::<Nothing>());
        self.calls.lock().unwrap().reconstructed_views.push(work.cameras.len());
        self.work(self.reconstruct_view_s * work.cameras.len() as f64);
        Ok(views(&work.cameras))
    }

    fn draw_direct(&self, work: &DirectWork, _: Turn) -> Result<Vec<View>, EngineError> {
        let mut calls = self.calls.lock().unwrap();
        let build_s = if calls.drawn_views.is_empty() { self.build_s } else { 0.0 };
        calls.drawn_views.push(work.cameras.len());
        self.work(build_s + self.direct_view_s * work.cameras.len() as f64);
        Ok(views(&work.cameras))
    }
}

pub(crate) fn request(batch_count: u32) -> MeasureCosts {
    let lamp = depth_image::Light::Point { position_in_world: Vec3::Y, intensity_linear: Vec3::ONE, radius_m: 0.1 };
    let workload = Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: vec![camera().into(); 2],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "traced".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::default(),
        timeline: Timeline { start_s: 0.0, step_s: 0.0, set_count: 8 },
        illumination: Illumination { lights: vec![lamp], ..Illumination::default() },
        refinement_steps: 4,
        traced_pixel_count: None,
    };
    MeasureCosts {
        workload,
        method: "joint_carve".to_owned(),
        codec: "lz4".to_owned(),
        typical_views: vec![camera()],
        batch_count,
        planes: ViewPlanes::default(),
        in_background: false,
        budget: None,
    }
}

fn measured(engine: SimulatedDevice, batch_count: u32) -> (Costs, Calls) {
    let costs = measure_costs(&engine, &request(batch_count)).unwrap().costs;
    (costs, engine.calls.into_inner().unwrap())
}

/// Within two hundredths: some microseconds pass between a reading of the device's clock and of this machine's.
#[track_caller]
fn assert_near(seconds: f64, expected_s: f64) {
    assert!((seconds / expected_s - 1.0).abs() < 0.02, "{seconds} s, not {expected_s} s");
}

#[test]
fn quick_operations_run_three_times_after_a_warm_up() {
    // The first draw builds shaders for longer than a view may take.
    let engine = SimulatedDevice { direct_view_s: 1e-3, build_s: 0.6, ..SimulatedDevice::default() };
    let (costs, calls) = measured(engine, 32);
    assert_eq!(calls.refinements, [Refinement::default(); 4], "finished, for any number of steps");
    assert_eq!(calls.drawn_views, [1, 1, 1, 1, 32, 32, 32, 32, 1], "the last is for the exposure");
    assert_eq!(calls.reconstructed_views, [1, 1, 1, 1, 32, 32, 32, 32]);
    assert_near(costs.direct_view_s, 1e-3);
    assert_eq!(calls.uploads, vec![(request(1).workload.illumination, true); 4], "with what highlights need");
}

#[test]
fn costs_of_views_with_mirrors_are_those_of_all_their_images() {
    let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    let mirror =
        cluster::CommonCell { kind: cluster::CommonKind::Mirrors, bounds, sampling: "conventional".to_owned() };
    let plain = request(32);
    let workload = plain.workload.clone().with_common_cells(vec![(mirror, vec![camera().into(); 6])]);
    let engine = SimulatedDevice { sample_s: 0.04, ..SimulatedDevice::default() };
    let costs = measure_costs(&engine, &MeasureCosts { workload, ..plain }).unwrap().costs;
    let calls = engine.calls.into_inner().unwrap();
    assert_eq!(calls.mirrors, [vec![bounds]]);
    assert_eq!(calls.uploads.len(), 8, "both sets, four times");
    assert_near(costs.sample_image_s, 0.01); // two calls for eight images
}

#[test]
fn slow_operations_run_once_after_a_warm_up() {
    let slow =
        SimulatedDevice { sample_s: 0.51, direct_view_s: 0.51, reconstruct_view_s: 0.51, ..SimulatedDevice::default() };
    let (costs, calls) = measured(slow, 32);
    assert_eq!((calls.refinements.len(), calls.drawn_views), (2, vec![1, 1, 1]));
    assert_eq!(calls.reconstructed_views, [1, 1]);
    assert_near(costs.reconstruct_view_s, 0.51);
    assert_near(costs.direct_view_s, 0.51);
    assert_near(costs.sample_image_s, 0.255);
}

#[test]
fn large_views_are_measured_in_a_smaller_size() {
    let large = camera().resized(UVec2::new(8192, 4096));
    let smaller = Resized::with_most_pixels(&MeasureCosts { typical_views: vec![large; 2], ..request(1) });
    let [first, second] = smaller.request.typical_views[..] else { panic!() };
    assert_eq!((first, first.size_px), (second, UVec2::new(1448, 724)));
    assert!((smaller.pixels_ratio - 32.0).abs() < 0.02, "{}", smaller.pixels_ratio);
    let engine = SimulatedDevice { direct_view_s: 0.01, ..SimulatedDevice::default() };
    let costs = measure_costs(&engine, &MeasureCosts { typical_views: vec![large], ..request(1) }).unwrap().costs;
    assert_near(costs.direct_view_s, 0.32);
    assert_eq!(Resized::with_most_pixels(&request(1)).pixels_ratio, 1.0);
}

#[test]
fn expensive_light_is_measured_in_a_smaller_size() {
    let large = camera().resized(UVec2::splat(512));
    let mut wanted = MeasureCosts { typical_views: vec![large], ..request(1) };
    wanted.workload.sample_cameras = vec![large.into(); 2];
    let measured = |wanted: &MeasureCosts, texel_s: f64| {
        let engine = SimulatedDevice { texel_s, takes_light: true, ..SimulatedDevice::default() };
        let costs = measure_costs(&engine, wanted).unwrap().costs;
        let sizes_px = engine.calls.into_inner().unwrap().sampled_px;
        (costs.sample_image_s, sizes_px)
    };
    let (image_s, sizes_px) = measured(&wanted, 3.2e-6);
    assert_near(image_s, 0.839);
    assert!(sizes_px.iter().all(|size_px| [64, 128].contains(&size_px.x)), "{sizes_px:?}");
    let (_, sizes_px) = measured(&wanted, 5e-5);
    assert!(sizes_px.iter().all(|size_px| size_px.x == 64), "{sizes_px:?}");
    let (image_s, sizes_px) = measured(&wanted, 3e-8);
    assert_near(image_s, 0.00786);
    assert!(sizes_px.iter().any(|size_px| size_px.x == 512), "cheap light is measured in full size: {sizes_px:?}");
    wanted.workload.sample_cameras = vec![camera().resized(UVec2::splat(60)).into(); 2];
    let least_ratio = least_quick_ratio(&wanted);
    assert!((least_ratio.powi(2) * 60.0 * 60.0 - 3_000.0).abs() < 1.0, "{least_ratio}");
}

#[test]
fn as_many_views_are_drawn_as_time_allows() {
    let views = [1e-9, 0.01, 0.09, 0.3, 0.6, 40.0].map(|alone_s| views_in_time(alone_s, 32));
    assert_eq!(views, [32, 32, 11, 3, 1, 1]);
    assert_eq!((views_in_time(0.0, 32), views_in_time(f64::NAN, 32), views_in_time(0.1, 1)), (32, 1, 1));
}

#[test]
fn the_overhead_of_a_tile_follows_from_tiles_of_two_heights() {
    // A single tile, of any height, would give 0 or 0.053 s.
    let engine = SimulatedDevice { parts_s: Some((0.02, [0.0, 0.0, 0.04, 0.04])), ..SimulatedDevice::default() };
    let (costs, _) = measured(engine, 1);
    assert_near(costs.sample_image_s, 0.1);
    let tiles = costs.tiles.unwrap();
    assert_near(tiles.overhead_s, 0.02);
    let [a, b, c, d] = tiles.row_shares.unwrap();
    assert!(a.max(b) < 0.01 && (0.49..0.51).contains(&c) && (0.49..0.51).contains(&d), "{costs:?}");
}

#[test]
fn two_sizes_tell_what_every_view_takes_from_what_a_pixel_takes() {
    let at = |pixels: f64| TimedSize { pixels, seconds: 0.04 + 1e-6 * pixels };
    assert!((at(3_600.0).at_size(Some(at(14_400.0)), 230_400.0) - at(230_400.0).seconds).abs() < 1e-9);
    let slower = TimedSize { pixels: 3_600.0, seconds: 0.1 };
    assert_eq!(slower.at_size(Some(at(14_400.0)), 230_400.0), 0.1, "a larger view that was timed faster");
    let faster = TimedSize { pixels: 3_600.0, seconds: 0.001 };
    assert!((faster.at_size(Some(at(14_400.0)), 230_400.0) - 0.064).abs() < 1e-9, "no more than in proportion");
}
