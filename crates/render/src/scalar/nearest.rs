//! Every ray against every triangle: for small scenes.

use depth_image::{PinholeCamera, Ray};
use glam::{Vec2, Vec3};
use scene::{Scene, Vertex};

/// The nearest triangle along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The ray's parameter; planar depth for rays of [`PinholeCamera::ray`].
    pub t: f32,
    /// Linear base colour: vertex colour times material.
    pub base_color_linear: Vec3,
    /// Interpolated, towards the viewer, unit length.
    pub normal_in_world: Vec3,
}

/// Tests all triangles of a static scene; backs of single-sided ones are not there.
#[must_use]
pub fn nearest(scene: &Scene, ray: &Ray, near: f32) -> Option<Nearest> {
    let hits = scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        mesh.parts.iter().flat_map(move |part| {
            let range = part.first_index as usize..(part.first_index + part.index_count) as usize;
            let material = &scene.materials[part.material as usize];
            mesh.indices[range].as_chunks::<3>().0.iter().filter_map(move |triangle| {
                let corners = triangle.map(|i| &mesh.vertices[i as usize]);
                let in_world = corners.map(|v| instance.world_from_mesh.transform_point3(v.position.into()));
                let (t, barycentric, front) = intersect(ray, in_world, material.has_two_sides())?;
                let normals = glam::Mat3::from(instance.world_from_mesh.matrix3).inverse().transpose();
                let normal = normals * blend(corners, barycentric, |v| v.normal.into());
                let facing = if front { 1.0 } else { -1.0 };
                let vertex_color = blend(corners, barycentric, |v| {
                    Vec3::from_array([0, 1, 2].map(|i| depth_image::linear_from_srgb8(v.color_srgba8[i])))
                });
                let base = Vec3::from_slice(&material.base_color_linear[..3]) * vertex_color;
                (t > near).then(|| Nearest {
                    t,
                    base_color_linear: base,
                    normal_in_world: normal.normalize_or_zero() * facing,
                })
            })
        })
    });
    hits.min_by(|a, b| a.t.total_cmp(&b.t))
}

fn blend(corners: [&Vertex; 3], barycentric: [f32; 3], value: impl Fn(&Vertex) -> Vec3) -> Vec3 {
    (0..3).map(|i| value(corners[i]) * barycentric[i]).sum()
}

/// Möller-Trumbore; also says whether the front was hit.
fn intersect(ray: &Ray, [a, b, c]: [Vec3; 3], double_sided: bool) -> Option<(f32, [f32; 3], bool)> {
    let ab = b - a;
    let ac = c - a;
    let p = ray.direction_in_world.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 || (determinant < 0.0 && !double_sided) {
        return None;
    }
    let offset = ray.origin_in_world - a;
    let u = offset.dot(p) / determinant;
    let q = offset.cross(ab);
    let v = ray.direction_in_world.dot(q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    inside.then(|| (ac.dot(q) / determinant, [1.0 - u - v, u, v], determinant > 0.0))
}

/// Inverse depths of a whole image, 0 where nothing is met.
#[must_use]
pub fn inverse_depth_per_m(scene: &Scene, camera: &PinholeCamera) -> Vec<f32> {
    let pixels =
        (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| Vec2::new(x as f32, y as f32) + 0.5));
    pixels.map(|pixel| nearest(scene, &camera.ray(pixel), camera.near_m).map_or(0.0, |hit| hit.t.recip())).collect()
}
