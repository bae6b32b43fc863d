//! Images that may surround a mirror, at equal texels.

use depth_image::{Aabb, PinholeCamera};
use glam::{UVec2, Vec3};
use scene::{Material, Scene};

/// Texels of all images of a candidate, about.
const TEXELS: u32 = 1 << 18;
/// The field of view of images that look one way, and of faces, which overlap.
const WIDE_DEG: f32 = 110.0;
const FACE_DEG: f32 = 94.0;
/// How far the corners of a square of cameras lie from its middle, in half widths of the mirror.
const CORNER: f32 = 0.6;
/// Rougher surfaces show the environment alone.
const ROUGHEST: f32 = 0.2;

/// Sample cameras for one mirror.
pub struct Candidate {
    pub name: &'static str,
    pub cameras: Vec<PinholeCamera>,
}

/// Bounds of the triangles of each part of a smooth metal, in world space.
pub fn mirrors(scene: &Scene) -> Vec<Aabb> {
    let is_mirror = |material: &Material| material.roughness < ROUGHEST && material.metallic > 0.5;
    let mut bounds = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        for part in mesh.parts.iter().filter(|part| is_mirror(&scene.materials[part.material as usize])) {
            let corners = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
            let in_world = |&index: &u32| {
                instance.world_from_mesh.transform_point3(Vec3::from(mesh.vertices[index as usize].position))
            };
            bounds.push(Aabb::around(corners.iter().map(in_world)));
        }
    }
    bounds
}

/// All candidates for a mirror within these bounds, which faces `seen`.
pub fn candidates(mirror: &Aabb, seen: Vec3) -> Vec<Candidate> {
    let middle = mirror.center();
    let towards = (seen - middle).normalize_or(Vec3::Z);
    let right = towards.any_orthonormal_vector();
    let up = right.cross(towards);
    let half_m = 0.5 * mirror.size().min_element();
    let corner = |x: f32, y: f32| middle + (right * x + up * y) * (CORNER * half_m);
    let looking = |eye: Vec3, images: u32| camera(eye, towards, WIDE_DEG, images);
    let square = [corner(-1.0, -1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
    let faces = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    vec![
        Candidate { name: "pinhole:1", cameras: vec![looking(middle, 1)] },
        Candidate { name: "pinhole:4", cameras: square.map(|eye| looking(eye, 4)).to_vec() },
        Candidate { name: "six faces", cameras: faces.map(|axis| camera(middle, axis, FACE_DEG, 6)).collect() },
    ]
}

/// A square image; `images` of its size have [`TEXELS`].
fn camera(eye: Vec3, towards: Vec3, fov_deg: f32, images: u32) -> PinholeCamera {
    let side_px = ((TEXELS / images) as f32).sqrt() as u32;
    let up = if towards.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    PinholeCamera::looking_at(eye, eye + towards, up, fov_deg.to_radians(), UVec2::splat(side_px))
}
