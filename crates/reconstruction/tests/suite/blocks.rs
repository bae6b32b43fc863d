//! Blocks of a scene: rays are searched in the images of each block that they cross, front to back.

use depth_image::{Aabb, Antialias, DepthImage, PinholeCamera, Provenance, ProvenanceKind, View, ViewPlanes};
use fixtures::{poles, quad};
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::{
    CommonSets, MirrorCell, Mirrors, ReconstructRequest, ReconstructionError, ReconstructionMethod, SampleSet,
};
use scene::procedural::tree_terrain;
use scene::{Instance, Scene};

use crate::stage::{Agreement, CARVE, Corners, SEARCH, Stage, VIEW_PX, depths, kinds, looking, matt, reconstructor};

/// A scene with images of its view cell, and of each block.
struct BlockStage {
    own: Stage,
    blocks: Vec<Stage>,
}

impl BlockStage {
    /// Columns and rows of blocks over the ground. Their cameras stand half a block's width above the scene, and higher.
    fn new(scene: Scene, corners: &Corners, columns: u32, rows: u32) -> Self {
        let bounds = scene.bounds();
        let side = bounds.size() / Vec3::new(columns as f32, 1.0, rows as f32);
        let places =
            (0..rows).flat_map(|row| (0..columns).map(move |column| Vec3::new(column as f32, 0.0, row as f32)));
        let blocks = places.map(|place| {
            let min = bounds.min + place * side;
            let volume = Aabb { min, max: min + side };
            let half_m = 0.5 * side.x.max(side.z);
            let middle = volume.center().with_y(volume.min.y);
            let over = Corners { eye: middle + Vec3::Y * (side.y + 3.0 * half_m), target: middle, half_m };
            Stage { volume, ..Stage::new(scene.clone(), &over.samples(4)) }
        });
        Self { blocks: blocks.collect(), own: Stage::new(scene, &corners.samples(4)) }
    }

    fn views(
        &self,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
    ) -> Result<Vec<View>, ReconstructionError> {
        let own = self.own.upload();
        let sets: Vec<SampleSet> = self.blocks.iter().map(Stage::upload).collect();
        let blocks: Vec<&SampleSet> = sets.iter().collect();
        let common = CommonSets { blocks: &blocks, ..CommonSets::default() };
        let request = ReconstructRequest::new(&own, cameras, method);
        reconstructor().reconstruct(ReconstructRequest { common, planes, ..request })
    }

    fn view(&self, camera: &PinholeCamera, method: ReconstructionMethod) -> View {
        self.views(&[*camera], method, ViewPlanes::ALL).expect("a view").remove(0)
    }

    /// The first hit among the twins of the blocks. What some block leaves unknown is the twin of the view cell.
    fn twin(&self, camera: &PinholeCamera, method: ReconstructionMethod) -> View {
        let eye = camera.eye_in_world;
        let distance = |stage: &&Stage| eye.distance(eye.clamp(stage.volume.min, stage.volume.max));
        let mut nearest_first: Vec<&Stage> = self.blocks.iter().collect();
        nearest_first.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let of_blocks: Vec<View> = nearest_first.iter().map(|stage| stage.twin(camera, method)).collect();
        let mut made = self.own.twin(camera, method);
        for pixel in 0..camera.pixel_count() {
            let kind = |view: &View| kinds(view)[pixel];
            let hit = of_blocks.iter().find(|view| kind(view) == ProvenanceKind::Hit);
            if let Some(hit) = hit {
                copy_pixel(&mut made, hit, pixel);
            } else if of_blocks.iter().all(|view| kind(view) == ProvenanceKind::Empty) {
                copy_pixel(&mut made, &of_blocks[0], pixel);
            }
        }
        made
    }
}

fn copy_pixel(to: &mut View, from: &View, pixel: usize) {
    to.srgb8[3 * pixel..3 * pixel + 3].copy_from_slice(&from.srgb8[3 * pixel..3 * pixel + 3]);
    to.inverse_depth_per_m.as_mut().expect("depth")[pixel] = depths(from)[pixel];
    let provenance: Provenance = from.provenance.as_ref().expect("provenance")[pixel];
    to.provenance.as_mut().expect("provenance")[pixel] = provenance;
}

fn terrain() -> (BlockStage, Corners) {
    let corners = Corners { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::Y * 0.3, half_m: 0.4 };
    (BlockStage::new(tree_terrain(30_000, 1), &corners, 3, 2), corners)
}

#[test]
fn views_from_blocks_are_those_of_the_twins() {
    let (terrain, over) = terrain();
    let beside = Corners { eye: Vec3::Z * 4.0, target: Vec3::Z * -2.0, half_m: 0.6 };
    let poles = BlockStage::new(poles(0.08), &beside, 2, 2);
    for (name, stage, corners) in [("terrain", terrain, over), ("poles", poles, beside)] {
        for method in [CARVE, SEARCH] {
            let camera = corners.view();
            let agreement = Agreement::of(&stage.view(&camera, method), &stage.twin(&camera, method));
            println!("{name}, {method}: {agreement:?}");
            assert!(agreement.is_good(), "{name}, {method}: {agreement:?}");
        }
    }
}

/// Rays along a floor cross all blocks: none slips through where blocks meet, and surfaces are as near to the floor as without blocks.
#[test]
fn a_floor_has_no_seams() {
    let floor = quad(Vec3::ZERO, 3.0, Vec3::Y, [90, 140, 60]);
    let corners = Corners { eye: Vec3::new(0.0, 5.0, 5.0), target: Vec3::ZERO, half_m: 0.5 };
    let stage = BlockStage::new(floor, &corners, 3, 3);
    for eye in [Vec3::new(0.4, 0.5, 2.9), Vec3::new(-2.0, 1.0, 5.0), Vec3::new(0.2, 6.0, 0.1)] {
        let camera = looking(eye, Vec3::new(0.1, 0.0, -0.4), 40.0, UVec2::new(160, 120));
        let truth = stage.own.drawn_directly(&camera);
        let floor: Vec<usize> = (0..camera.pixel_count()).filter(|&pixel| depths(&truth)[pixel] > 0.0).collect();
        for method in [CARVE, SEARCH] {
            let found = |view: &View| {
                let is_there = |pixel: &usize| kinds(view)[*pixel] == ProvenanceKind::Hit;
                let is_near = |pixel: &usize| (depths(view)[*pixel] / depths(&truth)[*pixel] - 1.0).abs() < 5e-3;
                let hits: Vec<usize> = floor.iter().copied().filter(is_there).collect();
                [hits.len(), hits.iter().filter(|pixel| is_near(pixel)).count()]
            };
            let [hits, near] = found(&stage.view(&camera, method));
            let [_, near_in_whole] = found(&stage.own.view(&camera, method));
            let of = floor.len();
            assert!(of > 5000 && hits * 1000 >= of * 998, "{eye}, {method}: {hits} of {of}");
            assert!(
                near >= near_in_whole - of / 1000,
                "{eye}, {method}: {near}, without blocks {near_in_whole} of {of}"
            );
        }
    }
}

/// A red wall in the nearer blocks, a blue one in the farther ones: each hides the other from its side.
#[test]
fn the_nearest_block_is_first_for_each_view() {
    let mut scene = quad(Vec3::new(0.0, 1.0, 1.0), 1.0, Vec3::Z, [200, 40, 40]);
    let other = quad(Vec3::new(0.0, 1.0, -1.0), 1.0, Vec3::NEG_Z, [40, 40, 200]);
    scene.instances.push(Instance { mesh: 1, ..other.instances[0] });
    scene.meshes.extend(other.meshes);
    let corners = Corners { eye: Vec3::new(0.0, 3.0, 6.0), target: Vec3::Y, half_m: 0.8 };
    let mut stage = BlockStage::new(scene.clone(), &corners, 1, 2);
    // Walls are seen from their own side.
    for (block, z) in stage.blocks.iter_mut().zip([-5.0, 5.0]) {
        let before = Corners { eye: Vec3::new(0.0, 1.0, z), target: Vec3::Y, half_m: 0.5 };
        block.images = Stage::new(scene.clone(), &before.samples(4)).images;
    }
    let from = |z: f32| looking(Vec3::new(0.1, 1.0, z), Vec3::Y, 30.0, VIEW_PX);
    let cameras = [from(5.0), from(-5.0), from(5.0), from(4.0)];
    let views = stage.views(&cameras, CARVE, ViewPlanes::ALL).expect("views");
    let middle = (VIEW_PX.y / 2 * VIEW_PX.x + VIEW_PX.x / 2) as usize;
    for (view, camera) in views.iter().zip(&cameras) {
        let color = &view.srgb8[3 * middle..3 * middle + 3];
        assert_eq!(color[0] > color[2], camera.eye_in_world.z > 0.0, "{color:?}");
        assert!(*view == stage.view(camera, CARVE), "views together are those of each");
    }
}

#[test]
fn several_samples_a_pixel_are_the_mean_of_positions() {
    let (stage, corners) = terrain();
    let camera = corners.view();
    let antialias = Antialias::of(4).expect("four samples");
    let planes = ViewPlanes { antialias, ..ViewPlanes::ALL };
    let smooth = stage.views(&[camera], CARVE, planes).expect("a view").remove(0);
    let truth = stage.own.drawn_directly(&camera);
    let far = |view: &View| {
        let off = view.srgb8.iter().zip(&truth.srgb8).map(|(a, b)| f64::from(a.abs_diff(*b)));
        off.sum::<f64>() / truth.srgb8.len() as f64
    };
    let rough = stage.view(&camera, CARVE);
    assert_eq!(depths(&smooth), depths(&rough), "depth is the centre's");
    assert!(smooth != rough && far(&smooth) < 2.0 * far(&rough), "{} and {}", far(&smooth), far(&rough));
}

#[test]
fn blocks_are_for_rays_in_images_alone() {
    let (stage, corners) = terrain();
    let camera = corners.view();
    let drawn = stage.views(&[camera], ReconstructionMethod::Mesh, ViewPlanes::ALL);
    assert!(matches!(drawn, Err(ReconstructionError::Blocks { .. })));
    let [own, block] = [&stage.own, &stage.blocks[0]].map(Stage::upload);
    let cells = [MirrorCell { bounds: stage.own.volume, surroundings: &own }];
    let mirrors = Mirrors { cells: &cells, reflections: 1, glossy_rays: 0 };
    for common in [
        CommonSets { mirrors, blocks: &[&block], ..CommonSets::default() },
        CommonSets { base: Some(&own), blocks: &[&block], ..CommonSets::default() },
    ] {
        let request = ReconstructRequest::new(&own, std::slice::from_ref(&camera), CARVE);
        let refused = reconstructor().reconstruct(ReconstructRequest { common, ..request });
        assert!(refused.is_err());
    }
    // A block without images of its own.
    let without: &[DepthImage] = &[];
    let empty = reconstructor().upload(without, &matt(stage.own.volume, stage.own.scene.background), Turn::default());
    assert!(empty.is_err());
}
