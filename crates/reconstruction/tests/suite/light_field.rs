//! What mirrors and rough surfaces show, gathered in layered light fields.

use depth_image::{
    Antialias, CubeGrid, CubeImages, Environment, Highlight, Illumination, LayeredDepthImage, LayeredLightField,
    LightDirections, LightFieldCamera, PinholeCamera, Reflector, View, ViewPlanes, environment_reflectance_linear,
    highlight_linear, linear_from_srgb8, srgb8_from_linear,
};
use fixtures::{mirror_box, teapot_floor, teapot_spheres};
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::scalar::{Reflecting, gathered_light};
use reconstruction::{Mirrors, ReconstructRequest, ReconstructionError, ReconstructionMethod, SampleSet};
use render::{DrawWork, GpuScene, LayerSelection};
use scene::{Material, Scene};

use crate::stage::{depths, description, gpu, looking, plainly_lit, psnr_db, reconstruct, reconstructor, renderer};

const SIDE: u32 = 192;

/// A scene and its cube, with a camera.
pub struct Gathering {
    pub scene: Scene,
    pub on_device: GpuScene,
    pub grid: CubeGrid,
    pub camera: PinholeCamera,
}

impl Gathering {
    pub fn new(scene: Scene, camera: PinholeCamera) -> Self {
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let grid = CubeGrid::around(&scene.bounds(), SIDE).expect("a grid");
        Self { scene, on_device, grid, camera }
    }

    fn mirror_box() -> Self {
        Self::new(mirror_box(), looking(Vec3::new(0.4, 2.0, 6.5), Vec3::Y * 1.2, 40.0, UVec2::new(120, 90)))
    }

    pub fn lit(&self, lighting: &str) -> DrawWork<'_> {
        DrawWork { lighting: lighting.parse().expect(lighting), ..plainly_lit(&self.on_device) }
    }

    fn light_field(&self, directions: LightDirections, lighting: &str) -> LayeredLightField {
        let camera = LightFieldCamera::around(self.scene.bounds(), directions, 64);
        let field = renderer().draw_light_field(self.lit(lighting), &camera).expect("a light field");
        field.validate().expect("a light field");
        field
    }

    pub fn images(&self) -> [LayeredDepthImage; 3] {
        [0, 1, 2].map(|axis| {
            let camera = self.grid.camera(axis);
            renderer().draw_layers(self.lit("shadows"), &camera, LayerSelection::Dominant).expect("layers")
        })
    }

    pub fn set(&self, light_field: Option<LayeredLightField>) -> SampleSet {
        let cube = CubeImages { grid: self.grid, images: self.images(), light_field };
        self.upload(&cube)
    }

    pub fn upload(&self, cube: &CubeImages) -> SampleSet {
        reconstructor().upload_cube(cube, &description(&self.scene), Turn::default()).expect("a cube")
    }

    fn view(&self, set: &SampleSet, method: &str, mirrors: Mirrors<'_>) -> View {
        let method: ReconstructionMethod = method.parse().expect(method);
        let views = reconstructor().reconstruct(ReconstructRequest {
            common: mirrors.into(),
            planes: ViewPlanes::ALL,
            ..ReconstructRequest::new(set, &[self.camera], method)
        });
        views.expect("a view").remove(0)
    }

    pub fn direct(&self, lighting: &str) -> View {
        renderer().draw_views(self.lit(lighting), &[self.camera], ViewPlanes::ALL).expect("a view").remove(0)
    }
}

/// Pixels that two views show differently.
pub fn changed(a: &View, b: &View) -> Vec<bool> {
    let is_other = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2);
    a.srgb8.chunks(3).zip(b.srgb8.chunks(3)).map(is_other).collect()
}

const MIRRORS: Mirrors<'_> = Mirrors { cells: &[], reflections: 7, glossy_rays: 0 };
const GLOSSY: Mirrors<'_> = Mirrors { cells: &[], reflections: 0, glossy_rays: 1 };

#[test]
fn gathered_mirrors_are_blurred_and_rays_before_the_gathering_sharpen_them() {
    let stage = Gathering::mirror_box();
    let [none, truth] = ["shadows", "shadows, reflections 7"].map(|lighting| stage.direct(lighting));
    let pixels = changed(&none, &truth);
    let psnr_db = |view: &View| psnr_db(&truth, view, &pixels);
    let of = |directions| {
        let set = stage.set(Some(stage.light_field(directions, "shadows, reflections 7")));
        ["layered:0", "layered:1", "layered"].map(|method| psnr_db(&stage.view(&set, method, MIRRORS)))
    };
    let [coarse, fine] = [of(LightDirections::D66), of(LightDirections::D258)];
    println!("{} pixels: 66 directions {coarse:.2?} dB, 258 {fine:.2?} dB", pixels.iter().filter(|&&is| is).count());
    assert!(fine[0] > coarse[0] + 1.0 && fine[1] > fine[0] + 5.0, "{coarse:?} {fine:?}");
    assert!(fine[2] > 30.0 && fine[2] > fine[1] + 1.0 && coarse[2] == fine[2], "{coarse:?} {fine:?}");
    assert!(fine[0] > psnr_db(&none) + 3.0, "{fine:?}");
}

/// A teapot on a rough floor, its views without and with many rays into lobes, and the pixels that these change.
pub struct GlossyFloor {
    pub stage: Gathering,
    pub none: View,
    pub truth: View,
    pub pixels: Vec<bool>,
}

impl GlossyFloor {
    pub fn new() -> Self {
        let camera = looking(Vec3::new(8.0, 4.5, 8.0), Vec3::Y, 40.0, UVec2::new(120, 90));
        let stage = Gathering::new(teapot_floor(), camera);
        let [none, truth] = ["shadows", "shadows, glossy 256"].map(|lighting| stage.direct(lighting));
        let pixels = changed(&none, &truth);
        Self { stage, none, truth, pixels }
    }

    pub fn psnr_db(&self, view: &View) -> f64 {
        psnr_db(&self.truth, view, &self.pixels)
    }

    pub fn direct_db(&self, rays: u32) -> f64 {
        self.psnr_db(&self.stage.direct(&format!("shadows, glossy {rays}")))
    }
}

#[test]
fn rough_surfaces_show_what_is_around_them() {
    let floor = GlossyFloor::new();
    let set = floor.stage.set(Some(floor.stage.light_field(LightDirections::D258, "shadows, glossy 1")));
    let gathered = floor.psnr_db(&floor.stage.view(&set, "layered", GLOSSY));
    let [few, none] = [floor.direct_db(4), floor.psnr_db(&floor.none)];
    println!("gathered {gathered:.2} dB, four rays {few:.2} dB, none {none:.2} dB");
    assert!(gathered > few + 3.0 && few > none + 1.0, "{gathered} {few} {none}");
}

#[test]
fn rays_into_lobes_err_as_those_of_direct_drawing_do() {
    let floor = GlossyFloor::new();
    let set = floor.stage.set(None);
    for rays in [1, 4, 16, 64] {
        let mirrors = Mirrors { glossy_rays: rays, ..GLOSSY };
        let [walked, drawn] = [floor.psnr_db(&floor.stage.view(&set, "layered", mirrors)), floor.direct_db(rays)];
        println!("{rays} rays: {walked:.2} dB in the cube, {drawn:.2} dB drawn directly");
        // With many rays what remains is that of the cube's samples.
        assert!(walked > drawn.min(33.5) - 1.5, "{rays}: {walked} {drawn}");
    }
}

/// Many weak rays are as much light as few strong ones.
#[test]
fn the_light_of_many_rays_is_that_of_few() {
    let camera = looking(Vec3::new(8.0, 4.5, 8.0), Vec3::Y, 40.0, UVec2::new(60, 45));
    let mut scene = teapot_floor();
    let floor = Material { metallic: 0.0, base_color_linear: [0.5, 0.5, 0.5, 1.0], ..scene.materials[1].clone() };
    scene.materials[1] = floor;
    let stage = Gathering::new(scene.lit_by(None, Some(Environment::uniform(Vec3::ZERO))), camera);
    let set = stage.set(None);
    let light = |mirrors| {
        let view = stage.view(&set, "layered", mirrors);
        view.srgb8.iter().map(|&code| f64::from(linear_from_srgb8(code))).sum::<f64>()
    };
    let plain = light(Mirrors::default());
    let [few, many] = [8, 256].map(|glossy_rays| light(Mirrors { glossy_rays, ..GLOSSY }) - plain);
    println!("light of 8 rays {few:.2}, of 256 {many:.2}, beside {plain:.0}");
    assert!(few > 0.01 * plain && (many / few - 1.0).abs() < 0.06, "{few} {many}");
}

#[test]
fn mirrors_and_lobes_of_several_samples_in_several_views_are_those_of_direct_drawing() {
    let camera = looking(Vec3::new(8.0, 4.5, 8.0), Vec3::Y, 40.0, UVec2::new(80, 60));
    let stage = Gathering::new(teapot_spheres(), camera);
    let set = stage.set(None);
    let other = looking(Vec3::new(6.0, 5.0, 9.0), Vec3::Y, 40.0, UVec2::new(80, 60));
    let planes = ViewPlanes { antialias: Antialias::of(4).expect("offered"), ..ViewPlanes::COLOR };
    let mirrors = Mirrors { cells: &[], reflections: 2, glossy_rays: 16 };
    let method = ReconstructionMethod::LAYERED;
    let made = |cameras: &[PinholeCamera]| {
        reconstructor()
            .reconstruct(ReconstructRequest {
                common: mirrors.into(),
                planes,
                ..ReconstructRequest::new(&set, cameras, method)
            })
            .expect("views")
    };
    let views = made(&[camera, other]);
    assert_eq!(views[1], made(&[other])[0], "views of a batch are those of each");
    let drawn = |lighting| renderer().draw_views(stage.lit(lighting), &[camera], planes).expect("a view").remove(0);
    let [none, truth] = ["shadows", "shadows, reflections 2, glossy 64"].map(drawn);
    let pixels = changed(&none, &truth);
    let [own, without] = [psnr_db(&truth, &views[0], &pixels), psnr_db(&truth, &none, &pixels)];
    println!("{own:.2} dB, without mirrors and lobes {without:.2} dB");
    assert!(own > 24.0 && own > without + 5.0, "{own} {without}");
}

/// The floor lies at height 0, and all else above it.
#[test]
fn gathering_is_its_twin() {
    let camera = looking(Vec3::new(8.0, 4.5, 8.0), Vec3::Y, 40.0, UVec2::new(60, 45));
    // Above, and nearly level, the floor sees it.
    let sky = Environment {
        zenith_linear: Vec3::new(0.3, 0.1, 0.0),
        nadir_linear: Vec3::new(0.0, 0.1, 0.3),
        is_mapped: false,
    };
    let illumination = Illumination { lights: Vec::new(), environment: sky };
    for roughness in [0.0, 0.15, 0.33, 0.6] {
        let mut scene = teapot_floor().lit_by(None, Some(sky));
        let floor = Material { roughness, ..scene.materials[1].clone() };
        scene.materials[1] = floor.clone();
        let stage = Gathering::new(scene, camera);
        let field = stage.light_field(LightDirections::D66, "shadows, reflections 1, glossy 1");
        let set = stage.set(Some(field.clone()));
        let plain = stage.view(&set, "layered", Mirrors::default());
        let gathered = stage.view(&set, "layered:0", Mirrors { reflections: 1, ..GLOSSY });
        let base = Vec3::from_slice(&floor.base_color_linear[..3]);
        let reflectance_linear = base * floor.metallic + Vec3::splat(0.04 * (1.0 - floor.metallic));
        let mut close = 0;
        let mut pixels = 0;
        for (index, &inverse_depth) in depths(&plain).iter().enumerate() {
            let pixel = UVec2::new(index as u32 % camera.size_px.x, index as u32 / camera.size_px.x);
            let ray = camera.ray(pixel.as_vec2() + 0.5);
            let point_in_world = ray.at(1.0 / inverse_depth);
            if inverse_depth <= 0.0 || point_in_world.y.abs() > 1e-3 {
                continue;
            }
            let normal_in_world = Vec3::Y;
            let towards_eye_in_world = -ray.direction_in_world.normalize_or_zero();
            let reflector = Reflector { reflectance_linear, roughness };
            let surface = Reflecting { point_in_world, normal_in_world, towards_eye_in_world, reflector };
            let light = gathered_light(&field, &surface, |towards| sky.radiance_linear(towards));
            let gathered_linear =
                light * environment_reflectance_linear(normal_in_world, towards_eye_in_world, &reflector);
            // What is gathered takes the place of the environment.
            let mirrored_sky_linear = highlight_linear(
                Highlight::Ggx,
                &illumination,
                &|_| 1.0,
                point_in_world,
                normal_in_world,
                towards_eye_in_world,
                &reflector,
            );
            let added = gathered_linear - mirrored_sky_linear;
            let expected = [0, 1, 2]
                .map(|channel| srgb8_from_linear(linear_from_srgb8(plain.srgb8[3 * index + channel]) + added[channel]));
            let own = &gathered.srgb8[3 * index..][..3];
            pixels += 1;
            close += usize::from(own.iter().zip(expected).all(|(own, twin)| own.abs_diff(twin) <= 2));
        }
        println!("roughness {roughness}: {close} of {pixels} pixels");
        assert!(pixels > 500 && close as f64 > 0.97 * f64::from(pixels), "{roughness}: {close} of {pixels}");
    }
}

#[test]
fn a_method_that_gathers_needs_a_light_field_and_damaged_ones_are_refused() {
    let stage = Gathering::mirror_box();
    let gather: ReconstructionMethod = "layered:0".parse().expect("a method");
    let refused = reconstruct(&stage.set(None), &[stage.camera], gather, ViewPlanes::ALL);
    assert!(matches!(refused, Err(ReconstructionError::NoSamples { needed: "a light field", .. })));
    let field = stage.light_field(LightDirections::D66, "shadows, reflections 1");
    let camera = LightFieldCamera { pairs: 1, ..field.camera };
    let part = LayeredLightField { camera, first: field.first[..=camera.line_count()].to_vec(), ..field.clone() };
    let short = LayeredLightField { radiance_rgb9e5: Vec::new(), ..field };
    for field in [part, short] {
        let images = [0, 1, 2].map(|axis| {
            let camera = stage.grid.camera(axis);
            renderer().draw_layers(stage.lit("unlit"), &camera, LayerSelection::Dominant).expect("layers")
        });
        let cube = CubeImages { grid: stage.grid, images, light_field: Some(field) };
        let refused = reconstructor().upload_cube(&cube, &description(&stage.scene), Turn::default());
        assert!(matches!(refused, Err(ReconstructionError::LightField { .. })));
    }
}
