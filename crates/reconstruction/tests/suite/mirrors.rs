//! Mirrors that show the scene: rays off them are followed in images of their surroundings, against direct drawing.

use depth_image::{
    Aabb, Antialias, Camera, CubeImages, DepthImage, Highlight, PinholeCamera, ProvenanceKind, View, ViewPlanes,
};
use fixtures::{mirror_pair, teapot_mirror};
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::{
    CommonSets, MirrorCell, Mirrors, ReconstructRequest, ReconstructionError, SampleSet, SetDescription,
};
use render::{GpuScene, LayerSelection, SamplePlanes};
use scene::Scene;

use crate::layered::CubeStage;
use crate::light_field::Gathering;
use crate::stage::{CARVE, count, description, gpu, kinds, looking, reconstructor, renderer, work};

const VIEW_PX: UVec2 = UVec2::new(128, 96);

/// A scene on the device, the images that views are made from, and those of mirrors' surroundings.
struct Hall {
    on_device: GpuScene,
    samples: SampleSet,
    /// Boxes with their images.
    cells: Vec<(Aabb, SampleSet)>,
}

/// Six images that see everything around a place, and overlap.
fn six_faces(middle: Vec3, side_px: u32) -> Vec<PinholeCamera> {
    let towards = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    towards.into_iter().map(|towards| looking(middle, middle + towards, 94.0, UVec2::splat(side_px))).collect()
}

impl Hall {
    fn new(scene: Scene, samples: &[PinholeCamera], cells: &[(Aabb, Vec<PinholeCamera>)]) -> Self {
        Self::with_mips(scene, samples, cells, true)
    }

    fn with_mips(scene: Scene, samples: &[PinholeCamera], cells: &[(Aabb, Vec<PinholeCamera>)], mips: bool) -> Self {
        let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
        let set = |cameras: &[PinholeCamera]| {
            let images = images(&on_device, cameras);
            let described = SetDescription { mips, ..description(&scene) };
            reconstructor().upload(&images, &described, Turn::default()).expect("a sample set")
        };
        let samples = set(samples);
        let cells = cells.iter().map(|(bounds, cameras)| (*bounds, set(cameras))).collect();
        Self { on_device, samples, cells }
    }

    fn view(&self, camera: &PinholeCamera, reflections: u32) -> View {
        self.view_beside(None, camera, reflections)
    }

    fn view_beside(&self, base: Option<&SampleSet>, camera: &PinholeCamera, reflections: u32) -> View {
        let cells: Vec<MirrorCell<'_>> =
            self.cells.iter().map(|(bounds, surroundings)| MirrorCell { bounds: *bounds, surroundings }).collect();
        let common = CommonSets {
            mirrors: Mirrors { cells: &cells, reflections, glossy_rays: 0 },
            base,
            ..CommonSets::default()
        };
        reconstruct(&self.samples, common, &[*camera], ViewPlanes::ALL).expect("a view").remove(0)
    }

    fn drawn(&self, camera: &PinholeCamera, reflections: u32) -> View {
        let lighting =
            if reflections == 0 { "shadows".to_owned() } else { format!("shadows, reflections {reflections}") };
        let work = work(&self.on_device, &lighting);
        renderer().draw_views(work, &[*camera], ViewPlanes::ALL).expect("a view").remove(0)
    }
}

fn reconstruct<'s>(
    set: &SampleSet,
    common: impl Into<CommonSets<'s>>,
    cameras: &[PinholeCamera],
    planes: ViewPlanes,
) -> Result<Vec<View>, ReconstructionError> {
    let common = common.into();
    reconstructor().reconstruct(ReconstructRequest { common, planes, ..ReconstructRequest::new(set, cameras, CARVE) })
}

pub fn images(scene: &GpuScene, cameras: &[PinholeCamera]) -> Vec<DepthImage> {
    let cameras: Vec<Camera> = cameras.iter().map(|camera| Camera::Pinhole(*camera)).collect();
    let planes = SamplePlanes { specular: true, ..SamplePlanes::default() };
    renderer().draw_depth_images(work(scene, "shadows"), &cameras, planes).expect("depth images")
}

/// The greatest difference of each pixel's channels, in codes.
fn differences(a: &View, b: &View) -> Vec<u8> {
    let of = |(a, b): (&[u8], &[u8])| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    a.srgb8.chunks_exact(3).zip(b.srgb8.chunks_exact(3)).map(of).collect()
}

fn mean_difference(a: &View, b: &View) -> f32 {
    let differences = differences(a, b);
    differences.iter().map(|&difference| f32::from(difference)).sum::<f32>() / differences.len() as f32
}

/// Whether the truth has a pixel's colour there or in a pixel beside it: mirrors shrink patterns to the size of pixels.
fn is_near(view: &View, truth: &View, pixel: usize) -> bool {
    let width = view.size_px.x as i32;
    let place = pixel as i32;
    let color = |view: &View, at: i32| -> Option<[u8; 3]> {
        view.srgb8.get(3 * usize::try_from(at).ok()?..)?.first_chunk().copied()
    };
    let own = color(view, place);
    let beside = (-1..=1).flat_map(|row| (-1..=1).map(move |column| place + row * width + column));
    beside.filter_map(|at| Some((own?, color(truth, at)?))).any(|(a, b)| (0..3).all(|i| a[i].abs_diff(b[i]) <= 16))
}

fn before_the_teapot() -> Hall {
    before_the_teapot_with_mips(true)
}

fn before_the_teapot_with_mips(mips: bool) -> Hall {
    let scene = teapot_mirror();
    let middle = Vec3::new(0.0, 3.1, -4.5);
    let bounds = Aabb { min: middle - 3.6, max: middle + 3.6 };
    let eye = |x: f32, y: f32| {
        looking(Vec3::new(9.0 + x, 7.0 + y, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, UVec2::new(200, 150))
    };
    let samples = [eye(-0.5, -0.5), eye(0.5, 0.5), eye(0.5, -0.5), eye(-0.5, 0.5)];
    Hall::with_mips(scene, &samples, &[(bounds, six_faces(middle, 192))], mips)
}

/// Of one ray a pixel, as the truth has.
#[test]
fn a_dented_mirror_shows_the_teapot() {
    let hall = before_the_teapot_with_mips(false);
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let [plain, truth] = [0, 1].map(|reflections| hall.drawn(&camera, reflections));
    // Pixels in which the scene differs from the environment.
    let mirrored: Vec<usize> =
        differences(&plain, &truth).iter().enumerate().filter(|(_, d)| **d > 8).map(|(i, _)| i).collect();
    let share_near = |view: &View| {
        mirrored.iter().filter(|&&pixel| is_near(view, &truth, pixel)).count() as f32 / mirrored.len() as f32
    };
    let with = hall.view(&camera, 1);
    let without = hall.view(&camera, 0);
    let [with_near, without_near] = [&with, &without].map(share_near);
    let guessed = kinds(&with).iter().filter(|&&kind| kind == ProvenanceKind::Guessed).count();
    println!("{} pixels: {with_near} are near, {without_near} without rays, {guessed} guessed", mirrored.len());
    assert!(mirrored.len() > 800, "{}", mirrored.len());
    assert!(with_near > 0.8 && without_near < 0.3, "{with_near}, without {without_near}");
    assert!(guessed * 20 < mirrored.len(), "{guessed} of {}", mirrored.len());
}

/// Against the mean of sixteen rays a pixel.
#[test]
fn what_a_mirror_shrinks_is_filtered() {
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let [filtered, unfiltered] = [true, false].map(before_the_teapot_with_mips);
    let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::COLOR };
    let work = work(&filtered.on_device, "shadows, reflections 1");
    let truth = renderer().draw_views(work, &[camera], planes).expect("a view").remove(0);
    let [plain, mirrored] = [0, 1].map(|reflections| filtered.drawn(&camera, reflections));
    let shows_mirror: Vec<bool> = differences(&plain, &mirrored).iter().map(|difference| *difference > 8).collect();
    let error = |hall: &Hall| {
        let differences = differences(&hall.view(&camera, 1), &truth);
        let squares = differences.iter().zip(&shows_mirror).filter(|(_, is)| **is).map(|(d, _)| f32::from(*d).powi(2));
        squares.sum::<f32>().sqrt()
    };
    let [filtered, unfiltered] = [filtered, unfiltered].map(|hall| error(&hall));
    assert!(filtered < 0.8 * unfiltered, "{filtered}, unfiltered {unfiltered}");
}

/// Its images have larger texels than the view has pixels, but of what is close to it.
#[test]
fn a_flat_mirror_that_enlarges_is_not_filtered() {
    let [filtered, unfiltered] = [true, false].map(|mips| between_two_mirrors(mips).view(&facing_a_mirror(), 1));
    let changed = differences(&filtered, &unfiltered).iter().filter(|difference| **difference > 0).count();
    let pixels = VIEW_PX.element_product() as usize;
    println!("{changed} of {pixels} pixels are filtered");
    assert!(changed * 20 < pixels, "{changed} of {pixels}");
}

#[test]
fn mirrors_in_no_cell_show_the_environment() {
    let mut hall = before_the_teapot();
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let without = hall.view(&camera, 0);
    hall.cells[0].0 = Aabb { min: Vec3::splat(50.0), max: Vec3::splat(51.0) };
    let view = hall.view(&camera, 4);
    assert!(differences(&view, &without).iter().all(|&difference| difference <= 2));
    assert!(!kinds(&view).contains(&ProvenanceKind::Guessed));
    hall.cells.clear();
    assert!(hall.view(&camera, 4) == without);
}

#[test]
fn sets_without_mirrors_are_what_they_are_without_cells() {
    let hall = before_the_teapot();
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let scene = teapot_mirror();
    for highlight in [None, Some(Highlight::BlinnPhong)] {
        let images = images(&hall.on_device, &[camera]);
        let description = SetDescription { highlight, ..description(&scene) };
        let set = reconstructor().upload(&images, &description, Turn::default()).expect("a sample set");
        let [without, with] = [0, 2].map(|reflections| {
            let bounds = hall.cells[0].0;
            let surroundings = &hall.cells[0].1;
            let cells = [MirrorCell { bounds, surroundings }];
            reconstruct(&set, Mirrors { cells: &cells, reflections, glossy_rays: 0 }, &[camera], ViewPlanes::ALL)
                .expect("a view")
        });
        assert!(with == without, "{highlight:?}");
    }
}

#[test]
fn views_with_several_samples_a_pixel_are_the_same_together_and_alone() {
    let hall = before_the_teapot();
    let camera = |x: f32| looking(Vec3::new(9.0 + x, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, UVec2::new(64, 48));
    let cameras = [camera(-0.3), camera(0.1), camera(0.4)];
    let bounds = hall.cells[0].0;
    let surroundings = &hall.cells[0].1;
    // The smaller of two cells counts.
    let around = Aabb { min: bounds.min - 1.0, max: bounds.max + 1.0 };
    let cells = [MirrorCell { bounds: around, surroundings: &hall.samples }, MirrorCell { bounds, surroundings }];
    let planes = ViewPlanes { antialias: Antialias::of(4).expect("four samples"), ..ViewPlanes::ALL };
    let views = |cells: &[MirrorCell<'_>], cameras: &[PinholeCamera]| {
        reconstruct(&hall.samples, Mirrors { cells, reflections: 2, glossy_rays: 0 }, cameras, planes).expect("views")
    };
    let together = views(&cells, &cameras);
    let alone: Vec<View> = cameras.iter().map(|camera| views(&cells[1..], &[*camera]).remove(0)).collect();
    assert!(together == alone);
}

#[test]
fn what_no_image_knows_is_guessed_and_said_to_be() {
    let mut hall = before_the_teapot();
    // Images that look away from everything.
    let away = looking(Vec3::new(0.0, 60.0, 0.0), Vec3::new(0.0, 61.0, 0.1), 50.0, UVec2::new(32, 32));
    let blind = Hall::new(teapot_mirror(), &[away], &[]).samples;
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let without = hall.view(&camera, 0);
    hall.cells[0].1 = blind;
    let view = hall.view(&camera, 1);
    let kinds = kinds(&view);
    let guessed = (0..kinds.len()).filter(|&i| kinds[i] == ProvenanceKind::Guessed);
    let differences = differences(&view, &without);
    let greatest = guessed.clone().map(|i| differences[i]).max();
    assert!(guessed.count() > 800);
    // The guess is the environment, as without rays: all but roundings of shared exponents.
    assert!(greatest <= Some(6), "{greatest:?}");
}

/// A base without anything that reflects, as one is whose lines miss all mirrors.
#[test]
fn a_matt_base_tells_what_no_image_knows() {
    let mut hall = before_the_teapot();
    let away = looking(Vec3::new(0.0, 60.0, 0.0), Vec3::new(0.0, 61.0, 0.1), 50.0, UVec2::new(32, 32));
    hall.cells[0].1 = Hall::new(teapot_mirror(), &[away], &[]).samples;
    let matt_base = CubeStage::new(teapot_mirror(), 128, LayerSelection::Dominant).upload();
    let camera = looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX);
    let guessed = hall.view(&camera, 2);
    let told = hall.view_beside(Some(&matt_base), &camera, 2);
    let truth = hall.drawn(&camera, 1);
    let [before, after] = [&guessed, &told].map(|view| mean_difference(view, &truth));
    println!("mean difference {before} guessed, {after} by a base");
    assert!(count(&guessed, ProvenanceKind::Guessed) > 800 && count(&told, ProvenanceKind::Guessed) == 0);
    assert!(count(&told, ProvenanceKind::Base) > 800 && after < before, "{before}, {after}");
}

/// Pixels in which mirrors show the scene, and of how many views are near the truth there.
struct Mirrored {
    truth: View,
    pixels: Vec<usize>,
}

impl Mirrored {
    fn of(hall: &Hall, camera: &PinholeCamera, reflections: u32) -> Self {
        let plain = hall.drawn(camera, 0);
        let truth = hall.drawn(camera, reflections);
        let differs = differences(&plain, &truth).into_iter().enumerate().filter(|(_, difference)| *difference > 8);
        Self { pixels: differs.map(|(pixel, _)| pixel).collect(), truth }
    }

    fn near(&self, view: &View) -> f32 {
        let near = self.pixels.iter().filter(|&&pixel| is_near(view, &self.truth, pixel)).count();
        near as f32 / self.pixels.len() as f32
    }

    fn of_kind(&self, view: &View, kind: ProvenanceKind) -> usize {
        let kinds = kinds(view);
        self.pixels.iter().filter(|&&pixel| kinds[pixel] == kind).count()
    }
}

fn onto_the_dented_mirror() -> PinholeCamera {
    looking(Vec3::new(9.1, 7.1, 12.5), Vec3::new(0.0, 2.0, -2.5), 28.0, VIEW_PX)
}

#[test]
fn mirrors_in_no_cell_show_what_a_base_holds() {
    let mut hall = before_the_teapot();
    let camera = onto_the_dented_mirror();
    let base = Gathering::new(teapot_mirror(), camera).set(None);
    let mirrored = Mirrored::of(&hall, &camera, 2);
    let elsewhere = Aabb { min: Vec3::splat(50.0), max: Vec3::splat(51.0) };
    hall.cells[0].0 = elsewhere;
    let [without, beside_a_cell] = [None, Some(&base)].map(|base| hall.view_beside(base, &camera, 2));
    hall.cells.clear();
    let view = hall.view_beside(Some(&base), &camera, 2);
    assert!(view == beside_a_cell, "a cell of no mirror changes nothing");
    let [before, after] = [&without, &view].map(|view| mirrored.near(view));
    let from_base = mirrored.of_kind(&view, ProvenanceKind::Base);
    println!("{} pixels: {before} near without a base, {after} with one, {from_base} from it", mirrored.pixels.len());
    assert!(mirrored.pixels.len() > 800 && from_base * 20 > mirrored.pixels.len() * 19, "{from_base}");
    assert!(after > 0.7 && before < 0.3, "{after}, without {before}");
    assert_eq!(count(&view, ProvenanceKind::Guessed), 0);
}

#[test]
fn what_a_truncated_base_does_not_hold_is_guessed() {
    let mut hall = before_the_teapot();
    let camera = onto_the_dented_mirror();
    hall.cells.clear();
    let stage = Gathering::new(teapot_mirror(), camera);
    let view = |is_truncated| {
        let mut images = stage.images();
        images[0].truncated = is_truncated;
        let base = stage.upload(&CubeImages { grid: stage.grid, images, light_field: None });
        hall.view_beside(Some(&base), &camera, 1)
    };
    let [whole, truncated] = [false, true].map(view);
    let whole = kinds(&whole);
    let truncated = kinds(&truncated);
    let of_base =
        whole.iter().zip(&truncated).filter(|(kind, _)| **kind == ProvenanceKind::Base).map(|(_, kind)| *kind);
    let known = ProvenanceKind::Base;
    let guessed = ProvenanceKind::Guessed;
    let counts = [known, guessed].map(|kind| of_base.clone().filter(|of| *of == kind).count());
    println!("{counts:?} known and guessed of {}", of_base.clone().count());
    assert!(counts[0] > 500 && counts[1] > 200 && counts[0] + counts[1] == of_base.count(), "{counts:?}");
    assert!(!whole.contains(&guessed));
}

/// The view's only image shows the mirror from behind, and its set reflects nothing.
#[test]
fn mirrors_that_only_the_base_shows_show_the_scene() {
    let mut hall = before_the_teapot();
    let camera = onto_the_dented_mirror();
    let behind = looking(Vec3::new(0.0, 4.0, -16.0), Vec3::new(0.0, 2.0, 5.0), 60.0, UVec2::new(160, 120));
    let scene = teapot_mirror();
    let matt = SetDescription { highlight: None, ..description(&scene) };
    hall.samples =
        reconstructor().upload(&images(&hall.on_device, &[behind]), &matt, Turn::default()).expect("a sample set");
    let base = Gathering::new(teapot_mirror(), camera).set(None);
    let mut mirrored = Mirrored::of(&hall, &camera, 1);
    let found = kinds(&hall.view_beside(Some(&base), &camera, 0));
    mirrored.pixels.retain(|&pixel| found[pixel] == ProvenanceKind::Base);
    let shares =
        |hall: &Hall| [0, 1].map(|reflections| mirrored.near(&hall.view_beside(Some(&base), &camera, reflections)));
    let in_images = shares(&hall);
    hall.cells.clear();
    let in_base = shares(&hall);
    println!("{} pixels, near without rays and with them:", mirrored.pixels.len());
    println!("{in_images:?} in images of the mirror's cell, {in_base:?} in the base");
    assert!(mirrored.pixels.len() > 400, "{}", mirrored.pixels.len());
    for [without, with] in [in_images, in_base] {
        assert!(with > 0.6 && without < 0.3, "{with}, without {without}");
    }
}

#[test]
fn rays_go_on_between_a_mirror_with_a_cell_and_one_in_the_base() {
    let mut hall = between_two_mirrors(true);
    let camera = facing_a_mirror();
    hall.cells.truncate(1);
    let base = Gathering::new(mirror_pair(), camera).set(None);
    for reflections in [1, 2, 4] {
        let truth = hall.drawn(&camera, reflections);
        let [without, with] =
            [None, Some(&base)].map(|base| mean_difference(&hall.view_beside(base, &camera, reflections), &truth));
        println!("{reflections} reflections: mean difference {without} without a base, {with} with one");
        assert!(with < without, "{reflections}: {with}, {without}");
    }
    let twice = hall.drawn(&camera, 2);
    let [one, two] =
        [1, 2].map(|reflections| mean_difference(&hall.view_beside(Some(&base), &camera, reflections), &twice));
    assert!(two < 0.97 * one, "{two} by two mirrors, {one} by one");
}

fn facing_a_mirror() -> PinholeCamera {
    looking(Vec3::new(-1.55, 1.95, 4.4), Vec3::new(2.0, 1.2, 1.2), 40.0, VIEW_PX)
}

fn between_two_mirrors(mips: bool) -> Hall {
    let scene = mirror_pair();
    let cell = |x: f32| {
        let bounds = Aabb { min: Vec3::new(x - 0.05, -0.1, -3.1), max: Vec3::new(x + 0.05, 3.1, 3.1) };
        // Before the mirror: its own plane is behind all images.
        let middles = [Vec3::new(x, 1.5, -1.0), Vec3::new(x, 1.5, 1.2)];
        let towards = Vec3::new(-x.signum(), 0.0, 0.0);
        let cameras = middles.map(|middle| looking(middle, middle + towards, 120.0, UVec2::new(192, 192)));
        (bounds, cameras.to_vec())
    };
    let eye = |x: f32, y: f32| {
        looking(Vec3::new(-1.6 + x, 1.9 + y, 4.4), Vec3::new(2.0, 1.2, 1.2), 40.0, UVec2::new(200, 150))
    };
    let samples = [eye(-0.2, -0.2), eye(0.2, 0.2), eye(0.2, -0.2), eye(-0.2, 0.2)];
    Hall::with_mips(scene, &samples, &[cell(2.0), cell(-2.0)], mips)
}

#[test]
fn two_mirrors_repeat_the_ball() {
    let hall = between_two_mirrors(true);
    let camera = facing_a_mirror();
    let mut errors = Vec::new();
    for reflections in 1..=4 {
        errors.push(mean_difference(&hall.view(&camera, reflections), &hall.drawn(&camera, reflections)));
    }
    let without = mean_difference(&hall.view(&camera, 0), &hall.drawn(&camera, 4));
    println!("mean difference in codes by reflections: {errors:?}, without {without}");
    assert!(errors.iter().all(|error| *error < 0.75 * without), "{errors:?}, without {without}");
    // The second mirror's images answer the rays off the first.
    let twice = hall.drawn(&camera, 2);
    let [one, two] = [1, 2].map(|reflections| mean_difference(&hall.view(&camera, reflections), &twice));
    assert!(two < 0.97 * one, "{two} by two mirrors, {one} by one");
}

#[test]
fn more_than_the_limits_is_refused() {
    let hall = before_the_teapot();
    let bounds = hall.cells[0].0;
    let surroundings = &hall.cells[0].1;
    let cells = [MirrorCell { bounds, surroundings }; 9];
    let refused = |cells: &[MirrorCell<'_>], reflections| {
        reconstruct(&hall.samples, Mirrors { cells, reflections, glossy_rays: 0 }, &[], ViewPlanes::ALL)
            .expect_err("beyond the limits")
    };
    assert!(matches!(refused(&cells, 1), ReconstructionError::MirrorCells(9)));
    assert!(matches!(refused(&cells[..8], 9), ReconstructionError::Reflections(9)));
}
