//! A layered depth cube by the engine alone, as a sampler sends it and a compositor gets it.

use std::sync::OnceLock;

use cluster::Refinement;
use codec::{DecodeLimits, decode_sample_image, encode_sample_image};
use depth_image::{
    CubeGrid, LightDirections, LightFieldCamera, PinholeCamera, SampleCamera, SampleImage, View, ViewPlanes,
    linear_from_rgb9e5,
};
use glam::{UVec2, Vec3};
use node::{DirectWork, Engine, EngineError, SampleSet, SampleWork, SharedSet, Turn, ViewWork, WorkClass};
use scene::Scene;

use crate::stage::{engine, loaded, sample_set};

const HASH: &str = "a box with mirrors";
const LIGHTING: &str = "shadows, reflections 3";
const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };

struct Stand {
    scene: Scene,
}

/// The stand of all tests of this file: its scene is loaded once.
fn stand() -> &'static Stand {
    static STAND: OnceLock<Stand> = OnceLock::new();
    STAND.get_or_init(|| Stand { scene: loaded(HASH, "mirror-box") })
}

impl Stand {
    fn cameras(&self) -> [SampleCamera; 3] {
        let grid = CubeGrid::around(&self.scene.bounds(), 160).expect("a grid");
        [0, 1, 2].map(|axis| grid.camera(axis).into())
    }

    fn work(&self, cameras: &[SampleCamera], sampling: &str) -> SampleWork {
        SampleWork {
            scene_hash: HASH.to_owned(),
            tile_count: 1,
            cameras: cameras.to_vec(),
            wanted: (0..cameras.len() as u32).collect(),
            sampling: sampling.to_owned(),
            planes: engine().sample_planes("layered").expect("a method"),
            lighting: LIGHTING.to_owned(),
            scene_time_s: 0.0,
            refinement: Refinement::default(),
            surfaces_by_rays: None,
        }
    }

    /// The image of a camera, sampled in tiles, each of which is sent.
    fn sent(&self, camera: &SampleCamera, tiles: u32) -> (SampleImage, usize) {
        let mut bytes = 0;
        let tile = |number: u32| {
            let camera = camera.tile(number, tiles);
            let images = engine().sample(&self.work(&[camera], "layered_cube:160"), TURN).expect("an image");
            let encoded = encode_sample_image(&images[0]).expect("planes of one size");
            bytes += encoded.payload.len();
            decode_sample_image(&encoded.header, &camera, &encoded.payload, &DecodeLimits::default()).expect("an image")
        };
        let tiles = (0..tiles).map(tile).collect();
        (SampleImage::from_tiles(camera, tiles).expect("tiles of the image"), bytes)
    }

    fn set(&self, images: Vec<SampleImage>) -> SharedSet {
        let like = sample_set((HASH, &self.scene), &[camera()], LIGHTING);
        let set = SampleSet { images: images.try_into().expect("a cube"), ..like };
        engine().upload(&set, TURN).expect("a set")
    }

    fn view(&self, set: &SharedSet, method: &str) -> Result<View, EngineError> {
        let work = ViewWork { cameras: vec![camera()], method: method.to_owned(), planes: ViewPlanes::ALL };
        Ok(engine().reconstruct(set.as_ref(), &work, TURN)?.remove(0))
    }

    fn direct(&self) -> View {
        let scene_hash = HASH.to_owned();
        let lighting = LIGHTING.to_owned();
        let cameras = vec![camera()];
        let work = DirectWork {
            scene_hash,
            cameras,
            lighting,
            scene_time_s: 0.0,
            planes: ViewPlanes::COLOR,
            surfaces_by_rays: None,
        };
        engine().draw_direct(&work, TURN).expect("a view").remove(0)
    }
}

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(0.6, 1.6, 5.5), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 0.7, UVec2::new(120, 90))
}

fn samples(image: &SampleImage) -> usize {
    let SampleImage::Layered(image) = image else { panic!("a layered image") };
    image.sample_count()
}

fn light_samples(images: &[SampleImage]) -> usize {
    let [SampleImage::LightField(field)] = images else { panic!("a light field") };
    field.sample_count()
}

/// The name of the setting that an error is about, and the reason.
fn field(error: EngineError) -> (&'static str, String) {
    match error {
        EngineError::InvalidArgument { field, reason } => (field, reason),
        other => panic!("{other}"),
    }
}

fn rms(a: &View, b: &View) -> f64 {
    let squares: f64 = a.srgb8.iter().zip(&b.srgb8).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    (squares / a.srgb8.len() as f64).sqrt()
}

#[test]
fn a_cube_that_was_sent_in_tiles_shows_the_scene_and_what_mirrors_show() {
    let stand = stand();
    let cameras = stand.cameras();
    let (whole, bytes): (Vec<_>, Vec<_>) = cameras.iter().map(|camera| stand.sent(camera, 1)).unzip();
    let (tiled, _): (Vec<_>, Vec<_>) = cameras.iter().map(|camera| stand.sent(camera, 3)).unzip();
    let count: usize = whole.iter().map(samples).sum();
    println!("{:.1} bytes a sample of {count}", bytes.iter().sum::<usize>() as f64 / count as f64);
    for (whole, tiled) in whole.iter().zip(&tiled) {
        let whole = samples(whole);
        let tiled = samples(tiled);
        assert!(whole.abs_diff(tiled) * 1000 <= whole, "{whole} and {tiled} samples");
    }
    let direct = stand.direct();
    let [whole, tiled] = [whole, tiled].map(|images| stand.view(&stand.set(images), "layered").expect("a view"));
    let errors = [rms(&whole, &direct), rms(&tiled, &direct), rms(&whole, &tiled)];
    println!("errors of 255: whole {:.2}, tiled {:.2}, of each other {:.2}", errors[0], errors[1], errors[2]);
    assert!(errors[0] < 12.0 && errors[1] < 12.0, "22 dB and more: {errors:?}");
    assert!(errors[2] < 3.0, "{errors:?}");
}

#[test]
fn methods_and_cameras_that_do_not_suit_are_refused_by_name() {
    let stand = stand();
    let cube: Vec<_> = stand.cameras().iter().map(|camera| stand.sent(camera, 1).0).collect();
    let refused = field(stand.view(&stand.set(cube.clone()), "joint_carve").expect_err("no depth images"));
    assert_eq!(refused.0, "reconstruction_method", "{}", refused.1);
    let depth = engine().sample(&stand.work(&[camera().into()], "conventional"), TURN).expect("an image");
    let refused = field(stand.view(&stand.set(depth.clone()), "layered").expect_err("no cube"));
    assert_eq!(refused.0, "reconstruction_method", "{}", refused.1);
    let lines = stand.work(&stand.cameras(), "conventional");
    let refused = field(engine().sample(&lines, TURN).expect_err("lines"));
    assert_eq!(refused.0, "sampling_method", "{}", refused.1);
    let views = stand.work(&[camera().into()], "layered_cube:64");
    let refused = field(engine().sample(&views, TURN).expect_err("a camera of a view"));
    assert_eq!(refused.0, "sample_cameras", "{}", refused.1);
    let mixed = [&cube[..2], &depth].concat();
    assert!(depth_image::SampleImages::try_from(mixed).is_err());
    assert!(depth_image::SampleImages::try_from(cube[..2].to_vec()).is_err());
}

#[test]
fn a_light_field_is_sampled_where_mirrors_are_followed_and_views_gather_in_it() {
    let stand = stand();
    let around = LightFieldCamera::around(stand.scene.bounds(), LightDirections::D66, 32);
    let sampled = |lighting: &str| {
        let work = stand.work(&[around.into()], "layered_cube:160+light_field:66x32");
        engine().sample(&SampleWork { lighting: lighting.to_owned(), ..work }, TURN)
    };
    let count = light_samples(&sampled("shadows, reflections 1").expect("a light field"));
    // As for a session that has lost its reflections under overload.
    assert_eq!(light_samples(&sampled("shadows").expect("no mirrors are followed")), 0);
    let cube: Vec<_> = stand.cameras().iter().map(|camera| stand.sent(camera, 1).0).collect();
    let (light, bytes) = stand.sent(&around.into(), 3);
    let set = stand.set([&cube[..], &[light]].concat());
    let [followed, gathered] = ["layered", "layered:0"].map(|method| stand.view(&set, method).expect("a view"));
    let direct = stand.direct();
    let errors = [rms(&followed, &direct), rms(&gathered, &direct), rms(&followed, &gathered)];
    println!("{count} samples, {:.1} bytes each", bytes as f64 / count as f64);
    println!("errors of 255: followed {:.2}, gathered {:.2}, of each other {:.2}", errors[0], errors[1], errors[2]);
    assert!(count > 10_000 && errors[2] > 2.0 && errors[1] > errors[0] && errors[1] < 30.0, "{count} {errors:?}");
    let refused = field(stand.view(&stand.set(cube), "layered:0").expect_err("no light field"));
    assert_eq!(refused.0, "reconstruction_method", "{}", refused.1);
}

/// A ray a lamp, then two, four and eight: the places stay, and the light comes nearer to that of all rays.
#[test]
fn light_in_steps_refines_a_light_field_as_it_does_the_cube() {
    let stand = stand();
    let around = LightFieldCamera::around(stand.scene.bounds(), LightDirections::D66, 16);
    let sampled = |camera: SampleCamera, refinement| {
        let work = stand.work(&[camera], "layered_cube:160+light_field:66x16");
        let work = SampleWork { lighting: "soft 8, reflections 2".to_owned(), refinement, ..work };
        engine().sample(&work, TURN).expect("an image").remove(0)
    };
    let steps = (0..4).map(|step| Refinement { step, steps: 4 });
    let light = |image: &SampleImage| match image {
        SampleImage::LightField(field) => (field.first.clone(), field.radiance_rgb9e5.clone()),
        SampleImage::Layered(image) => (image.first.clone(), image.color_rgb9e5.clone()),
        SampleImage::Depth(_) => panic!("an image of a cube"),
    };
    for camera in [around.into(), stand.cameras()[0]] {
        let whole = light(&sampled(camera, Refinement::default()));
        let errors: Vec<f32> = steps
            .clone()
            .map(|refinement| {
                let (first, colors) = light(&sampled(camera, refinement));
                assert_eq!(first, whole.0, "the same samples");
                let squares = colors
                    .iter()
                    .zip(&whole.1)
                    .map(|(&a, &b)| linear_from_rgb9e5(a).distance_squared(linear_from_rgb9e5(b)));
                (squares.sum::<f32>() / colors.len() as f32).sqrt()
            })
            .collect();
        println!("{} samples, errors by steps {errors:?}", whole.1.len());
        assert!(whole.1.len() > 2_000 && errors[0] > 0.0 && errors[3] == 0.0, "{errors:?}");
        assert!(errors.is_sorted_by(|a, b| a > b), "{errors:?}");
    }
}
