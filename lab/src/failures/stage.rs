//! A scene with sample images, views of it, and the places of cameras.

use depth_image::{Aabb, DepthImage, Environment, Illumination, PinholeCamera, View, ViewPlanes, nested_places};
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::{ErrorBound, ReconstructRequest, ReconstructionMethod, SampleSet, SetDescription};
use render::{GpuScene, Lighting, SamplePlanes};
use scene::Scene;

use super::measures::foreground;
use super::stand::{Stand, pinholes};

/// The default method.
pub const CARVE: ReconstructionMethod = ReconstructionMethod::JointCarve { stop_level: 0 };
/// Quads between samples.
pub const MESH: ReconstructionMethod = ReconstructionMethod::Mesh;
/// A quad for each sample.
pub const HYBRID: ReconstructionMethod = ReconstructionMethod::HybridMesh { merged: None };

/// The search in this number of steps.
pub fn search(steps: u32) -> ReconstructionMethod {
    ReconstructionMethod::LightFieldSearch { steps }
}

/// Quads that are merged within a bound.
pub fn merged(px: f64) -> ReconstructionMethod {
    ReconstructionMethod::HybridMesh { merged: ErrorBound::from_px(px) }
}

/// Sample sets without lamps and highlights.
pub fn in_the_dark(volume: Aabb, background: Environment) -> SetDescription<'static> {
    SetDescription { volume, background, illumination: &DARK, highlight: None, environment: None, mips: false }
}

static DARK: Illumination = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) };

/// A scene, depth images of it, and the volume in which views look for surfaces.
pub struct Stage<'s> {
    stand: &'s Stand,
    pub scene: GpuScene,
    lighting: Lighting,
    background: Environment,
    pub images: Vec<DepthImage>,
    pub volume: Aabb,
}

impl<'s> Stage<'s> {
    /// The scene in plain light, seen by cameras.
    pub fn new(stand: &'s Stand, scene: &Scene, cameras: &[PinholeCamera]) -> anyhow::Result<Self> {
        Self::with_planes(stand, scene, cameras, SamplePlanes::default())
    }

    /// As [`Stage::new`], with normals and texel corners for all methods.
    pub fn with_corners(stand: &'s Stand, scene: &Scene, cameras: &[PinholeCamera]) -> anyhow::Result<Self> {
        let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
        Self::with_planes(stand, scene, cameras, planes)
    }

    fn with_planes(
        stand: &'s Stand,
        scene: &Scene,
        cameras: &[PinholeCamera],
        planes: SamplePlanes,
    ) -> anyhow::Result<Self> {
        let lighting = Lighting::default();
        let volume = scene.bounds();
        let background = scene.background;
        let scene = stand.upload(scene)?;
        let images = stand.images(&scene, lighting, &pinholes(cameras), planes)?;
        Ok(Self { stand, scene, lighting, background, images, volume })
    }

    /// The same with images in another light, which its true views have too.
    pub fn relit(self, lighting: Lighting, cameras: &[PinholeCamera]) -> anyhow::Result<Self> {
        let images = self.stand.images(&self.scene, lighting, &pinholes(cameras), SamplePlanes::default())?;
        Ok(Self { images, lighting, ..self })
    }

    pub fn set(&self) -> anyhow::Result<SampleSet> {
        let description = in_the_dark(self.volume, self.background);
        Ok(self.stand.reconstructor().upload(&self.images, &description, Turn::default())?)
    }

    /// Views by a method, with depth and provenance.
    pub fn views(&self, cameras: &[PinholeCamera], method: ReconstructionMethod) -> anyhow::Result<Vec<View>> {
        let set = self.set()?;
        let request = ReconstructRequest::new(&set, cameras, method);
        Ok(self.stand.reconstructor().reconstruct(ReconstructRequest { planes: ViewPlanes::ALL, ..request })?)
    }

    /// The foreground FLIP of views by each method.
    pub fn flips<const N: usize>(
        &self,
        cameras: &[PinholeCamera],
        methods: [ReconstructionMethod; N],
    ) -> anyhow::Result<[f64; N]> {
        let truths = self.truth(cameras)?;
        let mut flips = [0.0; N];
        for (flip, method) in flips.iter_mut().zip(methods) {
            *flip = foreground(&truths, &self.views(cameras, method)?)?.flip;
        }
        Ok(flips)
    }

    /// Views from the triangles.
    pub fn truth(&self, cameras: &[PinholeCamera]) -> anyhow::Result<Vec<View>> {
        self.stand.views(&self.scene, self.lighting, cameras, ViewPlanes::ALL)
    }
}

/// A camera with its upper edge up, or towards −Z where it looks down or up.
pub fn looking(eye: Vec3, target: Vec3, fov_y_deg: f32, size_px: UVec2) -> PinholeCamera {
    let up = if (target - eye).normalize_or_zero().y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    PinholeCamera::looking_at(eye, target, up, fov_y_deg.to_radians(), size_px)
}

/// A square view cell around `eye`; its cameras are aimed at one target.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    pub eye: Vec3,
    pub target: Vec3,
    pub half_m: f32,
}

/// Before nine poles.
pub const POLES: Cell = Cell { eye: Vec3::new(0.0, 0.0, 4.0), target: Vec3::new(0.0, 0.0, -2.0), half_m: 0.4 };
/// Above a tree on its terrain.
pub const TREE: Cell = Cell { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::new(0.0, 0.3, 0.0), half_m: 0.3 };
/// Above the courtyard.
pub const YARD: Cell = Cell { eye: Vec3::new(2.0, 9.0, 9.0), target: Vec3::ZERO, half_m: 1.0 };

/// Views within the cell.
const VIEWS: [[f32; 2]; 3] = [[0.23, -0.31], [-0.58, 0.44], [0.71, 0.52]];
const FOV_DEG: f32 = 45.0;

impl Cell {
    /// The camera at a place, in halves of the cell.
    pub fn camera(&self, [x, y]: [f32; 2], size_px: UVec2) -> PinholeCamera {
        let forward = (self.target - self.eye).normalize_or_zero();
        let reference = if forward.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(reference).normalize_or_zero();
        let eye = self.eye + (right * x + right.cross(forward) * y) * self.half_m;
        looking(eye, self.target, FOV_DEG, size_px)
    }

    pub fn samples(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        nested_places(count).iter().map(|place| self.camera(place.to_array(), size_px)).collect()
    }

    pub fn views(&self, size_px: UVec2) -> Vec<PinholeCamera> {
        VIEWS.iter().map(|&place| self.camera(place, size_px)).collect()
    }
}
