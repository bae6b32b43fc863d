//! Images that omit what others hold: against the scalar reference, and what must hold of them.

use depth_image::{Antialias, Camera, DepthImage, PinholeCamera};
use fixtures::{blocks, poles};
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, Lighting, SamplePlanes, Visibility};
use sampling::{Redundancy, Rig, SampleWork, SamplingError, SamplingMethod, scalar};
use scene::Scene;
use scene::procedural::courtyard;

use crate::stage::{device, upload};

const SIZE_PX: UVec2 = UVec2::new(80, 60);
const ALL: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: true,
    surface_id: true,
    specular: false,
    corners: true,
    light: false,
};
/// The methods that show what is behind redundant samples.
const APART: [SamplingMethod; 2] =
    [SamplingMethod::NonRedundant(Redundancy::Pixel), SamplingMethod::NonRedundant(Redundancy::Visibility)];
const COVERAGE: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Coverage);

fn taken(
    scene: &GpuScene,
    cameras: &[PinholeCamera],
    method: SamplingMethod,
    visibility: Visibility,
) -> Result<Vec<DepthImage>, SamplingError> {
    let draw = DrawWork { visibility, ..DrawWork::new(scene, Lighting::default()) };
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let cameras: Vec<Camera> = cameras.iter().copied().map(Camera::Pinhole).collect();
    device().sampler.sample(&SampleWork {
        draw,
        cameras: &cameras,
        tile_count: 1,
        wanted: &wanted,
        method,
        planes: ALL,
    })
}

fn sample(scene: &GpuScene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    taken(scene, cameras, method, Visibility::Measured).expect("images")
}

fn two_plane(scene: &Scene) -> Vec<PinholeCamera> {
    Rig::two_plane(&scene.bounds(), 2.5).expect("a rig").samples(SIZE_PX)
}

/// The viewpoints V0 and V1 of Xie's Fig. 3, for the scene `blocks`.
fn fig_3() -> Vec<PinholeCamera> {
    let eyes_in_world = [-2.0, 2.0].map(|x| Vec3::new(x, 0.0, 16.0));
    eyes_in_world.map(|eye| PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.9, SIZE_PX)).to_vec()
}

/// The share of texels that differ: another kind of texel, another depth, or another way there.
fn differing(a: &DepthImage, b: &DepthImage) -> f64 {
    let differs = |(i, (&a_depth, &b_depth)): (usize, (&f32, &f32))| {
        let far = (a_depth - b_depth).abs() > 1e-3 * a_depth.abs();
        far || a.has_passed(i) != b.has_passed(i)
    };
    let depths = a.inverse_depth_per_m.iter().zip(&b.inverse_depth_per_m);
    depths.enumerate().filter(|&texel| differs(texel)).count() as f64 / a.inverse_depth_per_m.len() as f64
}

#[test]
fn the_device_omits_the_samples_that_the_scalar_reference_omits() {
    for (name, scene, cameras) in [
        ("blocks", blocks(), fig_3()),
        ("poles", poles(0.02), two_plane(&poles(0.02))),
        ("courtyard", courtyard(), two_plane(&courtyard())),
    ] {
        let on_device = upload(&scene);
        let rays = render::scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
        let peeling = SamplingMethod::DepthPeeling { layers: 3 };
        for method in APART.into_iter().chain([COVERAGE, peeling]) {
            let cameras = method.cameras(cameras.clone());
            let reference = scalar::sample(&rays, &cameras, method);
            for visibility in [Visibility::Rays, Visibility::Triangles] {
                if visibility == Visibility::Triangles && method == APART[1] {
                    continue;
                }
                let images = taken(&on_device, &cameras, method, visibility).expect("images");
                for (number, (image, reference)) in images.iter().zip(&reference).enumerate() {
                    let off = differing(image, reference);
                    println!("{name}, {method} by {visibility}, image {number}: {:.3} % differ", 100.0 * off);
                    let bar = if visibility == Visibility::Rays { 0.01 } else { 0.02 };
                    assert!(off < bar, "{name} {method} {visibility} {number}: {off}");
                }
            }
        }
    }
}

/// Every sample of a conventional image is in the non-redundant one, or redundant with an earlier image.
#[test]
fn every_conventional_sample_is_held_by_some_image() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let cameras = two_plane(&scene);
    let conventional = sample(&on_device, &cameras, SamplingMethod::CONVENTIONAL);
    let apart = sample(&on_device, &cameras, SamplingMethod::NonRedundant(Redundancy::Pixel));
    for (number, (whole, part)) in conventional.iter().zip(&apart).enumerate() {
        let ids = whole.surface_id.as_ref().expect("ids");
        let mut lost = 0;
        let mut samples = 0;
        for (x, y) in (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| (x, y))) {
            let index = (y * SIZE_PX.x + x) as usize;
            let Some(point) = whole.sample_in_world(x, y) else { continue };
            let kept = part.inverse_depth_per_m[index] == whole.inverse_depth_per_m[index];
            let redundant = apart[..number].iter().any(|earlier| scalar::holds(earlier, point, ids[index]));
            samples += 1;
            lost += usize::from(!kept && !redundant);
        }
        println!("image {number}: {lost} of {samples} samples lost");
        // A point that projects to the border between two pixels is rounded to either.
        assert!(lost * 1000 <= samples, "{number}: {lost} of {samples}");
    }
}

/// Texels that show block C, the yellow one.
fn shows_block_c(images: &[DepthImage], scene: &Scene) -> usize {
    let vertices = scene.meshes.iter().flat_map(|mesh| &mesh.vertices);
    let yellow =
        vertices.filter(|v| v.color_srgba8[0] > 200 && v.color_srgba8[1] > 150).map(|v| Vec3::from(v.position));
    let (low, high) = yellow.fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    assert!(low.cmplt(high).all(), "block C is yellow");
    let inside = |p: Vec3| p.cmpge(low - 1e-3).all() && p.cmple(high + 1e-3).all();
    let texels = |image: &DepthImage| {
        let size = image.size_px();
        let places = (0..size.y).flat_map(move |y| (0..size.x).map(move |x| (x, y)));
        places.filter(|&(x, y)| image.sample_in_world(x, y).is_some_and(inside)).count()
    };
    images.iter().map(texels).sum()
}

#[test]
fn only_images_without_redundance_find_block_c() {
    let scene = blocks();
    let on_device = upload(&scene);
    let found = |method: SamplingMethod| {
        let cameras = method.cameras(fig_3());
        shows_block_c(&sample(&on_device, &cameras, method), &scene)
    };
    assert_eq!(found(SamplingMethod::CONVENTIONAL), 0);
    for method in APART {
        let texels = found(method);
        println!("{method}: {texels} texels show block C");
        assert!(texels > 10, "{method}: {texels}");
    }
    // Two layers from the first viewpoint end at B (Fig. 3, right).
    let first = vec![fig_3()[0]; 2];
    let layers = sample(&on_device, &first, SamplingMethod::DepthPeeling { layers: 2 });
    assert_eq!(shows_block_c(&layers, &scene), 0);
}

#[test]
fn a_repeated_viewpoint_shows_the_next_layer() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let cameras = vec![two_plane(&scene)[0]; 2];
    let peeled = sample(&on_device, &cameras, SamplingMethod::DepthPeeling { layers: 2 });
    for method in APART {
        let images = sample(&on_device, &cameras, method);
        assert!(images[0].passed.is_none(), "{method}: the first image is conventional");
        let again = images[1].inverse_depth_per_m.iter().zip(&images[0].inverse_depth_per_m);
        let nearer = again.filter(|(second, first)| **second > 0.0 && **second >= **first).count();
        println!("{method}: {nearer} texels again, {:.4} unlike peeling", differing(&images[1], &peeled[1]));
        assert!(nearer * 200 < images[1].inverse_depth_per_m.len(), "{method}: {nearer}");
    }
}

#[test]
fn layers_and_their_corners_lie_behind_one_another() {
    let scene = poles(0.02);
    let on_device = upload(&scene);
    let method = SamplingMethod::DepthPeeling { layers: 4 };
    let images = sample(&on_device, &method.cameras(two_plane(&scene)), method);
    assert_eq!(images.len(), 4);
    for pair in images.windows(2) {
        for (front, back) in pair[0].inverse_depth_per_m.iter().zip(&pair[1].inverse_depth_per_m) {
            assert!(*back <= 0.0 || back < front, "{back} is not behind {front}");
        }
        pair[1].validate().expect("all planes");
        assert_eq!(pair[1].corner_inverse_depth_per_m.as_ref().map(Vec::len), Some(81 * 61));
    }
    let refused = taken(&on_device, &two_plane(&scene), method, Visibility::Measured);
    assert!(matches!(refused, Err(SamplingError::Layer { index: 1 })), "{refused:?}");
}

#[test]
fn a_camera_that_sees_nothing_has_no_samples() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let up = PinholeCamera::looking_at(Vec3::Y * 50.0, Vec3::Y * 100.0, Vec3::X, 0.5, SIZE_PX);
    let inside = PinholeCamera::looking_at(scene.bounds().center(), scene.bounds().max, Vec3::Y, 0.5, SIZE_PX);
    for method in SamplingMethod::all().filter(|method| method.layer_selection().is_none()) {
        let cameras = method.cameras(vec![up, up]);
        for image in sample(&on_device, &cameras, method) {
            assert!(image.inverse_depth_per_m.iter().all(|&d| d == 0.0), "{method}");
        }
        if method.cameras(vec![up, inside]) == [up, inside] {
            let images = sample(&on_device, &[up, inside], method);
            assert!(images.iter().flat_map(|image| &image.inverse_depth_per_m).all(|d| d.is_finite()), "{method}");
        }
    }
}

/// By visibility each image can be taken alone; a chain cannot be taken in parts.
#[test]
fn independent_images_can_be_taken_one_by_one() {
    let scene = poles(0.02);
    let on_device = upload(&scene);
    let cameras = two_plane(&scene);
    let method = SamplingMethod::NonRedundant(Redundancy::Visibility);
    let whole = sample(&on_device, &cameras, method);
    let draw = DrawWork::new(&on_device, Lighting::default());
    let cameras: Vec<Camera> = cameras.into_iter().map(Camera::Pinhole).collect();
    let part = |wanted: &[u32], method| {
        device().sampler.sample(&SampleWork { draw, cameras: &cameras, tile_count: 1, wanted, method, planes: ALL })
    };
    assert_eq!(part(&[3, 1], method).expect("two images"), [whole[3].clone(), whole[1].clone()]);
    for (wanted, method) in [(&[0, 1][..], SamplingMethod::default()), (&[4], method)] {
        let allowed = wanted.iter().all(|&index| index < 4);
        assert_eq!(part(wanted, method).is_ok(), allowed);
    }
    let chained = SamplingMethod::NonRedundant(Redundancy::Pixel);
    assert!(matches!(part(&[1, 2], chained), Err(SamplingError::Selection { index: 1, cameras: 4, .. })));
}
