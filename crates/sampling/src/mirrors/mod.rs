//! Mirrors of a scene, and sample cameras for what they show.

mod choice;
mod directions;
mod groups;
mod rays;
mod resolution;
mod seen;
mod single_pole;

use depth_image::{Aabb, Camera, MAX_MIRROR_CELLS, ROUGHEST_MIRROR};
use scene::{Material, Scene, Texture};

pub use choice::Candidate;
use choice::{Choice, choose};
pub use directions::{faces, looking};
use groups::{Group, Surface, for_each_surface, groups};
use rays::Triangles;

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
    /// What images were chosen from, as far as rays chose.
    pub candidates: Vec<Candidate>,
    /// The shares of mirrored rays that images do not see all the way: of those by which the images were chosen, and of as many
    /// others. `None` where rays did not choose: the mirror moves, few eyes see it, or the scene has too many triangles.
    pub unseen_ratio: Option<[f32; 2]>,
    /// The mean side of the images' texels where mirrored rays end at surfaces: a layered cube whose lines are nearer to one another than
    /// that shows these as finely. `None` where images are asked for by number, and where rays did not choose.
    pub texel_side_m: Option<f32>,
}

/// The mirrors of a scene with the images that are asked for, the largest first, at most [`MAX_MIRROR_CELLS`]; and the number of
/// those beyond.
#[must_use]
pub fn mirrors(scene: &Scene, impostors: Impostors) -> (Vec<Mirror>, usize) {
    let is_mirror: Vec<bool> = scene.materials.iter().map(|material| mirrors_scene(scene, material)).collect();
    let Some(limits) = impostors.limits().filter(|_| is_mirror.contains(&true)) else {
        return (Vec::new(), 0);
    };
    let of_instances = scene.bounds_of_instances();
    let volume = Aabb::of_boxes(&of_instances);
    let each = |each: &mut dyn FnMut(Surface)| for_each_surface(scene, &is_mirror, &of_instances, each);
    let (groups, beyond) = groups(&volume, MAX_MIRROR_CELLS, each);
    let stands = groups.iter().any(|group| !group.moves);
    let triangles = stands.then(|| Triangles::of(scene, volume)).flatten();
    let mirror = |group: &Group| {
        let triangles = triangles.as_ref().filter(|_| !group.moves);
        let Choice { cameras, candidates, unseen_ratio, texel_side_m } =
            choose(group, triangles, limits, (volume.center(), volume.near_m()));
        let bounds = group.bounds.padded(group.bounds.size().length() * MARGIN);
        Mirror { bounds, cameras, candidates, unseen_ratio, texel_side_m }
    };
    (groups.iter().map(mirror).collect(), beyond)
}

fn mirrors_scene(scene: &Scene, material: &Material) -> bool {
    let map = material.metallic_roughness_texture.and_then(|map| scene.textures.get(map.texture as usize));
    material.is_specular() && material.roughness * map.map_or(1.0, least_roughness) < ROUGHEST_MIRROR
}

/// The least green of texels that are spread over a texture.
fn least_roughness(texture: &Texture) -> f32 {
    let [columns, rows] = [texture.width_px, texture.height_px].map(|side| side.clamp(1, TEXELS));
    let texel = |at: u32| {
        let x = (at % columns) * texture.width_px / columns;
        let y = (at / columns) * texture.height_px / rows;
        texture.srgba8.get(4 * (y * texture.width_px + x) as usize + 1).copied().unwrap_or(u8::MAX)
    };
    f32::from((0..columns * rows).map(texel).min().unwrap_or(u8::MAX)) / 255.0
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;
    use glam::{UVec2, Vec3};
    use scene::{Instance, Limits, MissingTextures, Wind};

    use super::*;

    fn mirrors(scene: &Scene) -> (Vec<Mirror>, usize) {
        super::mirrors(scene, Impostors::default())
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
            assert!(!mirror.cameras.is_empty());
            for camera in mirror.cameras.iter().map(Camera::reference) {
                let off_m = (camera.eye_in_world - middle).dot(facing);
                assert!(off_m.abs() < 0.01, "{off_m} m off its plane");
                assert!(camera.near_m < 0.02 && mirror.bounds.grown_to(camera.eye_in_world) == mirror.bounds);
                assert!(camera.forward_in_world().dot(facing) > -0.01, "towards the other mirror");
            }
        }
    }

    #[test]
    fn few_images_see_what_rays_off_a_mirror_meet() {
        for name in ["teapot-mirror", "mirror-pair", "mirror-hall"] {
            for mirror in mirrors(&scene(name)).0 {
                let [chosen, fresh] = mirror.unseen_ratio.expect("it stands still");
                println!("{name}: {} images leave {chosen}, of fresh rays {fresh}", mirror.cameras.len());
                // The ball between the two mirrors hides what is behind it.
                assert!((1..=8).contains(&mirror.cameras.len()) && chosen <= 0.02, "{name}: {chosen}");
                assert!(mirror.cameras.iter().all(|camera| camera.pinhole().is_some()), "{name}: no single pole");
                assert!((fresh - chosen).abs() < 0.01, "{name}: {fresh}, promised {chosen}");
            }
        }
    }

    #[test]
    fn images_are_as_many_as_asked_for() {
        let teapot = scene("teapot-mirror");
        assert_eq!(super::mirrors(&teapot, Impostors::None), (Vec::new(), 0));
        let unseen = [1, 2, 4, 8].map(|images| {
            let mirror = super::mirrors(&teapot, Impostors::Pinholes { images }).0.remove(0);
            // An image that sees nothing new is left out.
            assert!(mirror.cameras.len() == images as usize || images == 8);
            mirror.unseen_ratio.expect("it stands still")[0]
        });
        println!("unseen by 1, 2, 4 and 8 images: {unseen:?}");
        assert!(unseen.is_sorted_by(|a, b| a >= b) && unseen[0] > 0.2, "{unseen:?}");
    }

    #[test]
    fn single_poles_stand_around_what_most_rays_meet() {
        let teapot = scene("teapot-mirror");
        let of = |images| super::mirrors(&teapot, Impostors::SinglePoles { images }).0.remove(0);
        for (images, mirror) in [(1, of(1)), (2, of(2))] {
            assert_eq!(mirror.cameras.len(), images);
            for camera in &mirror.cameras {
                let Camera::SinglePole(camera) = camera else { panic!("{camera:?}") };
                camera.validate().expect("a camera");
                // The pole is the middle of the teapot.
                let middle_m = 0.5 * (camera.reference.near_m + camera.farthest_m);
                let pole = camera.reference.ray(camera.pole_px).at(middle_m);
                assert!(pole.distance(Vec3::new(0.0, 1.6, 2.0)) < 1.0, "{pole}");
                // Two images without distortion may see as much from both sides.
                assert!(images == 2 || camera.distortion_px > 0.0, "{camera:?}");
            }
            let [chosen, fresh] = mirror.unseen_ratio.expect("it stands still");
            println!("{images} single poles: {chosen} and {fresh} of rays unseen");
            // Of all rays: those to the floor and to the sky are not seen.
            assert!((chosen - fresh).abs() < 0.03 && chosen < 0.95, "{chosen}, {fresh}");
        }
    }

    #[test]
    fn the_choice_says_what_it_was_made_from() {
        let mirror = mirrors(&scene("teapot-mirror")).0.remove(0);
        let names: Vec<&str> = mirror.candidates.iter().map(|candidate| candidate.name.as_str()).collect();
        for name in ["pinhole:8", "single_pole:1", "single_pole:2"] {
            assert!(names.contains(&name), "{names:?}");
        }
        let chosen = mirror.candidates.iter().find(|candidate| candidate.is_chosen).expect("one is chosen");
        assert_eq!(Some(chosen.unseen_ratio), mirror.unseen_ratio.map(|ratio| ratio[0]));
    }

    /// Images from within a closed shell whose inside is seen show nothing else.
    #[test]
    fn a_mirror_of_which_no_image_sees_anything_has_the_usual_ones() {
        let mut closed = scene("teapot-mirror");
        for material in closed.materials.iter_mut().filter(|material| material.roughness < ROUGHEST_MIRROR) {
            material.double_sided = true;
        }
        for (impostors, images) in [(Impostors::Pinholes { images: 1 }, 1), (Impostors::default(), 8)] {
            let mirror = super::mirrors(&closed, impostors).0.remove(0);
            assert_eq!(mirror.cameras.len(), images);
            assert!(mirror.unseen_ratio.is_none_or(|[chosen, _]| chosen > 0.9), "{:?}", mirror.unseen_ratio);
        }
    }

    /// Between those of what is close to a mirror and those of the far end of the scene.
    #[test]
    fn texels_are_as_large_as_where_rays_end() {
        for name in ["teapot-mirror", "mirror-pair"] {
            for mirror in mirrors(&scene(name)).0 {
                let side_m = mirror.texel_side_m.expect("rays choose");
                let texel_m = |camera: &Camera, way_m: f32| way_m / camera.reference().focal_px.x;
                let size_m = scene(name).bounds().size().length();
                let finest =
                    mirror.cameras.iter().map(|camera| texel_m(camera, 0.02 * size_m)).fold(f32::MAX, f32::min);
                let coarsest = mirror.cameras.iter().map(|camera| texel_m(camera, size_m)).fold(0.0, f32::max);
                println!("{name}: texels of {side_m} m, from {finest} to {coarsest} m");
                assert!(side_m > finest && side_m < coarsest, "{name}: {side_m}");
            }
        }
        let asked_for = super::mirrors(&scene("teapot-mirror"), Impostors::Pinholes { images: 4 }).0.remove(0);
        assert_eq!(asked_for.texel_side_m, None);
    }

    #[test]
    fn triangles_on_one_another_do_no_harm() {
        let mut heaped = scene("teapot-mirror");
        let mesh = &mut heaped.meshes[0];
        let heap = [mesh.indices[0]; 60_000];
        mesh.indices.extend(heap);
        mesh.parts.last_mut().expect("a part").index_count += heap.len() as u32;
        assert!(!mirrors(&heaped).0.remove(0).cameras.is_empty());
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
        assert_eq!((mirror.unseen_ratio, mirror.cameras.len()), (None, 8));
    }

    #[test]
    fn six_faces_see_every_direction() {
        let cameras = faces(Vec3::new(1.0, 2.0, 3.0), 0.01, UVec2::splat(64));
        let directions = (0..500).map(|i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            Vec3::new(sin, 0.0, cos) * (1.0 - y * y).sqrt() + Vec3::Y * y
        });
        for direction in directions {
            let point = Vec3::new(1.0, 2.0, 3.0) + direction * 5.0;
            let sees = |camera: &&PinholeCamera| camera.project(point).is_some_and(|at| camera.contains(at.pixel));
            assert!(cameras.iter().any(|camera| sees(&camera)), "{direction}");
        }
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
