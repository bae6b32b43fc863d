//! The common ground of all tests here: one device, scenes with sample images, and a comparison of views.

use std::sync::{Arc, OnceLock};

use depth_image::{
    Aabb, Camera, DepthImage, Environment, Highlight, Illumination, PinholeCamera, ProvenanceKind, View, ViewPlanes,
};
use glam::{UVec2, Vec3};
use gpu::{DevicePreference, Gpu, Turn};
use reconstruction::{
    ReconstructRequest, ReconstructionError, ReconstructionMethod, Reconstructor, SampleSet, SetDescription,
};
use render::{DrawWork, Evidence, GpuScene, Lighting, RedundancyTest, Renderer, SamplePlanes, Visibility};
use scene::Scene;

pub const SAMPLE_PX: UVec2 = UVec2::new(96, 72);
pub const VIEW_PX: UVec2 = UVec2::new(64, 48);
pub const CARVE: ReconstructionMethod = ReconstructionMethod::JointCarve { stop_level: 0 };
pub const SEARCH: ReconstructionMethod = ReconstructionMethod::LightFieldSearch { steps: 64 };

/// The redundancy test of sampling `non_redundant:pixel`.
const APART: (&str, &str) = ("apart.wgsl", include_str!("../../../sampling/src/methods/non_redundant/pixel.wgsl"));

struct Device {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    reconstructor: Reconstructor,
}

/// The software device of this program; a test without one fails.
fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let renderer = Renderer::new(&gpu, render::templates(&[APART]).expect("templates"));
        let reconstructor = Reconstructor::new(&gpu).expect("a reconstructor");
        Device { gpu, renderer, reconstructor }
    })
}

pub fn gpu() -> &'static Arc<Gpu> {
    &device().gpu
}

pub fn reconstruct(
    set: &SampleSet,
    cameras: &[PinholeCamera],
    method: ReconstructionMethod,
    planes: ViewPlanes,
) -> Result<Vec<View>, ReconstructionError> {
    reconstructor().reconstruct(ReconstructRequest { planes, ..ReconstructRequest::new(set, cameras, method) })
}

pub fn reconstructor() -> &'static Reconstructor {
    &device().reconstructor
}

pub fn renderer() -> &'static Renderer {
    &device().renderer
}

static DARK: Illumination = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) };

/// A set in which nothing depends on the viewer.
pub fn matt(volume: Aabb, background: Environment) -> SetDescription<'static> {
    SetDescription { volume, background, illumination: &DARK, highlight: None, environment: None, mips: false }
}

/// A scene and depth images of it.
#[derive(Clone)]
pub struct Stage {
    pub scene: Scene,
    pub images: Vec<DepthImage>,
    pub volume: Aabb,
}

impl Stage {
    pub fn new(scene: Scene, cameras: &[PinholeCamera]) -> Self {
        let images = depth_images(&scene, cameras, SamplePlanes::default());
        let volume = scene.bounds();
        Self { scene, images, volume }
    }

    /// With images that have normals and texel corners.
    pub fn with_corners(scene: Scene, cameras: &[PinholeCamera]) -> Self {
        let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
        let images = depth_images(&scene, cameras, planes);
        let volume = scene.bounds();
        Self { scene, images, volume }
    }

    /// With images that omit what those before them hold.
    pub fn apart(scene: Scene, cameras: &[PinholeCamera]) -> Self {
        let on_device = GpuScene::upload(&device().gpu, &scene).expect("a scene");
        let cameras: Vec<Camera> = cameras.iter().map(|camera| Camera::Pinhole(*camera)).collect();
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let test = RedundancyTest { shader: APART.0, consults: Evidence::SurfaceIds, from_one_place: false };
        let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
        let work = plainly_lit(&on_device);
        let images = device().renderer.draw_image_sequence(work, &cameras, &wanted, planes, test);
        Self { images: images.expect("depth images"), volume: scene.bounds(), scene }
    }

    pub fn upload(&self) -> SampleSet {
        reconstructor().upload(&self.images, &self.description(), Turn::default()).expect("a sample set")
    }

    pub fn description(&self) -> SetDescription<'static> {
        matt(self.volume, self.scene.background)
    }

    pub fn views(&self, cameras: &[PinholeCamera], method: ReconstructionMethod) -> Vec<View> {
        reconstruct(&self.upload(), cameras, method, ViewPlanes::ALL).expect("views")
    }

    pub fn view(&self, camera: &PinholeCamera, method: ReconstructionMethod) -> View {
        self.views(std::slice::from_ref(camera), method).remove(0)
    }

    pub fn twin(&self, camera: &PinholeCamera, method: ReconstructionMethod) -> View {
        reconstruction::scalar::reconstruct(&self.images, &self.description(), camera, method)
    }

    /// From the triangles.
    pub fn drawn_directly(&self, camera: &PinholeCamera) -> View {
        let scene = GpuScene::upload(&device().gpu, &self.scene).expect("a scene");
        let work = plainly_lit(&scene);
        device().renderer.draw_views(work, &[*camera], ViewPlanes::ALL).expect("a view").remove(0)
    }
}

fn depth_images(scene: &Scene, cameras: &[PinholeCamera], planes: SamplePlanes) -> Vec<DepthImage> {
    let scene = GpuScene::upload(&device().gpu, scene).expect("a scene");
    let work = plainly_lit(&scene);
    let cameras: Vec<Camera> = cameras.iter().map(|camera| Camera::Pinhole(*camera)).collect();
    device().renderer.draw_depth_images(work, &cameras, planes).expect("depth images")
}

pub fn looking(eye: Vec3, target: Vec3, fov_y_deg: f32, size_px: UVec2) -> PinholeCamera {
    let up = if (target - eye).normalize_or_zero().y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    PinholeCamera::looking_at(eye, target, up, fov_y_deg.to_radians(), size_px)
}

/// Up to four cameras at the corners of a square around `eye`, and views between them.
pub struct Corners {
    pub eye: Vec3,
    pub target: Vec3,
    pub half_m: f32,
}

impl Corners {
    pub fn camera(&self, x: f32, y: f32, size_px: UVec2) -> PinholeCamera {
        let forward = (self.target - self.eye).normalize_or_zero();
        let right = forward.cross(if forward.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y }).normalize_or_zero();
        let eye = self.eye + (right * x + right.cross(forward) * y) * self.half_m;
        looking(eye, self.target, 45.0, size_px)
    }

    pub fn samples(&self, count: usize) -> Vec<PinholeCamera> {
        let places = [(-1.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)];
        places.iter().take(count).map(|&(x, y)| self.camera(x, y, SAMPLE_PX)).collect()
    }

    pub fn view(&self) -> PinholeCamera {
        self.camera(0.23, -0.31, VIEW_PX)
    }
}

/// The small scenes, each with where its cameras stand.
pub fn corpus() -> Vec<(&'static str, Scene, Corners)> {
    use fixtures::{poles, quad, uv_sphere};
    use scene::procedural::{courtyard, tree_terrain};
    let red = [200, 60, 40];
    vec![
        ("uv-sphere", uv_sphere(1.0, 32), Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 }),
        ("poles", poles(0.08), Corners { eye: Vec3::Z * 4.0, target: Vec3::Z * -2.0, half_m: 0.6 }),
        ("courtyard", courtyard(), Corners { eye: Vec3::new(2.0, 9.0, 9.0), target: Vec3::ZERO, half_m: 1.0 }),
        ("quad", quad(Vec3::ZERO, 1.0, Vec3::Z, red), Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.5 }),
        (
            "tree-terrain-30k",
            tree_terrain(30_000, 1),
            Corners { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::Y * 0.3, half_m: 0.4 },
        ),
    ]
}

pub fn kinds(view: &View) -> Vec<ProvenanceKind> {
    view.provenance.as_ref().expect("provenance").iter().map(|p| p.kind()).collect()
}

pub fn depths(view: &View) -> &[f32] {
    view.inverse_depth_per_m.as_deref().expect("depth")
}

pub fn count(view: &View, kind: ProvenanceKind) -> usize {
    kinds(view).into_iter().filter(|&k| k == kind).count()
}

/// How far two views are alike.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Share of the pixels that are of the same kind.
    pub kind: f64,
    /// Pixels that both have for hits.
    pub hits: usize,
    /// Share of those with colours within two codes and depths within a thousandth.
    pub close: f64,
}

impl Agreement {
    pub fn of(a: &View, b: &View) -> Self {
        let ka = kinds(a);
        let kb = kinds(b);
        let same = ka.iter().zip(&kb).filter(|(a, b)| a == b).count();
        let both: Vec<usize> = (0..ka.len()).filter(|&i| [ka[i], kb[i]] == [ProvenanceKind::Hit; 2]).collect();
        let close = both.iter().filter(|&&i| colors_differ_by(a, b, i) <= 2 && depths_agree(a, b, i)).count();
        Self { kind: same as f64 / ka.len() as f64, hits: both.len(), close: close as f64 / both.len().max(1) as f64 }
    }

    pub fn is_good(self) -> bool {
        // In foliage rounding decides some rays: one pixel more than the share may be off.
        let off = self.hits as f64 * (1.0 - self.close);
        self.hits > 100 && self.kind >= 0.995 && off <= 0.01 * self.hits as f64 + 1.0
    }
}

/// The greatest difference among the channels.
pub fn colors_differ_by(a: &View, b: &View, index: usize) -> u8 {
    (0..3).map(|c| a.srgb8[3 * index + c].abs_diff(b.srgb8[3 * index + c])).max().unwrap_or(0)
}

fn depths_agree(a: &View, b: &View, index: usize) -> bool {
    (depths(a)[index] / depths(b)[index] - 1.0).abs() < 1e-3
}

/// Over the pixels of a mask.
pub fn psnr_db(reference: &View, test: &View, mask: &[bool]) -> f64 {
    metrics::psnr_db(reference, test, Some(mask)).expect("equal sizes").expect("pixels")
}

/// Every plane of a view is a picture: finite depths, not negative.
pub fn assert_sane(view: &View, what: &str) {
    assert_eq!(view.srgb8.len(), view.size_px.element_product() as usize * 3, "{what}");
    assert!(depths(view).iter().all(|d| d.is_finite() && *d >= 0.0), "{what}: a depth is not one");
}

pub fn plainly_lit(scene: &GpuScene) -> DrawWork<'_> {
    DrawWork { visibility: Visibility::Triangles, ..DrawWork::new(scene, Lighting::default()) }
}

/// A scene whose surfaces are found by rays, under a lighting.
pub fn work<'a>(scene: &'a GpuScene, lighting: &str) -> DrawWork<'a> {
    DrawWork { lighting: lighting.parse().expect(lighting), visibility: Visibility::Rays, ..plainly_lit(scene) }
}

/// Sets of a scene with mirrors.
pub fn description(scene: &Scene) -> SetDescription<'_> {
    SetDescription {
        volume: scene.bounds(),
        background: scene.background,
        illumination: &scene.illumination,
        highlight: Some(Highlight::Ggx),
        environment: None,
        mips: true,
    }
}
