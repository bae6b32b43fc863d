//! A furnished room with pictures and sculptures, lit by the sun and the sky through its windows and by glowing lamps: most of its
//! light is indirect.

mod art;
mod furniture;
mod room;

use depth_image::{Environment, Illumination, Light};
use glam::{Affine3A, Mat3, Vec3};

use super::geometry::{MeshBuilder, matt};
use crate::{Material, Scene, SourceCamera};

const EYE: Vec3 = Vec3::new(4.3, 1.65, 2.9);
const TARGET: Vec3 = Vec3::new(-2.2, 1.35, -1.0);
const FOV_Y_RAD: f32 = 1.0;

/// About 80,000 triangles.
#[must_use]
pub fn gallery() -> Scene {
    let mut builder = MeshBuilder::default();
    room::add(&mut builder);
    furniture::add(&mut builder);
    art::add(&mut builder);
    builder.finish_part(0);
    furniture::add_leaves(&mut builder);
    builder.finish_part(1);
    furniture::add_lanterns(&mut builder);
    builder.finish_part(2);
    art::add_ring(&mut builder);
    builder.finish_part(3);
    let leaves = Material { double_sided: true, ..matt("leaves") };
    let materials = vec![matt("matt"), leaves, glowing("lantern", [4.0, 2.9, 1.7]), glowing("ring", [4.5, 0.7, 2.0])];
    let mut scene = builder.into_scene_of("gallery", materials);
    let sun = Light::Directional {
        towards_light_in_world: Vec3::new(0.42, 0.68, -0.6).normalize_or(Vec3::Y),
        irradiance_linear: Vec3::new(9.0, 8.2, 7.0),
        angular_radius_rad: 0.01,
    };
    let environment = Environment::gradient(Vec3::new(1.7, 2.2, 3.2), Vec3::new(1.0, 0.94, 0.82));
    scene.illumination = Illumination { lights: vec![sun], environment };
    // As bright as a picture shows it beside the room.
    scene.background = Environment::gradient(Vec3::new(0.62, 0.82, 1.2), Vec3::new(0.42, 0.4, 0.34));
    let back = (EYE - TARGET).normalize_or(Vec3::Z);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let turned = Mat3::from_cols(right, back.cross(right), back);
    let world_from_camera = Affine3A::from_mat3_translation(turned, EYE);
    scene.cameras = vec![SourceCamera { name: "entrance".into(), world_from_camera, fov_y_rad: FOV_Y_RAD }];
    scene
}

fn glowing(name: &str, radiance: [f32; 3]) -> Material {
    Material { base_color_linear: [0.0, 0.0, 0.0, 1.0], emissive_linear: Vec3::from(radiance), ..matt(name) }
}

#[cfg(test)]
mod tests {
    use super::room::{HALF_LENGTH_M, HALF_WIDTH_M};
    use super::*;

    #[test]
    fn the_gallery_is_a_closed_room_but_for_its_windows() {
        let scene = gallery();
        let triangles = scene.triangle_count();
        assert!((50_000..150_000).contains(&triangles), "{triangles} triangles");
        let volume = scene.bounds();
        assert!(volume.min.cmple(-Vec3::new(HALF_LENGTH_M, 0.0, HALF_WIDTH_M)).all(), "{volume:?}");
        assert!(scene.vertices_in_world().all(Vec3::is_finite));
        let eye = scene.cameras[0].world_from_camera.translation;
        assert!(Vec3::from(eye).distance(EYE) < 1e-6);
        let glowing = scene.materials.iter().filter(|material| material.emissive_linear != Vec3::ZERO);
        assert_eq!(glowing.count(), 2);
    }
}
