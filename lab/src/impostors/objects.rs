//! Which pixels of a mirror show an object: the scene is painted, objects in red and the ground in blue.

use depth_image::{Environment, Illumination, ROUGHEST_MIRROR, View};
use glam::Vec3;
use scene::{Material, Scene};

const OBJECT_SRGBA8: [u8; 4] = [255, 0, 0, 255];
const GROUND_SRGBA8: [u8; 4] = [0, 0, 255, 255];
/// What rises from the lowest point by more than this share of the scene's height is no ground.
const GROUND: f32 = 1e-3;
/// More red than blue, in codes: neither ground nor sky.
const LEAST_CODES: u8 = 8;

/// The scene without light, in which all but mirrors shines in the colour of its kind.
pub fn painted(scene: &Scene) -> Scene {
    let mut painted = scene.clone();
    let bounds = scene.bounds();
    let ground_y = bounds.min.y + GROUND * bounds.size().y;
    for instance in &scene.instances {
        for vertex in &mut painted.meshes[instance.mesh as usize].vertices {
            let in_world = instance.world_from_mesh.transform_point3(Vec3::from(vertex.position));
            vertex.color_srgba8 = if in_world.y > ground_y { OBJECT_SRGBA8 } else { GROUND_SRGBA8 };
        }
    }
    for material in painted.materials.iter_mut().filter(|material| material.roughness >= ROUGHEST_MIRROR) {
        *material = Material { unlit: true, double_sided: material.double_sided, ..Material::default() };
    }
    painted.illumination = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) };
    painted.background = Environment::uniform(Vec3::ZERO);
    painted
}

/// Pixels that show an object in a mirror, from views of the painted scene without and with reflections.
pub fn is_of_object(without: &View, with: &View) -> Vec<bool> {
    let pixels = without.srgb8.as_chunks::<3>().0.iter().zip(with.srgb8.as_chunks::<3>().0);
    pixels.map(|(before, after)| before != after && after[0] > after[2].saturating_add(LEAST_CODES)).collect()
}
