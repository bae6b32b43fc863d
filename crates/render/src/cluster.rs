//! Clusters: neighbouring triangles of one mesh part, small enough to be culled together.

use depth_image::{Aabb, ParallelCamera, PinholeCamera};
use glam::{Vec3, Vec4};
use scene::{Mesh, MeshPart};

/// Small enough to cull well, large enough that draws stay few.
const TRIANGLES_A_CLUSTER: usize = 1024;

/// Triangles `first_triangle..first_triangle + triangle_count` of a mesh, in its new order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cluster {
    pub first_triangle: u32,
    pub triangle_count: u32,
    pub material: u32,
    pub bounds_in_mesh: Aabb,
}

/// Orders the triangles of each part along a Morton curve and cuts them into clusters.
pub(crate) fn clustered(mesh: &Mesh) -> (Vec<u32>, Vec<Cluster>) {
    let bounds = Aabb::around(mesh.vertices.iter().map(|v| v.position.into()));
    let mut indices = Vec::with_capacity(mesh.indices.len());
    let mut clusters = Vec::new();
    for part in &mesh.parts {
        let triangles = morton_ordered(mesh, part, &bounds);
        for chunk in triangles.chunks(TRIANGLES_A_CLUSTER) {
            let first_triangle = (indices.len() / 3) as u32;
            indices.extend(chunk.iter().flatten());
            let corners = chunk.iter().flatten().map(|&i| mesh.vertices[i as usize].position.into());
            clusters.push(Cluster {
                first_triangle,
                triangle_count: chunk.len() as u32,
                material: part.material,
                bounds_in_mesh: Aabb::around(corners),
            });
        }
    }
    (indices, clusters)
}

fn morton_ordered(mesh: &Mesh, part: &MeshPart, bounds: &Aabb) -> Vec<[u32; 3]> {
    let range = part.first_index as usize..(part.first_index + part.index_count) as usize;
    let scale = 1023.0 / bounds.size().max(Vec3::splat(1e-20));
    let mut triangles: Vec<[u32; 3]> = mesh.indices[range].as_chunks().0.to_vec();
    triangles.sort_by_cached_key(|triangle| {
        let center = triangle.iter().map(|&i| Vec3::from(mesh.vertices[i as usize].position)).sum::<Vec3>() / 3.0;
        let cell = ((center - bounds.min) * scale).as_uvec3();
        spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
    });
    triangles
}

/// Spreads the low ten bits three apart.
fn spread(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// The four sides and the near plane of a camera; a point is inside where all are positive.
#[derive(Clone, Copy)]
pub(crate) struct Frustum([Vec4; 5]);

impl Frustum {
    pub fn of(camera: &PinholeCamera) -> Self {
        let [u, v, w] = camera.homogeneous_pixel_from_world();
        let size = camera.size_px.as_vec2();
        Self([u, w * size.x - u, v, w * size.y - v, w - Vec4::W * camera.near_m])
    }

    /// The lines of a parallel camera, from its reference plane on.
    pub fn of_lines(camera: &ParallelCamera) -> Self {
        let [right, down, forward] = camera.axes_in_world();
        let size_m = camera.size_px.as_vec2() * camera.spacing_m;
        let sides = [(right, 0.0), (-right, -size_m.x), (down, 0.0), (-down, -size_m.y), (forward, 0.0)];
        Self(sides.map(|(axis, least_m)| axis.extend(-axis.dot(camera.corner_in_world) - least_m)))
    }

    /// True for a box of which some may be seen.
    pub fn may_see(&self, bounds: &Aabb) -> bool {
        self.0.iter().all(|plane| {
            let normal = plane.truncate();
            let farthest = Vec3::select(normal.cmpge(Vec3::ZERO), bounds.max, bounds.min);
            normal.dot(farthest) + plane.w >= 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    #[test]
    fn a_frustum_keeps_visible_boxes_and_drops_hidden_ones() {
        let camera = PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, UVec2::new(200, 100));
        let frustum = Frustum::of(&camera);
        let at = |p: Vec3| Aabb { min: p - 0.1, max: p + 0.1 };
        assert!(frustum.may_see(&at(Vec3::new(0.0, 0.0, -2.0))));
        assert!(!frustum.may_see(&at(Vec3::new(0.0, 0.0, 2.0))));
        assert!(!frustum.may_see(&at(Vec3::new(5.0, 0.0, -2.0))));
        assert!(!frustum.may_see(&at(Vec3::new(0.0, -3.0, -2.0))));
    }

    #[test]
    fn lines_meet_the_boxes_between_their_first_and_their_last() {
        let camera = ParallelCamera {
            corner_in_world: Vec3::new(-1.0, 2.0, 0.0),
            world_from_camera: glam::Quat::IDENTITY,
            spacing_m: 0.5,
            size_px: UVec2::new(4, 8),
            range_m: 10.0,
        };
        let frustum = Frustum::of_lines(&camera);
        let may_see = |x, y, z| frustum.may_see(&Aabb { min: Vec3::new(x, y, z) - 0.1, max: Vec3::new(x, y, z) + 0.1 });
        assert!(may_see(0.0, 0.0, -5.0) && may_see(0.95, -1.95, -0.1) && may_see(-1.05, 2.05, -5.0));
        assert!(!may_see(1.2, 0.0, -5.0) && !may_see(-1.2, 0.0, -5.0));
        assert!(!may_see(0.0, 2.2, -5.0) && !may_see(0.0, -2.2, -5.0) && !may_see(0.0, 0.0, 0.2));
    }
}
