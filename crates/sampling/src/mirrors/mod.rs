//! Mirrors of a scene, and sample cameras for what they show.

mod groups;
mod pinholes;
mod single_poles;

use depth_image::{Aabb, Camera, MAX_MIRROR_CELLS, ROUGHEST_MIRROR};
use scene::{Material, Scene, Texture};

use groups::{Group, groups, surfaces};

use crate::impostors::Impostors;

/// Boxes are wider than their mirrors on each side, in diagonals: depths of samples have errors.
const MARGIN: f32 = 0.01;
/// Texels of a roughness map that are looked at, along each side.
const TEXELS: u32 = 64;

/// A group of mirrors.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    /// Holds its surfaces at all moments.
    pub bounds: Aabb,
    /// For images of what it shows, of sizes in proportion. The mirror itself is not seen from within.
    pub cameras: Vec<Camera>,
}

/// The mirrors of a scene with the images that are asked for, the largest first, at most [`MAX_MIRROR_CELLS`]; and the number of
/// those beyond.
#[must_use]
pub fn mirrors(scene: &Scene, impostors: Impostors) -> (Vec<Mirror>, usize) {
    let is_mirror: Vec<bool> = scene.materials.iter().map(|material| mirrors_scene(scene, material)).collect();
    if impostors == Impostors::None || !is_mirror.contains(&true) {
        return (Vec::new(), 0);
    }
    let bounds_of_instances = scene.bounds_of_instances();
    let volume = Aabb::of_boxes(&bounds_of_instances);
    let mut groups = groups(&volume, &surfaces(scene, &is_mirror, &bounds_of_instances));
    let beyond = groups.len().saturating_sub(MAX_MIRROR_CELLS);
    groups.truncate(MAX_MIRROR_CELLS);
    let objects = match impostors {
        Impostors::SinglePoles { .. } => single_poles::objects(scene, &is_mirror, &bounds_of_instances),
        Impostors::None | Impostors::Pinholes { .. } => Vec::new(),
    };
    let mirrors = groups.iter().map(|group| Mirror {
        bounds: group.bounds.padded(group.bounds.size().length() * MARGIN),
        cameras: cameras(group, &volume, &objects, impostors),
    });
    (mirrors.collect(), beyond)
}

fn cameras(group: &Group, volume: &Aabb, objects: &[Aabb], impostors: Impostors) -> Vec<Camera> {
    match impostors {
        Impostors::None => Vec::new(),
        Impostors::Pinholes { images } => pinholes::around(group, volume, images),
        Impostors::SinglePoles { images } => {
            single_poles::around(group, objects, images).unwrap_or_else(|| pinholes::around(group, volume, images))
        }
    }
}

fn mirrors_scene(scene: &Scene, material: &Material) -> bool {
    let map = material.metallic_roughness_texture.and_then(|map| scene.textures.get(map.texture as usize));
    material.is_specular() && material.roughness * map.map_or(1.0, least_roughness) < ROUGHEST_MIRROR
}

/// The least green of texels that are spread over a texture.
fn least_roughness(texture: &Texture) -> f32 {
    let [columns, rows] = [texture.width_px, texture.height_px].map(|side| side.clamp(1, TEXELS));
    let greens = (0..columns * rows).map(|at| {
        let x = (at % columns) * texture.width_px / columns;
        let y = (at / columns) * texture.height_px / rows;
        texture.srgba8.get(4 * (y * texture.width_px + x) as usize + 1).copied().unwrap_or(u8::MAX)
    });
    f32::from(greens.min().unwrap_or(u8::MAX)) / 255.0
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use scene::{Instance, Limits, MissingTextures, Wind};

    use super::*;

    fn mirrors(scene: &Scene) -> (Vec<Mirror>, usize) {
        super::mirrors(scene, Impostors::Pinholes { images: 8 })
    }

    fn scene(name: &str) -> Scene {
        let spec = fixtures::spec(name).expect("a name");
        spec.load(&Limits::default(), MissingTextures::Refuse).expect("a scene")
    }

    #[test]
    fn mirrors_apart_from_each_other_have_a_box_each() {
        let (pebble, beyond) = mirrors(&scene("teapot-mirror"));
        assert_eq!((pebble.len(), beyond), (1, 0));
        let size = pebble[0].bounds.size();
        assert!((5.0..7.0).contains(&size.x) && (5.0..7.0).contains(&size.y), "{size}");
        let (pair, beyond) = mirrors(&scene("mirror-pair"));
        assert_eq!((pair.len(), beyond), (2, 0));
        assert!(pair.iter().all(|mirror| mirror.bounds.size().x < 0.3), "they are flat");
        assert!(pair[0].bounds.center().x * pair[1].bounds.center().x < 0.0, "on both sides");
        assert_eq!(mirrors(&scene("blocks")), (Vec::new(), 0));
    }

    #[test]
    fn the_largest_mirrors_are_followed_and_the_others_are_counted() {
        let mut many = scene("teapot-mirror");
        let first = many.instances[0];
        many.instances = (0..11)
            .map(|number| {
                let size = 1.0 - 0.05 * number as f32;
                let place = glam::Affine3A::from_translation(Vec3::X * (30.0 * number as f32));
                Instance { world_from_mesh: place * glam::Affine3A::from_scale(Vec3::splat(size)), ..first }
            })
            .collect();
        let (followed, beyond) = mirrors(&many);
        assert_eq!((followed.len(), beyond), (MAX_MIRROR_CELLS, 3));
        let places: Vec<f32> = followed.iter().map(|mirror| (mirror.bounds.center().x / 30.0).round()).collect();
        assert_eq!(places, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "the largest first");
    }

    #[test]
    fn images_of_a_flat_mirror_stand_in_its_plane_and_look_off_it() {
        let mut turned = scene("mirror-pair");
        for instance in &mut turned.instances {
            instance.world_from_mesh = glam::Affine3A::from_rotation_y(0.6) * instance.world_from_mesh;
        }
        let across = glam::Quat::from_rotation_y(0.6) * Vec3::X;
        for mirror in mirrors(&turned).0 {
            let middle = mirror.bounds.center();
            let facing = across * -middle.dot(across).signum();
            assert_eq!(mirror.cameras.len(), 8);
            for camera in mirror.cameras.iter().map(Camera::reference) {
                let off_m = (camera.eye_in_world - middle).dot(facing);
                assert!(off_m.abs() < 0.01, "{off_m} m off its plane");
                assert!(camera.near_m < 0.02 && mirror.bounds.grown_to(camera.eye_in_world) == mirror.bounds);
                assert!(camera.forward_in_world().dot(facing) > -0.01, "towards the other mirror");
            }
        }
    }

    #[test]
    fn images_are_as_many_as_asked_for() {
        for name in ["teapot-mirror", "mirror-pair", "mirror-hall"] {
            let scene = scene(name);
            assert_eq!(super::mirrors(&scene, Impostors::None), (Vec::new(), 0));
            for images in 1..=8 {
                let (mirrors, _) = super::mirrors(&scene, Impostors::Pinholes { images });
                assert!(mirrors.iter().all(|mirror| mirror.cameras.len() == images as usize), "{name}: {images}");
            }
        }
    }

    #[test]
    fn single_poles_stand_around_the_largest_object_before_a_mirror() {
        let teapot = scene("teapot-mirror");
        for images in [1, 2] {
            let mirror = super::mirrors(&teapot, Impostors::SinglePoles { images }).0.remove(0);
            assert_eq!(mirror.cameras.len(), images as usize);
            for camera in &mirror.cameras {
                let Camera::SinglePole(camera) = camera else { panic!("{camera:?}") };
                camera.validate().expect("a camera");
                // The pole is the middle of the teapot.
                let middle_m = 0.5 * (camera.reference.near_m + camera.farthest_m);
                let pole = camera.reference.ray(camera.pole_px).at(middle_m);
                assert!(pole.distance(Vec3::new(0.0, 1.6, 2.0)) < 1.0, "{pole}");
                assert!(camera.distortion_px > 0.0, "{camera:?}");
            }
        }
    }

    #[test]
    fn where_no_object_lies_before_a_mirror_pinholes_take_the_place_of_single_poles() {
        let walls = scene("mirror-box");
        let mirrors = |impostors| super::mirrors(&walls, impostors).0;
        assert_eq!(mirrors(Impostors::SinglePoles { images: 2 }), mirrors(Impostors::Pinholes { images: 2 }));
    }

    #[test]
    fn a_mirror_that_moves_has_images_in_all_directions() {
        let mut moving = scene("teapot-mirror");
        moving.wind =
            Some(Wind { direction_in_world: Vec3::X, amplitude_m: 0.1, frequency_hz: 1.0, waves_per_m: Vec3::ZERO });
        for vertex in moving.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices) {
            vertex.sway = 0.1;
        }
        let mirror = mirrors(&moving).0.remove(0);
        let sees_all = Vec3::AXES
            .into_iter()
            .flat_map(|axis| [axis, -axis])
            .all(|axis| mirror.cameras.iter().any(|camera| camera.reference().forward_in_world().dot(axis) > 0.99));
        assert!(sees_all && mirror.cameras.len() == 8);
    }

    #[test]
    fn a_material_mirrors_where_its_roughness_map_is_smooth() {
        let mut textured = scene("blocks");
        let texels = [[0, 200, 0, 255]; 16].as_flattened().to_vec();
        textured.textures.push(Texture { width_px: 4, height_px: 4, is_srgb: false, srgba8: texels });
        let map = (textured.textures.len() as u32 - 1).into();
        textured.materials[0].metallic_roughness_texture = Some(map);
        textured.materials[0].roughness = 1.0;
        assert_eq!(mirrors(&textured).0, []);
        textured.textures.last_mut().expect("a texture").srgba8[4 * 5 + 1] = 20;
        assert!(!mirrors(&textured).0.is_empty());
    }
}
