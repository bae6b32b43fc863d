//! Images without the pixels that images before them cover.

use depth_image::{Camera, DepthImage, HOLE_INVERSE_DEPTH, PinholeCamera};
use fixtures::{poles, quad};
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, SamplePlanes, Visibility};
use sampling::{Redundancy, Rig, SampleWork, SamplingError, SamplingMethod};
use scene::procedural::courtyard;

use crate::stage::{device, pinholes, unlit, upload};

const SIZE_PX: UVec2 = UVec2::new(80, 60);
const COVERAGE: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Coverage);
const LIGHT: SamplePlanes = SamplePlanes { light: true, ..NONE };
const NONE: SamplePlanes = SamplePlanes {
    antialias: depth_image::Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: false,
    corners: false,
    light: false,
};

fn lit(scene: &GpuScene) -> DrawWork<'_> {
    DrawWork { lighting: "soft 2, occlusion 2".parse().expect("a lighting"), ..unlit(scene) }
}

fn sample(draw: DrawWork<'_>, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    tiles(draw, &pinholes(cameras), 1, &wanted, method).expect("images")
}

fn tiles(
    draw: DrawWork<'_>,
    cameras: &[Camera],
    tile_count: u32,
    wanted: &[u32],
    method: SamplingMethod,
) -> Result<Vec<DepthImage>, SamplingError> {
    let planes = if draw.lighting.is_traced() { LIGHT } else { NONE };
    device().sampler.sample(&SampleWork { draw, cameras, tile_count, wanted, method, planes })
}

fn holes(image: &DepthImage) -> usize {
    image.inverse_depth_per_m.iter().filter(|&&depth| depth == HOLE_INVERSE_DEPTH).count()
}

/// A wall from this distance; it fills all pictures.
fn before_wall(x: f32, distance_m: f32) -> PinholeCamera {
    let eye = Vec3::new(x, 0.0, distance_m);
    PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 0.8, SIZE_PX)
}

#[test]
fn a_wall_is_sampled_once_unless_a_later_image_is_much_finer() {
    let scene = upload(&quad(Vec3::ZERO, 20.0, Vec3::Z, [200; 3]));
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let draw = DrawWork { visibility, ..unlit(&scene) };
        let share_of_second = |distance_m: f32| {
            let images = sample(draw, &[before_wall(0.0, 4.0), before_wall(0.0, distance_m)], COVERAGE);
            assert_eq!(holes(&images[0]), 0);
            holes(&images[1]) as f32 / SIZE_PX.element_product() as f32
        };
        // From the same place all pixels but those within two or three of the border, where the first image does not know what is around.
        let inner = [74.0 * 54.0, 76.0 * 56.0].map(|pixels| pixels / (80.0 * 60.0));
        assert!((inner[0]..inner[1]).contains(&share_of_second(4.0)), "{visibility}: {}", share_of_second(4.0));
        assert!(share_of_second(4.0 / 1.45) > 0.99, "{visibility}");
        assert_eq!(share_of_second(4.0 / 1.9), 0.0, "{visibility}: coarser by more than half");
    }
}

/// The light of a sample does not depend on which others are lit.
#[test]
fn samples_that_stay_are_those_of_conventional_images() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let cameras = Rig::two_plane(&scene.bounds(), 2.5).expect("a rig").samples(SIZE_PX);
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let draw = DrawWork { visibility, ..lit(&on_device) };
        let conventional = sample(draw, &cameras, SamplingMethod::CONVENTIONAL);
        let covered = sample(draw, &cameras, COVERAGE);
        for (number, (whole, part)) in conventional.iter().zip(&covered).enumerate() {
            part.validate().expect("all planes");
            let omitted = holes(part) as f32 / part.inverse_depth_per_m.len() as f32;
            assert!(if number == 0 { omitted == 0.0 } else { (0.1..0.9).contains(&omitted) }, "{number}: {omitted}");
            let light = [whole, part].map(|image| image.light.as_ref().expect("light"));
            for (place, &depth) in part.inverse_depth_per_m.iter().enumerate() {
                if depth <= 0.0 {
                    assert_eq!((light[1].lamps_rgb9e5[place], light[1].environment_rgb9e5[place]), (0, 0));
                    continue;
                }
                assert_eq!(depth, whole.inverse_depth_per_m[place]);
                let of = |planes: &depth_image::LightPlanes| {
                    (planes.lamps_rgb9e5[place], planes.environment_rgb9e5[place], planes.share8[0][place])
                };
                assert_eq!(of(light[0]), of(light[1]));
            }
        }
    }
}

#[test]
fn images_and_tiles_can_be_taken_one_by_one_in_any_order() {
    let scene = upload(&poles(0.02));
    let draw = lit(&scene);
    let cameras = Rig::two_plane(&poles(0.02).bounds(), 2.5).expect("a rig").samples(SIZE_PX);
    let whole = sample(draw, &cameras, COVERAGE);
    let cameras = pinholes(&cameras);
    let taken = |tile_count, wanted: &[u32]| tiles(draw, &cameras, tile_count, wanted, COVERAGE).expect("images");
    assert_eq!(taken(1, &[3, 1]), [whole[3].clone(), whole[1].clone()]);
    for (number, image) in whole.iter().enumerate() {
        let parts = (0..3).map(|tile| taken(3, &[3 * number as u32 + tile]).remove(0)).collect();
        let joined = DepthImage::from_tiles(cameras[number], parts).expect("an image");
        let differing = joined.inverse_depth_per_m.iter().zip(&image.inverse_depth_per_m);
        // A tile's rays are those of its image but for the last bit.
        let differing = differing.filter(|(a, b)| (*a - *b).abs() > 1e-3 * b.abs()).count();
        assert!(differing * 200 < image.inverse_depth_per_m.len(), "image {number}: {differing}");
    }
    let refused = tiles(draw, &cameras, 3, &[12], COVERAGE);
    assert!(matches!(refused, Err(SamplingError::Selection { index: 12, cameras: 12, .. })), "{refused:?}");
    let cut = tiles(draw, &cameras, 2, &[0], SamplingMethod::NonRedundant(Redundancy::Visibility));
    assert!(matches!(cut, Err(SamplingError::Selection { .. })), "{cut:?}");
}

#[test]
fn cameras_on_one_spot_alone_behind_a_wall_and_sixteen_of_them_are_sampled() {
    let scene = upload(&quad(Vec3::ZERO, 20.0, Vec3::Z, [200; 3]));
    let draw = lit(&scene);
    let front = before_wall(0.0, 4.0);
    assert_eq!(holes(&sample(draw, &[front], COVERAGE)[0]), 0);
    let same = sample(draw, &[front; 16], COVERAGE);
    assert!(same[1..].iter().all(|image| holes(image) == holes(&same[1]) && holes(image) > 3900));
    let behind = PinholeCamera::looking_at(Vec3::Z * -4.0, Vec3::ZERO, Vec3::Y, 0.8, SIZE_PX);
    let images = sample(draw, &[front, behind, front], COVERAGE);
    assert_eq!(holes(&images[1]), 0, "the other side is another surface");
    assert!(holes(&images[2]) > 3900);
    let eighteen = pinholes(&[front; 18]);
    assert!(tiles(draw, &eighteen, 1, &[17], COVERAGE).is_err(), "more images before than a device consults");
}

/// In wind each moment has samples of its own; they follow from it alone.
#[test]
fn moving_scenes_are_covered_at_their_moment() {
    let mut swaying = courtyard().with_wind();
    swaying.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| vertex.sway = 1.0);
    let scene = upload(&swaying);
    let cameras = Rig::two_plane(&courtyard().bounds(), 2.5).expect("a rig").samples(SIZE_PX);
    let at = |scene_time_s| sample(DrawWork { scene_time_s, ..unlit(&scene) }, &cameras, COVERAGE);
    let before = at(0.4);
    assert!(at(0.2) != before, "the wind blows");
    assert!(at(0.4) == before, "whatever came between");
    assert!(holes(&before[1]) > 0);
}
