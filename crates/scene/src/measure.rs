//! Sizes of a scene.

use depth_image::Aabb;
use glam::{Affine3A, Vec3};

use crate::{Mesh, Scene};

impl Scene {
    /// The box around all surfaces at every scene time, including the wind's sway. Empty for a scene without vertices.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let boxes = self.instances.iter().filter_map(|instance| {
            let mesh = self.meshes.get(instance.mesh as usize)?;
            Some(self.mesh_bounds_in_world(mesh, instance.world_from_mesh))
        });
        boxes.filter(|b| !b.is_empty()).fold(Aabb::EMPTY, |all, b| all.grown_to(b.min).grown_to(b.max))
    }

    fn mesh_bounds_in_world(&self, mesh: &Mesh, world_from_mesh: Affine3A) -> Aabb {
        let points = mesh.vertices.iter().map(|v| world_from_mesh.transform_point3(Vec3::from(v.position)));
        let at_rest = Aabb::around(points);
        let sway = mesh.vertices.iter().fold(0.0f32, |most, v| most.max(v.sway));
        let reach = self.wind.map_or(Vec3::ZERO, |w| (w.direction_in_world * w.amplitude_m * sway).abs());
        Aabb { min: at_rest.min - reach, max: at_rest.max + reach }
    }

    /// Triangles as drawn: a mesh's count once for each of its instances.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let of = |mesh: u32| self.meshes.get(mesh as usize).map_or(0, Mesh::triangle_count);
        self.instances.iter().map(|i| of(i.mesh)).sum()
    }

    /// Returns whether the picture depends on scene time.
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.wind.is_some_and(|w| w.amplitude_m > 0.0)
            && self.meshes.iter().any(|m| m.vertices.iter().any(|v| v.sway > 0.0))
    }
}

impl Mesh {
    /// Triangles of one instance.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.indices.len() as u64 / 3
    }
}
