//! The surfaces of a scene on the host, for rays.

use depth_image::Ray;
use render::scalar;
use scene::Scene;

use crate::failures::stand::Stand;
use crate::graph::Met;

/// A scene's triangles in a tree.
pub struct Surfaces(scalar::rays::Scene);

impl Surfaces {
    /// # Errors
    /// The device, which builds the tree, fails.
    pub fn new(stand: &Stand, scene: &Scene) -> anyhow::Result<Self> {
        Ok(Self(scalar::rays::Scene::of(&stand.upload(scene)?, 0.0)?))
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

    /// Whether a surface, whichever way it faces, lies between two parameters.
    pub fn meet_any(&self, ray: &Ray, [near, far]: [f32; 2]) -> bool {
        let beyond = Ray { origin_in_world: ray.at(near), ..*ray };
        self.0.is_blocked(&beyond, far - near)
    }
}
