//! Resources that variants are bound to in tests.

use std::sync::Arc;

use depth_image::EnvironmentMap;
use glam::{UVec2, Vec3};
use gpu::{
    Binding, DevicePreference, Gpu, GpuEnvironment, ShaderInterface, ShaderSource, ShaderVariant, Templates, source,
};
use wgpu::BufferUsages;

use crate::redundancy_test::{Evidence, RedundancyTest};
use crate::surfaces::{SurfaceKind, SurfacePool, Surfaces};
use crate::{GpuScene, shaders::templates};

const NEVER: &str = "fn is_redundant_with(c: Candidate, number: u32, camera: KnownCamera) -> bool { return false; }";

/// A test that finds nothing redundant.
pub(crate) const TEST: RedundancyTest =
    RedundancyTest { shader: "never.wgsl", consults: Evidence::Samples, from_one_place: false, usefulness: None };

pub(crate) fn test_templates() -> Templates {
    templates(&[(TEST.shader, NEVER)]).expect("templates")
}

pub(crate) struct TestStage {
    pub gpu: Arc<Gpu>,
    pub buffer: wgpu::Buffer,
    pub scene: GpuScene,
    pub environment: GpuEnvironment,
    surfaces: SurfacePool,
    templates: Templates,
}

impl TestStage {
    pub fn new() -> Self {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let map = EnvironmentMap::new(UVec2::ONE, &[Vec3::ONE]).expect("a texel");
        Self {
            buffer: gpu.buffer_with("any", &[0_u32; 64], BufferUsages::STORAGE | BufferUsages::UNIFORM),
            scene: GpuScene::upload(&gpu, &fixtures::unit_cube()).expect("a scene"),
            environment: GpuEnvironment::upload(&gpu, &map).expect("a map"),
            surfaces: SurfacePool::new(&gpu),
            templates: test_templates(),
            gpu,
        }
    }

    pub fn surfaces(&self, by_rays: bool, surface_id: bool) -> Surfaces {
        let kind = SurfaceKind {
            size_px: UVec2::ONE,
            by_rays,
            surface_id,
            triangle_normal: true,
            first_surface: true,
            front: true,
        };
        self.surfaces.lend(kind, None)
    }

    /// Fails unless the bindings name all variables of a group, each once.
    pub fn check(&self, variant: &impl ShaderVariant, group: u32, bindings: &[Binding<'_>]) {
        let ShaderSource { name, template, wgsl, traits } = source(&self.templates, variant).expect("a text");
        let interface = ShaderInterface::of(template, &wgsl, traits).unwrap_or_else(|error| panic!("{name}: {error}"));
        interface.check(group, bindings).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
