//! The surfaces of a scene on the host, for rays.

use depth_image::Ray;
use render::{GpuScene, scalar};

use crate::graph::Met;

/// What rays show that leave a scene.
pub const SKY_SRGB: [u8; 3] = [168, 196, 224];

/// A scene's triangles in a tree.
pub struct Surfaces(scalar::rays::Scene);

impl Surfaces {
    /// # Errors
    /// The tree cannot be built.
    pub fn new(scene: &GpuScene) -> anyhow::Result<Self> {
        Ok(Self(scalar::rays::Scene::of(scene, 0.0)?))
    }

    /// The first surface on a ray between two of its parameters, in its own colour.
    pub fn meet(&self, ray: &Ray, [near, far]: [f32; 2]) -> Option<Met> {
        let hit = self.0.closest_between(ray, near, far)?;
        let normal_in_world = self.0.triangle_normal_in_world(&hit);
        Some(Met { t: hit.t, normal_in_world, color_linear: self.0.look(&hit).base_linear })
    }

    /// Whether a surface, whichever way it faces, lies before this parameter.
    pub fn is_blocked(&self, ray: &Ray, far: f32) -> bool {
        self.0.is_blocked(ray, far)
    }
}
