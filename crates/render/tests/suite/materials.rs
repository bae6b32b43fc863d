//! Textures of materials and hashed alpha: closed forms, for drawn triangles and for rays, and both against each other.

use depth_image::{
    DepthImage, Environment, Illumination, Light, PinholeCamera, Reflector, linear_from_rgb9e5, srgb8_from_linear,
    unit_from_oct16,
};
use fixtures::{quad, uv_sphere};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use render::{DrawWork, Visibility, scalar};
use scene::{Instance, Material, Scene, Texture, TextureUse, VertexDetail, Wrap};

use crate::stage::{SIZE_PX, device, down_from, floor_light, floor_under, image, mean, upload, work};

const WAYS: [Visibility; 2] = [Visibility::Triangles, Visibility::Rays];

fn seen(scene: &Scene, lighting: &str, visibility: Visibility, camera: &PinholeCamera) -> DepthImage {
    image(DrawWork { visibility, ..work(&upload(scene), lighting) }, camera)
}

/// From the origin along -Z.
fn ahead() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, SIZE_PX)
}

/// A wall of two metres, four metres ahead, whose u runs along X and v along -Y.
fn wall(material: Material, textures: Vec<Texture>) -> Scene {
    let mut scene = quad(Vec3::NEG_Z * 4.0, 1.0, Vec3::Z, [255; 3]);
    scene.materials[0] = Material { unlit: true, ..material };
    scene.textures = textures;
    scene
}

fn texture(width_px: u32, height_px: u32, is_srgb: bool, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..width_px * height_px).flat_map(|i| texel(i % width_px, i / width_px));
    Texture { width_px, height_px, is_srgb, srgba8: texels.collect() }
}

fn data(rgb: [u8; 3]) -> Texture {
    texture(1, 1, false, |_, _| [rgb[0], rgb[1], rgb[2], 255])
}

fn direction(unit: Vec3) -> Texture {
    data(unit.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0).round() as u8))
}

fn normals(image: &DepthImage) -> Vec<Vec3> {
    let normals = image.normal_oct16.as_ref().expect("normals");
    let there = image.inverse_depth_per_m.iter().zip(normals).filter(|(depth, _)| **depth > 0.0);
    there.map(|(_, &normal)| unit_from_oct16(normal)).collect()
}

#[test]
fn a_normal_map_tilts_along_the_tangent_and_the_bitangent() {
    let tilted = |unit: Vec3, scale: f32, sign: f32, placed: Affine3A| {
        let material = Material { normal_texture: Some(0.into()), normal_scale: scale, ..Material::default() };
        let mut scene = wall(material, vec![direction(unit)]);
        scene.meshes[0].details = vec![VertexDetail { tangent: [1.0, 0.0, 0.0, sign], ..VertexDetail::default() }; 4];
        scene.instances = vec![Instance { mesh: 0, world_from_mesh: placed }];
        scene
    };
    let right = Vec3::new(0.6, 0.0, 0.8);
    let up = Vec3::new(0.0, 0.6, 0.8);
    let here = Affine3A::IDENTITY;
    // A quarter turn about the view's axis moves the tangent with the mesh.
    let turned = Affine3A::from_rotation_z(std::f32::consts::FRAC_PI_2);
    for (scene, wanted) in [
        (tilted(Vec3::Z, 1.0, 1.0, here), Vec3::Z),
        (tilted(right, 1.0, 1.0, here), right),
        (tilted(up, 1.0, 1.0, here), up),
        (tilted(up, 1.0, -1.0, here), Vec3::new(0.0, -0.6, 0.8)),
        (tilted(right, 0.5, 1.0, here), Vec3::new(0.3, 0.0, 0.8).normalize_or(Vec3::Z)),
        (tilted(right, 1.0, 1.0, turned), up),
    ] {
        for way in WAYS {
            let normals = normals(&seen(&scene, "unlit", way, &ahead()));
            let worst = normals.iter().map(|normal| normal.distance(wanted)).fold(0.0, f32::max);
            // A code of eight bits is 0.008 wide.
            assert!(normals.len() > 500 && worst < 0.012, "{way}: {wanted}, off by {worst}");
        }
    }
}

/// Colours by place on the wall: from -1 to 1 along X and -Y.
fn colors_on_wall(image: &DepthImage) -> Vec<(Vec2, Vec3)> {
    let places = (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| (x, y)));
    let colors = places.filter_map(|(x, y)| {
        let point = image.sample_in_world(x, y)?;
        let color = linear_from_rgb9e5(image.color_rgb9e5[(y * SIZE_PX.x + x) as usize]);
        Some((Vec2::new(point.x, -point.y), color))
    });
    colors.collect()
}

#[test]
fn textures_repeat_mirror_or_clamp_along_each_axis() {
    let code = |at: f32| 100.0 + 8.0 * (at * 8.0 - 0.5).clamp(0.0, 7.0);
    let expected = |wrap: Wrap, at: f32| match wrap {
        Wrap::Repeat => at.rem_euclid(1.0),
        Wrap::Mirror => 1.0 - (1.0 - at.rem_euclid(2.0)).abs(),
        Wrap::Clamp => at.clamp(0.0, 1.0),
    };
    let ramp = texture(8, 8, true, |x, y| [100 + 8 * x as u8, 100 + 8 * y as u8, 0, 255]);
    for wrap in [[Wrap::Repeat, Wrap::Mirror], [Wrap::Mirror, Wrap::Clamp], [Wrap::Clamp, Wrap::Repeat]] {
        let used = TextureUse { wrap, ..0.into() };
        let mut scene = wall(Material { base_color_texture: Some(used), ..Material::default() }, vec![ramp.clone()]);
        // From -1 to 2.
        scene.meshes[0].vertices.iter_mut().for_each(|v| v.uv = v.uv.map(|c| c * 3.0 - 1.0));
        for way in WAYS {
            let colors = colors_on_wall(&seen(&scene, "unlit", way, &ahead()));
            for axis in 0..2 {
                // Repeated borders are blended with one another.
                let near = |at: f32| wrap[axis] == Wrap::Repeat && !(0.07..0.93).contains(&at.rem_euclid(1.0));
                let at = |place: Vec2| place[axis] * 1.5 + 0.5;
                let inner: Vec<_> = colors.iter().filter(|(place, _)| !near(at(*place))).collect();
                // The software device's anisotropic filter is off by up to half a texel, four codes.
                let alike = |mode: Wrap| {
                    let is_alike = |(place, color): &&&(Vec2, Vec3)| {
                        let got = f32::from(srgb8_from_linear(color[axis]));
                        (got - code(expected(mode, at(*place)))).abs() < 5.0
                    };
                    inner.iter().filter(is_alike).count() as f32 / inner.len() as f32
                };
                assert!(
                    inner.len() > 1000 && alike(wrap[axis]) > 0.99,
                    "{way} {wrap:?} {axis}: {} {}",
                    inner.len(),
                    alike(wrap[axis])
                );
                for other in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].into_iter().filter(|w| *w != wrap[axis]) {
                    assert!(alike(other) < 0.8, "{way} {wrap:?}: as good as {other:?}");
                }
            }
        }
    }
}

#[test]
fn a_texture_on_the_second_coordinates_ignores_the_first() {
    let halves = texture(2, 1, true, |x, _| if x == 0 { [255, 0, 0, 255] } else { [0, 255, 0, 0] });
    let second = TextureUse { second_uv: true, wrap: [Wrap::Clamp; 2], texture: 0 };
    let mut scene = wall(Material { base_color_texture: Some(second), ..Material::default() }, vec![halves]);
    scene.meshes[0].vertices.iter_mut().for_each(|v| v.uv = [1.0, 0.5]);
    scene.meshes[0].details = vec![VertexDetail { uv: [0.0, 0.5], ..VertexDetail::default() }; 4];
    for (cutoff, way) in WAYS.into_iter().flat_map(|way| [(0.0, way), (0.5, way)]) {
        // The first coordinates' half would be cut out.
        scene.materials[0].alpha_cutoff = cutoff;
        let colors = colors_on_wall(&seen(&scene, "unlit", way, &ahead()));
        assert!(colors.len() > 500 && colors.iter().all(|(_, c)| c.distance(Vec3::X) < 1e-3), "{way}: {:?}", colors[0]);
    }
}

/// A floor under a lamp and an even sky.
fn open_floor(material: Material, textures: Vec<Texture>) -> Scene {
    let lamp = Light::Directional {
        towards_light_in_world: Vec3::Y,
        irradiance_linear: Vec3::splat(0.25),
        angular_radius_rad: 0.0,
    };
    let environment = Environment::uniform(Vec3::splat(0.5));
    let mut scene = floor_under(&[], Illumination { lights: vec![lamp], environment });
    scene.materials[0] = material;
    scene.textures = textures;
    scene
}

#[test]
fn occlusion_dims_the_environment_and_no_lamp() {
    // 51 of 255 is a fifth; at a strength of 0.5, 0.6 of the sky is open.
    let occluded = |strength: f32| Material {
        occlusion_texture: Some(0.into()),
        occlusion_strength: strength,
        dielectric_reflectance_linear: Vec3::ZERO,
        ..Material::default()
    };
    for (strength, open) in [(0.0, 1.0), (0.5, 0.6), (1.0, 0.2)] {
        let scene = open_floor(occluded(strength), vec![data([51, 255, 255])]);
        for (way, lighting) in
            WAYS.into_iter().flat_map(|way| [(way, "phong"), (way, "shadows"), (way, "soft 1, occlusion 1")])
        {
            let light = floor_light(&seen(&scene, lighting, way, &down_from(3.0)));
            let wanted = 0.25 + 0.5 * open;
            assert!(
                light.len() > 500 && light.iter().all(|(_, l)| (l - wanted).abs() < 2e-3),
                "{way} {lighting} {open}: {:?}",
                light[0]
            );
        }
    }
}

#[test]
fn an_emissive_texture_is_a_factor_of_emission() {
    let material = Material {
        base_color_linear: [0.0, 0.0, 0.0, 1.0],
        emissive_linear: Vec3::new(2.0, 4.0, 1.0),
        emissive_texture: Some(0.into()),
        occlusion_texture: Some(1.into()),
        ..Material::default()
    };
    let glow = texture(1, 1, true, |_, _| [255, 188, 0, 255]);
    let scene = open_floor(material, vec![glow, data([51, 0, 0])]);
    let wanted = Vec3::new(2.0, 4.0 * depth_image::linear_from_srgb8(188), 0.0);
    for way in WAYS {
        let image = seen(&scene, "unlit", way, &down_from(3.0));
        let words = image.color_rgb9e5.iter().zip(&image.inverse_depth_per_m).filter(|(_, depth)| **depth > 0.0);
        let colors: Vec<Vec3> = words.map(|(&word, _)| linear_from_rgb9e5(word)).collect();
        assert!(colors.len() > 500 && colors.iter().all(|c| c.distance(wanted) < 0.02), "{way}: {}", colors[0]);
    }
}

#[test]
fn a_dielectric_reflects_as_its_material_says() {
    let reflectance_linear = Vec3::new(0.16, 0.08, 0.02);
    let material =
        Material { roughness: 0.4, dielectric_reflectance_linear: reflectance_linear, ..Material::default() };
    let wanted = Reflector { reflectance_linear, roughness: 0.4 }.pack();
    for way in WAYS {
        let planes = seen(&open_floor(material.clone(), Vec::new()), "shadows", way, &down_from(3.0)).specular;
        let words = planes.expect("highlights").reflectance_srgb8_roughness8;
        let floor: Vec<u32> = words.into_iter().filter(|&word| word != 0).collect();
        let is_near = |word: &u32| (0..4).all(|i| (word >> (8 * i) & 255).abs_diff(wanted >> (8 * i) & 255) <= 1);
        assert!(floor.len() > 500 && floor.iter().all(is_near), "{way}: {:x}, not {wanted:x}", floor[0]);
    }
}

fn veil(alpha: f32) -> Scene {
    wall(Material { base_color_linear: [1.0, 1.0, 1.0, alpha], alpha_hashed: true, ..Material::default() }, Vec::new())
}

fn coverage(image: &DepthImage) -> Vec<bool> {
    image.inverse_depth_per_m.iter().map(|&depth| depth > 0.0).collect()
}

fn share(of: &[bool]) -> f32 {
    mean(of.iter().map(|&is| f32::from(u8::from(is))))
}

#[test]
fn the_share_of_a_hashed_surface_is_its_alpha() {
    let whole = share(&coverage(&seen(&veil(1.0), "unlit", Visibility::Triangles, &ahead())));
    for alpha in [0.0, 0.1, 0.3, 0.7, 1.0] {
        let [drawn, traced] = WAYS.map(|way| coverage(&seen(&veil(alpha), "unlit", way, &ahead())));
        for covered in [&drawn, &traced] {
            let got = share(covered) / whole;
            // Three standard deviations over a thousand pixels.
            assert!((got - alpha).abs() < 0.05, "{alpha}: {got}");
        }
        let differ = drawn.iter().zip(&traced).filter(|(a, b)| a != b).count();
        assert!(differ < 20, "{alpha}: {differ} pixels");
    }
}

#[test]
fn holes_move_with_the_mesh_and_stay_for_near_cameras() {
    let scene = veil(0.5);
    let at_rest = coverage(&seen(&scene, "unlit", Visibility::Triangles, &ahead()));
    let mut moved = scene.clone();
    let by = Vec3::new(3.0, -2.0, 5.5);
    moved.instances[0].world_from_mesh = Affine3A::from_translation(by);
    let eye = ahead().eye_in_world + by;
    let with_mesh = PinholeCamera::looking_at(eye, eye + Vec3::NEG_Z, Vec3::Y, 0.8, SIZE_PX);
    let follows = coverage(&seen(&moved, "unlit", Visibility::Triangles, &with_mesh));
    let differ = at_rest.iter().zip(&follows).filter(|(a, b)| a != b).count();
    assert!(differ < 30, "{differ}");
    // A step aside by three pixels at the same distance: the same holes, three pixels on.
    let pixel_m = 4.0 / ahead().focal_px.x;
    let aside = PinholeCamera { eye_in_world: Vec3::X * (3.0 * pixel_m), ..ahead() };
    let shifted = coverage(&seen(&scene, "unlit", Visibility::Triangles, &aside));
    let same = (0..shifted.len() - 3).filter(|&i| shifted[i] == at_rest[i + 3]).count() as f32 / shifted.len() as f32;
    assert!(same > 0.97, "{same}");
    let unshifted = shifted.iter().zip(&at_rest).filter(|(a, b)| a == b).count() as f32 / shifted.len() as f32;
    assert!(unshifted < 0.9, "the comparison sees other holes: {unshifted}");
}

#[test]
fn rays_meet_a_hashed_surface_where_their_twin_does() {
    let on_device = upload(&veil(0.5));
    let camera = ahead();
    let traced = coverage(&image(DrawWork { visibility: Visibility::Rays, ..work(&on_device, "unlit") }, &camera));
    let mut twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    twin.footprint = camera.focal_px.min_element().recip();
    let pixels = (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| UVec2::new(x, y)));
    let hit = |pixel| twin.closest(&scalar::rays::pixel_ray(&camera, pixel), camera.near_m).is_some();
    let differ = pixels.zip(&traced).filter(|&(pixel, &there)| hit(pixel) != there).count();
    assert!(differ < 20 && traced.iter().filter(|&&there| there).count() > 300, "{differ}");
}

#[test]
fn light_through_a_hashed_surface_is_dimmed_by_its_alpha() {
    let sun = Light::Directional {
        towards_light_in_world: Vec3::Y,
        irradiance_linear: Vec3::splat(0.5),
        angular_radius_rad: 0.0,
    };
    let lit = Illumination { lights: vec![sun], environment: Environment::default() };
    let mut scene = floor_under(&[(Vec3::Y * 5.0, 4.0, Vec3::NEG_Y)], lit);
    let veil = Material { base_color_linear: [1.0, 1.0, 1.0, 0.3], alpha_hashed: true, ..Material::default() };
    scene.materials.push(veil);
    scene.meshes[1].parts[0].material = 1;
    let light = floor_light(&seen(&scene, "shadows", Visibility::Triangles, &down_from(3.0)));
    let passed = mean(light.iter().map(|(_, l)| *l)) / 0.5;
    assert!(light.len() > 500 && (passed - 0.7).abs() < 0.06, "{passed}");
}

/// A sphere with every kind of texture, some on second coordinates.
fn rich_sphere() -> Scene {
    let mut scene = uv_sphere(1.0, 64);
    let waves = |x: u32, y: u32| (0.4 * ((x as f32) * 0.2).sin(), 0.4 * ((y as f32) * 0.2).cos());
    let bumps = texture(128, 64, false, |x, y| {
        let (a, b) = waves(x, y);
        let unit = Vec3::new(a, b, 1.0).normalize_or(Vec3::Z) * 0.5 + 0.5;
        let [r, g, b] = unit.to_array().map(|c| (c * 255.0) as u8);
        [r, g, b, 255]
    });
    let colors = texture(64, 32, true, |x, y| [(x * 4) as u8, (y * 8) as u8, 120, 255]);
    let orm = texture(64, 32, false, |x, y| [255 - (y * 4) as u8, (x * 3) as u8 + 20, (y * 6) as u8, 255]);
    scene.textures = vec![colors, orm, bumps];
    let second = |texture| TextureUse { second_uv: true, wrap: [Wrap::Mirror, Wrap::Clamp], texture };
    scene.materials[0] = Material {
        base_color_texture: Some(0.into()),
        metallic_roughness_texture: Some(second(1)),
        normal_texture: Some(2.into()),
        occlusion_texture: Some(second(1)),
        dielectric_reflectance_linear: Vec3::splat(0.08),
        ..Material::default()
    };
    let mesh = &mut scene.meshes[0];
    let detail = |v: &scene::Vertex| {
        let around = Vec3::Y.cross(v.normal.into()).normalize_or(Vec3::X);
        VertexDetail { uv: [v.uv[0] * 2.5, v.uv[1] * 1.5 - 0.2], tangent: around.extend(1.0).to_array() }
    };
    mesh.details = mesh.vertices.iter().map(detail).collect();
    scene
}

/// Shares of the pixels of both images whose colours, normals and reflectors are alike.
fn alike(a: &DepthImage, b: &DepthImage) -> [f32; 3] {
    let both: Vec<usize> = (0..a.inverse_depth_per_m.len())
        .filter(|&i| a.inverse_depth_per_m[i] > 0.0 && b.inverse_depth_per_m[i] > 0.0)
        .collect();
    assert!(both.len() > 1000, "{}", both.len());
    let color = |image: &DepthImage, i: usize| linear_from_rgb9e5(image.color_rgb9e5[i]);
    let normal = |image: &DepthImage, i: usize| unit_from_oct16(image.normal_oct16.as_ref().expect("normals")[i]);
    let reflector = |image: &DepthImage, i: usize| {
        let word = image.specular.as_ref().expect("highlights").reflectance_srgb8_roughness8[i];
        [0, 8, 16, 24].map(|at| (word >> at & 255) as i32)
    };
    let share =
        |is_alike: &dyn Fn(usize) -> bool| both.iter().filter(|&&i| is_alike(i)).count() as f32 / both.len() as f32;
    [
        share(&|i| (color(a, i) - color(b, i)).abs().max_element() < 0.03),
        share(&|i| normal(a, i).distance(normal(b, i)) < 0.05),
        share(&|i| reflector(a, i).iter().zip(reflector(b, i)).all(|(a, b)| (a - b).abs() <= 8)),
    ]
}

#[test]
fn rays_shade_mapped_materials_as_triangles_do() {
    let scene = rich_sphere();
    let camera = PinholeCamera::looking_at(Vec3::new(0.8, 0.9, 2.4), Vec3::ZERO, Vec3::Y, 0.8, SIZE_PX);
    let [drawn, traced] = WAYS.map(|way| seen(&scene, "shadows", way, &camera));
    let same = alike(&drawn, &traced);
    println!("colours, normals, reflectors: {same:?}");
    // Mip levels differ at the limb and the poles, where triangles are slanted or their coordinates collapse.
    assert!(same.iter().all(|&share| share > 0.93), "{same:?}");
    // The comparison sees each change.
    let without: [fn(&mut Material); 3] =
        [|m| m.base_color_texture = None, |m| m.normal_texture = None, |m| m.roughness = 0.5];
    for (plane, change) in without.into_iter().enumerate() {
        let mut other = scene.clone();
        change(&mut other.materials[0]);
        let differs = alike(&drawn, &seen(&other, "shadows", Visibility::Triangles, &camera));
        assert!(differs[plane] < 0.8, "{plane}: {differs:?}");
    }
    assert!(device().0.device.features().contains(wgpu::Features::PRIMITIVE_INDEX), "ids were drawn");
}
