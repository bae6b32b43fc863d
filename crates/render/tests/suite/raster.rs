//! Drawing on the software device, against the scalar reference and closed forms.

use std::collections::{BTreeMap, BTreeSet};

use depth_image::{Camera, CameraError, DepthImage, Environment, PinholeCamera, View, ViewPlanes, linear_from_rgb9e5};
use fixtures::{poles, quad, unit_cube, uv_sphere};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use render::{DrawWork, GpuScene, Lighting, RenderError, SamplePlanes, Visibility, scalar};
use scene::procedural::courtyard;
use scene::{Instance, Material, Scene, Texture, Wind};

use crate::stage::{device, upload};

const SIZE_PX: UVec2 = UVec2::new(64, 48);
const COLOR: [u8; 3] = [200, 120, 60];

fn work(scene: &GpuScene, lighting: Lighting, scene_time_s: f32) -> DrawWork<'_> {
    DrawWork { scene_time_s, visibility: Visibility::Triangles, ..DrawWork::new(scene, lighting) }
}

fn sample_at(scene: &Scene, camera: &PinholeCamera, planes: SamplePlanes, scene_time_s: f32) -> DepthImage {
    let on_device = upload(scene);
    let draw = work(&on_device, Lighting::UNLIT, scene_time_s);
    device().1.draw_depth_images(draw, &[Camera::Pinhole(*camera)], planes).expect("an image").remove(0)
}

fn sample(scene: &Scene, camera: &PinholeCamera) -> DepthImage {
    sample_at(scene, camera, SamplePlanes::default(), 0.0)
}

fn unlit_view(scene: &Scene, camera: &PinholeCamera) -> View {
    let planes = ViewPlanes::ALL;
    device().1.draw_views(work(&upload(scene), Lighting::UNLIT, 0.0), &[*camera], planes).expect("a view").remove(0)
}

fn looking(eye: Vec3, target: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, target, Vec3::Y, 45f32.to_radians(), SIZE_PX)
}

/// From the origin along -Z.
fn ahead() -> PinholeCamera {
    looking(Vec3::ZERO, Vec3::NEG_Z)
}

fn wall() -> Scene {
    quad(Vec3::NEG_Z * 4.0, 1.0, Vec3::Z, COLOR)
}

fn index(x: u32, y: u32) -> usize {
    (y * SIZE_PX.x + x) as usize
}

/// Pixels whose neighbourhood, in the reference, is of one kind: all background, or all of about one depth.
fn away_from_edges(plane: &[f32]) -> Vec<usize> {
    let smooth = |&(x, y): &(u32, u32)| {
        let around = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2)];
        let values = around.map(|(i, j)| plane[index(x + i - 1, y + j - 1)]);
        let (least, greatest) = values.iter().fold((f32::MAX, 0f32), |(a, b), &v| (a.min(v), b.max(v)));
        greatest == 0.0 || least > 0.9 * greatest
    };
    let inner = (1..SIZE_PX.y - 1).flat_map(|y| (1..SIZE_PX.x - 1).map(move |x| (x, y)));
    inner.filter(smooth).map(|(x, y)| index(x, y)).collect()
}

/// Greatest relative error of depth, and how many surfaces and backgrounds were compared. Infinite where one
/// has a surface and the other none.
fn depth_error(reference: &[f32], drawn: &[f32]) -> (f32, usize, usize) {
    let pixels = away_from_edges(reference);
    let error = |&i: &usize| match (reference[i], drawn[i]) {
        (0.0, 0.0) => 0.0,
        (0.0, _) | (_, 0.0) => f32::INFINITY,
        (a, b) => (b / a - 1.0).abs(),
    };
    let surfaces = pixels.iter().filter(|&&i| reference[i] > 0.0).count();
    (pixels.iter().map(error).fold(0.0, f32::max), surfaces, pixels.len() - surfaces)
}

#[test]
fn depth_equals_the_scalar_reference() {
    let cases = [
        ("cube", unit_cube(), looking(Vec3::new(1.2, 1.0, 1.6), Vec3::ZERO)),
        ("sphere", uv_sphere(1.0, 24), looking(Vec3::new(0.5, 1.0, 3.0), Vec3::ZERO)),
        ("poles", poles(0.2), looking(Vec3::new(0.3, 0.2, 4.0), Vec3::NEG_Z)),
        ("courtyard", courtyard(), looking(Vec3::new(2.0, 9.0, 9.0), Vec3::ZERO)),
    ];
    for (name, scene, camera) in cases {
        let reference = scalar::inverse_depth_per_m(&scene, &camera);
        let image = sample(&scene, &camera);
        let (error, surfaces, backgrounds) = depth_error(&reference, &image.inverse_depth_per_m);
        println!("{name}: {surfaces} surfaces, {backgrounds} backgrounds, off by at most {error:.2e}");
        assert!(surfaces > 200 && error < 1e-4, "{name}: {error}");
        // The comparison sees a picture that is moved by a pixel.
        let mut moved = image.inverse_depth_per_m.clone();
        moved.rotate_left(1);
        assert!(depth_error(&reference, &moved).0 > 1e-4, "{name}");
    }
}

#[test]
fn a_lens_shift_moves_the_picture() {
    let scene = unit_cube();
    let mut camera = looking(Vec3::new(1.2, 1.0, 1.6), Vec3::ZERO);
    camera.principal_px += Vec2::new(9.5, -6.25);
    camera.focal_px.y *= 1.25;
    let (error, surfaces, _) =
        depth_error(&scalar::inverse_depth_per_m(&scene, &camera), &sample(&scene, &camera).inverse_depth_per_m);
    assert!(surfaces > 200 && error < 1e-4, "{surfaces} {error}");
}

#[test]
fn a_wall_four_metres_ahead_reads_a_quarter() {
    let image = sample(&wall(), &ahead());
    let covered: Vec<f32> = image.inverse_depth_per_m.iter().copied().filter(|&d| d > 0.0).collect();
    assert!(covered.len() > 500, "{}", covered.len());
    let worst = covered.iter().map(|d| (d - 0.25).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-6, "off by {worst}");
}

#[test]
fn unlit_colors_and_the_background_are_exact() {
    let mut scene = wall();
    let background_linear = Vec3::new(0.2, 0.4, 0.6);
    scene.background = Environment::uniform(background_linear);
    let background = background_linear.to_array().map(depth_image::srgb8_from_linear);
    for lighting in [Lighting::UNLIT, Lighting::default()] {
        let planes = ViewPlanes::ALL;
        let on_device = upload(&scene);
        let view =
            device().1.draw_views(work(&on_device, lighting, 0.0), &[ahead()], planes).expect("a view").remove(0);
        let depths = view.inverse_depth_per_m.expect("depth");
        let colors = view.srgb8.as_chunks::<3>().0;
        let covered = depths.iter().filter(|&&d| d > 0.0).count();
        assert!(covered > 500 && covered < colors.len() - 500, "{covered}");
        for (color, depth) in colors.iter().zip(depths) {
            let wanted = if depth > 0.0 { COLOR } else { background };
            assert!((0..3).all(|c| color[c].abs_diff(wanted[c]) == 0), "{lighting}: {color:?}, not {wanted:?}");
        }
    }
}

#[test]
fn background_texels_are_marked_and_samples_keep_their_color() {
    let image = sample(&wall(), &ahead());
    assert!(image.inverse_depth_per_m.contains(&depth_image::BACKGROUND_INVERSE_DEPTH));
    let wanted = Vec3::from(COLOR.map(depth_image::linear_from_srgb8));
    let covered = (0..image.inverse_depth_per_m.len()).filter(|&i| image.inverse_depth_per_m[i] > 0.0);
    let worst = covered.map(|i| (linear_from_rgb9e5(image.color_rgb9e5[i]) - wanted).abs().max_element());
    let worst = worst.fold(0.0, f32::max);
    // RGB9E5 keeps nine bits of the largest channel; albedo had ten, sRGB-encoded, before.
    assert!(worst <= wanted.max_element() / 511.0 + 1.2e-3, "{worst}");
}

/// The wall with a texture all over it.
fn textured(texture: Texture, alpha_cutoff: f32) -> Scene {
    let mut scene = quad(Vec3::NEG_Z * 4.0, 1.0, Vec3::Z, [255; 3]);
    scene.materials[0] = Material { base_color_texture: Some(0.into()), alpha_cutoff, ..scene.materials[0].clone() };
    scene.textures = vec![texture];
    scene
}

fn checks(side_px: u32, texel: impl Fn(bool) -> [u8; 4]) -> Texture {
    let texels = (0..side_px * side_px).flat_map(|i| texel((i % side_px + i / side_px).is_multiple_of(2)));
    Texture { width_px: side_px, height_px: side_px, is_srgb: true, srgba8: texels.collect() }
}

#[test]
fn fine_checks_far_away_are_grey_in_linear_light() {
    let scene = textured(checks(1024, |white| if white { [255; 4] } else { [0, 0, 0, 255] }), 0.0);
    let view = unlit_view(&scene, &ahead());
    let depths = view.inverse_depth_per_m.as_deref().expect("depth");
    let grey: Vec<[u8; 3]> = away_from_edges(depths)
        .into_iter()
        .filter(|&i| depths[i] > 0.0)
        .map(|i| view.srgb8.as_chunks::<3>().0[i])
        .collect();
    assert!(grey.len() > 300, "{}", grey.len());
    // Half of white's light is code 188; half of its code would be 128.
    assert!(grey.iter().flatten().all(|c| c.abs_diff(188) <= 2), "{:?}", grey[0]);
}

#[test]
fn masked_out_texels_show_the_background() {
    // Left half opaque, right half clear.
    let mut texture = Texture { width_px: 64, height_px: 64, is_srgb: true, srgba8: vec![255; 64 * 64 * 4] };
    texture.srgba8.chunks_exact_mut(64 * 4).for_each(|row| row.as_chunks_mut::<4>().0[32..].fill([255, 255, 255, 0]));
    let masked = sample(&textured(texture.clone(), 0.5), &ahead());
    let opaque = sample(&textured(texture, 0.0), &ahead());
    let count = |image: &DepthImage, columns: std::ops::Range<u32>| {
        let pixels = (0..SIZE_PX.y).flat_map(|y| columns.clone().map(move |x| (x, y)));
        pixels.filter(|&(x, y)| image.inverse_depth_per_m[index(x, y)] > 0.0).count()
    };
    assert!(count(&opaque, 34..64) > 200);
    assert_eq!(count(&masked, 34..64), 0);
    assert_eq!(count(&masked, 0..30), count(&opaque, 0..30));
}

#[test]
fn only_double_sided_surfaces_show_their_back() {
    let mut scene = wall();
    let behind = looking(Vec3::NEG_Z * 8.0, Vec3::ZERO);
    assert!(sample(&scene, &behind).inverse_depth_per_m.iter().all(|&d| d == 0.0));
    scene.materials[0].double_sided = true;
    let planes = SamplePlanes { normal: true, surface_id: false, ..SamplePlanes::default() };
    let image = sample_at(&scene, &behind, planes, 0.0);
    let covered: Vec<usize> =
        (0..image.inverse_depth_per_m.len()).filter(|&i| image.inverse_depth_per_m[i] > 0.0).collect();
    assert!(covered.len() > 500);
    // The normal of a back faces the viewer too.
    let normals = image.normal_oct16.expect("normals");
    assert!(covered.iter().all(|&i| (depth_image::unit_from_oct16(normals[i]) - Vec3::NEG_Z).length() < 1e-3));
}

fn moved(scene: &Scene, world_from_mesh: Affine3A) -> Scene {
    let mut other = scene.clone();
    other.instances = vec![Instance { mesh: 0, world_from_mesh }];
    other
}

#[test]
fn instances_stand_where_they_are_placed() {
    let placement = Affine3A::from_scale_rotation_translation(
        Vec3::new(1.5, 0.5, 1.0),
        glam::Quat::from_euler(glam::EulerRot::YXZ, 0.4, 0.3, -0.2),
        Vec3::new(0.3, -0.2, -3.0),
    );
    let scene = moved(&unit_cube(), placement);
    let image =
        sample_at(&scene, &ahead(), SamplePlanes { normal: true, surface_id: false, ..SamplePlanes::default() }, 0.0);
    let reference = scalar::inverse_depth_per_m(&scene, &ahead());
    let (error, surfaces, _) = depth_error(&reference, &image.inverse_depth_per_m);
    assert!(surfaces > 100 && error < 1e-4, "{surfaces} {error}");
    let normals = image.normal_oct16.expect("normals");
    let inner = away_from_edges(&reference).into_iter().filter(|&i| reference[i] > 0.0);
    let off = inner.filter(|&i| {
        let pixel = UVec2::new(i as u32 % SIZE_PX.x, i as u32 / SIZE_PX.x).as_vec2() + 0.5;
        let met = scalar::nearest(&scene, &ahead().ray(pixel), 0.01).expect("a surface");
        (depth_image::unit_from_oct16(normals[i]) - met.normal_in_world).length() > 1e-2
    });
    // Along an edge of the cube two faces have one depth: a few pixels may see the other one.
    assert!(off.count() * 50 < surfaces, "normals");
}

#[test]
fn wind_displaces_swaying_vertices() {
    let wind = Wind { direction_in_world: Vec3::X, amplitude_m: 0.5, frequency_hz: 0.3, waves_per_m: Vec3::ZERO };
    let mut scene = wall();
    scene.wind = Some(wind);
    scene.meshes[0].vertices.iter_mut().for_each(|v| v.sway = 0.8);
    for scene_time_s in [0.0, 0.7, 1.9, 100.25] {
        let by = wind.displacement_in_world(Vec3::NEG_Z * 4.0, 0.8, scene_time_s);
        let still = quad(Vec3::NEG_Z * 4.0 + by, 1.0, Vec3::Z, COLOR);
        let [windy, still] =
            [sample_at(&scene, &ahead(), SamplePlanes::default(), scene_time_s), sample(&still, &ahead())]
                .map(|image| image.inverse_depth_per_m.iter().map(|&d| d > 0.0).collect::<Vec<_>>());
        let differ = windy.iter().zip(&still).filter(|(a, b)| a != b).count();
        assert!(still.iter().filter(|&&covered| covered).count() > 500 && differ <= 30, "{scene_time_s} s: {differ}");
        // A metre is 14 pixels here: the wind is seen.
        assert!(scene_time_s != 0.7 || by.length() > 0.3, "{by}");
    }
}

#[test]
fn surface_ids_name_one_triangle_of_one_instance() {
    assert!(
        device().0.device.features().contains(wgpu::Features::PRIMITIVE_INDEX),
        "the software device knows triangles' numbers"
    );
    let mut scene = unit_cube();
    let at = |x: f32| Affine3A::from_translation(Vec3::new(x, 0.0, -4.0)) * Affine3A::from_rotation_y(0.5);
    scene.instances =
        vec![Instance { mesh: 0, world_from_mesh: at(-1.0) }, Instance { mesh: 0, world_from_mesh: at(1.0) }];
    let image =
        sample_at(&scene, &ahead(), SamplePlanes { normal: false, surface_id: true, ..SamplePlanes::default() }, 0.0);
    let ids = image.surface_id.as_ref().expect("ids");
    let mut triangle_of_id = BTreeMap::new();
    for (x, y) in (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| (x, y))) {
        let Some(point) = image.sample_in_world(x, y) else { continue };
        let id = ids[index(x, y)];
        // Points on an edge between triangles belong to both.
        let [triangle] = triangles_at(&scene, point)[..] else { continue };
        assert_eq!(id.instance, triangle.0, "({x}, {y})");
        let named = *triangle_of_id.entry((id.instance, id.primitive)).or_insert(triangle);
        assert_eq!(named, triangle, "({x}, {y}): {id:?} names two triangles");
    }
    let triangles: BTreeSet<_> = triangle_of_id.values().collect();
    assert!(triangles.len() == triangle_of_id.len(), "a triangle has two names: {triangle_of_id:?}");
    assert!(triangles.len() >= 6 && [0, 1].iter().all(|i| triangles.iter().any(|t| t.0 == *i)), "{triangles:?}");
}

/// Instances and numbers of the triangles that a point lies on.
fn triangles_at(scene: &Scene, point: Vec3) -> Vec<(u32, usize)> {
    let mesh = &scene.meshes[0];
    let all = (0..2).flat_map(|instance| (0..mesh.indices.len() / 3).map(move |triangle| (instance, triangle)));
    all.filter(|&(instance, triangle)| {
        let corners: [Vec3; 3] = std::array::from_fn(|k| {
            let position = mesh.vertices[mesh.indices[triangle * 3 + k] as usize].position;
            scene.instances[instance as usize].world_from_mesh.transform_point3(position.into())
        });
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let inside = |k: usize| (corners[(k + 1) % 3] - corners[k]).cross(point - corners[k]).dot(normal) > -1e-2;
        (point - corners[0]).dot(normal).abs() < 1e-3 && (0..3).all(inside)
    })
    .collect()
}

#[test]
fn an_invalid_camera_is_named_in_the_error() {
    let scene = upload(&wall());
    let draw = work(&scene, Lighting::UNLIT, 0.0);
    let bad = PinholeCamera { eye_in_world: Vec3::NAN, ..ahead() };
    let error = device().1.draw_views(draw, &[ahead(), bad], ViewPlanes::default()).expect_err("NaN");
    assert!(matches!(error, RenderError::Camera { index: 1, source: CameraError::NotFinite { .. } }), "{error}");
    let vast = PinholeCamera { size_px: UVec2::new(65_000, 1), ..ahead() };
    let cameras = [Camera::Pinhole(vast)];
    let error = device().1.draw_depth_images(draw, &cameras, SamplePlanes::default()).expect_err("vast");
    assert!(matches!(error, RenderError::Camera { index: 0, source: CameraError::OutOfRange { .. } }), "{error}");
    assert!(device().1.draw_views(draw, &[], ViewPlanes::default()).expect("nothing").is_empty());
}
