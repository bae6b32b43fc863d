//! Plans: their images, tiles, cells and relays.

use std::num::NonZeroU32;

use depth_image::{
    Aabb, Camera, CubeGrid, Environment, LightDirections, LightFieldCamera, PinholeCamera, SampleCamera,
    SinglePoleCamera,
};
use glam::{UVec2, Vec3};

use crate::test_support::{assignment, camera, workload};
use crate::{
    ApplyPlan, Assignment, CommonCell, CommonKind, CompositorShare, Policy, Refinement, SamplePlanes, SamplerShare,
    Timeline, Workload,
};

fn refusal(plan: &Assignment) -> String {
    plan.validate().expect_err("refused").to_string()
}

#[test]
fn relays_reach_every_compositor_at_every_fanout() {
    for fanout in [None, NonZeroU32::new(1), NonZeroU32::new(2), NonZeroU32::new(3)] {
        let compositor = |i: u32| CompositorShare { node_name: format!("c{i}"), ..assignment().compositors[0].clone() };
        let plan = Assignment { compositors: (0..10).map(compositor).collect(), relay_fanout: fanout, ..assignment() };
        assert_eq!(plan.validate(), Ok(()));
        let mut asked = std::collections::HashMap::new();
        for i in 0..10 {
            let mut steps = 0;
            let mut at = format!("c{i}");
            while let Some(relay) = plan.relay_of(&at) {
                (steps, at) = (steps + 1, relay.node_name.clone());
            }
            assert!(steps < 10, "the way ends at the samplers");
            if let Some(relay) = plan.relay_of(&format!("c{i}")) {
                assert!(plan.relays(&relay.node_name));
                *asked.entry(relay.node_name.clone()).or_insert(0) += 1;
            }
        }
        assert!(asked.values().all(|&count| count <= fanout.map_or(0, NonZeroU32::get)));
        assert_eq!(asked.values().sum::<u32>(), 10 - fanout.map_or(10, NonZeroU32::get));
    }
}

#[test]
fn a_static_scene_is_refined_set_by_set_and_a_moving_one_is_finished_at_once() {
    let steps = |refinement_steps, step_s| {
        let timeline = Timeline { start_s: 0.0, step_s, set_count: 8 };
        let workload = Workload { refinement_steps, timeline, ..workload() };
        (0..8).map(|set_index| workload.refinement(set_index)).collect::<Vec<_>>()
    };
    let of_4 = |step| Refinement { step, steps: 4 };
    assert_eq!(steps(4, 0.0), [0, 1, 2, 3, 3, 3, 3, 3].map(of_4));
    assert_eq!(steps(4, 0.1), [of_4(3); 8]);
    assert_eq!(steps(1, 0.0), [Refinement::default(); 8]);
}

#[test]
fn set_content_differs_where_and_only_where_a_set_shows_something_else() {
    let id = |change: &dyn Fn(&mut Assignment)| {
        let mut assignment = assignment();
        change(&mut assignment);
        assignment.set_content(1).unwrap()
    };
    let same = id(&|_| ());
    assert_eq!(id(&|a| a.plan_epoch = 9), same, "the plan is not what a set shows");
    assert_ne!(id(&|a| a.workload.timeline.step_s = 0.6), same);
    assert_ne!(id(&|a| a.workload.lighting = "unlit".to_owned()), same);
    assert_ne!(id(&|a| a.workload.sample_cameras.truncate(1)), same);
    assert_ne!(id(&|a| a.workload.refinement_steps = 2), same);
    assert_ne!(id(&|a| a.workload.planes.light = true), same);
    assert_ne!(id(&|a| a.workload.illumination.lights.truncate(3)), same);
    assert_ne!(id(&|a| a.workload.illumination.environment = Environment::default()), same);
    assert_eq!((assignment().set_content(3), assignment().sample_set_id(3)), (None, None));
    let still = |index| {
        Assignment {
            workload: Workload { timeline: Timeline { step_s: 0.0, ..workload().timeline }, ..workload() },
            ..assignment()
        }
        .set_content(index)
    };
    assert_eq!(still(0), still(2), "a static scene has one set");
    let timeline = Timeline { step_s: 0.0, set_count: 8, ..workload().timeline };
    let refined = Assignment { workload: Workload { timeline, refinement_steps: 4, ..workload() }, ..assignment() };
    let contents: Vec<_> = (0..8).map(|set_index| refined.set_content(set_index).unwrap()).collect();
    assert!((0..3).all(|i| !contents[i + 1..].contains(&contents[i])), "each step is another");
    assert!(contents[3..].iter().all(|content| *content == contents[3]), "the last stays");
}

#[test]
fn images_with_light_serve_only_methods_that_need_light() {
    let color = SamplePlanes { normals: true, ..SamplePlanes::default() };
    let light = SamplePlanes { light: true, ..color };
    assert!(color.contain(SamplePlanes::default()) && color.contain(color) && light.contain(light));
    assert!(light.contain(SamplePlanes { normals: false, ..light }));
    assert!(!light.contain(color) && !light.contain(SamplePlanes::default()) && !color.contain(light));
}

#[test]
fn a_view_belongs_to_the_nearest_cell_and_content_is_of_one_cell() {
    let plan = of_cells();
    let view = |x: f32| PinholeCamera { eye_in_world: Vec3::new(x, 0.0, 9.0), ..camera() };
    assert_eq!([-3.0, 4.0, 6.0, 10.5, 17.0, 40.0].map(|x| plan.cell_of(&view(x))), [0, 0, 1, 1, 1, 2]);
    assert_eq!(Assignment { policy: Policy::Direct, ..plan.clone() }.cell_of(&view(40.0)), 0);
    let content = |plan: &Assignment, cell: u32| plan.of_cell(cell).unwrap().set_content(0);
    let mut fewer = plan.clone();
    fewer.workload.sample_cameras.pop();
    fewer.workload.cell_first_indices.pop();
    fewer.plan_epoch += 1;
    assert_eq!([0, 1].map(|cell| content(&fewer, cell)), [0, 1].map(|cell| content(&plan, cell)));
    assert_ne!(content(&plan, 0), content(&plan, 1));
}

/// A plan of two samplers for three cells of 1, 2 and 1 cameras, with two tiles an image.
fn of_cells() -> Assignment {
    let looking = |x: f32| {
        let eye = Vec3::new(x, 0.0, 9.0);
        PinholeCamera { eye_in_world: eye, ..camera() }.into()
    };
    let workload = Workload {
        sample_cameras: [0.0, 10.0, 11.0, 30.0].map(looking).to_vec(),
        cell_first_indices: vec![0, 1, 3],
        ..workload()
    };
    let share = |name: &str, image_indices: Vec<u32>| SamplerShare {
        node_name: name.to_owned(),
        address: "http://127.0.0.1:1".to_owned(),
        image_indices,
    };
    let samplers = vec![share("a", vec![0, 1, 2]), share("c", vec![3, 4, 5, 6, 7])];
    Assignment { workload, samplers, tile_count: 2, ..assignment() }
}

#[test]
fn samplers_treat_tiles_as_images() {
    let mut cut = Assignment { tile_count: 2, ..assignment() };
    cut.samplers[0].image_indices = vec![0, 3];
    let other = SamplerShare { node_name: "c".to_owned(), image_indices: vec![1, 2], ..cut.samplers[0].clone() };
    cut.samplers.push(other);
    assert_eq!(cut.validate(), Ok(()));
    let heights: Vec<u32> = cut.sampled_cameras().iter().map(|camera| camera.size_px().y).collect();
    assert_eq!((heights.len(), heights[0] + heights[1]), (4, camera().size_px.y));
    assert_eq!(cut.sets_at_once(), 1);
    assert_eq!(cut.set_content(0), assignment().set_content(0), "a set shows the same however it is cut");
    let lost = Assignment { tile_count: 4, ..cut.clone() };
    assert!(refusal(&lost).contains("image_indices"));
    assert!(refusal(&Assignment { tile_count: 17, ..cut }).contains("tile_count is 17"));
}

#[test]
fn the_plan_of_a_cell_has_the_images_of_that_cell_alone() {
    let plan = of_cells();
    assert_eq!(plan.validate(), Ok(()));
    let of = |cell: u32| {
        let of_cell = plan.of_cell(cell).unwrap();
        let shares: Vec<_> = of_cell.samplers.iter().map(|s| (s.node_name.clone(), s.image_indices.clone())).collect();
        assert_eq!(of_cell.validate(), Ok(()));
        (of_cell.workload.sample_cameras.len(), shares)
    };
    let share = |name: &str, images: &[u32]| (name.to_owned(), images.to_vec());
    assert_eq!(of(0), (1, vec![share("a", &[0, 1])]));
    assert_eq!(of(1), (2, vec![share("a", &[0]), share("c", &[1, 2, 3])]));
    assert_eq!(of(2), (1, vec![share("c", &[0, 1])]));
    assert_eq!(plan.of_cell(3), None);
    let one = assignment();
    assert_eq!((one.of_cell(0), one.of_cell(1)), (Some(one.clone()), None));
}

#[test]
fn a_plan_tells_which_workloads_have_ended() {
    let told = ApplyPlan { assignment: assignment(), open_workloads: vec![1, 3] };
    assert_eq!((told.assignment.plan_epoch, told.assignment.workload_number), (4, 3));
    let ended: Vec<u64> = (1..7).filter(|&number| told.has_ended(number)).collect();
    assert_eq!(ended, [2, 4], "later ones may have begun since");
    let own = ApplyPlan { open_workloads: vec![1], ..told };
    assert!(own.has_ended(2) && !own.has_ended(3), "it has a plan");
    assert!(!ApplyPlan { assignment: assignment(), open_workloads: vec![] }.has_ended(2), "nothing is known");
}

#[test]
fn a_plan_that_samples_an_image_twice_or_never_is_refused() {
    let spoilt = |indices: &[u32]| {
        let mut plan = assignment();
        plan.samplers[0].image_indices = indices.to_vec();
        refusal(&plan)
    };
    for indices in [&[0][..], &[0, 0], &[0, 1, 1], &[0, 2], &[u32::MAX]] {
        assert!(spoilt(indices).contains("image_indices"), "{indices:?}");
    }
    let plan = Assignment { compositors: Vec::new(), ..assignment() };
    assert!(refusal(&plan).contains("compositors"));
}

#[test]
fn cells_that_are_empty_or_out_of_order_are_refused() {
    let spoilt = |firsts: Vec<u32>| {
        let mut plan = of_cells();
        plan.workload.cell_first_indices = firsts;
        refusal(&plan)
    };
    for firsts in [vec![1, 2], vec![0, 0, 3], vec![0, 3, 1], vec![0, 4], vec![0, u32::MAX]] {
        let text = spoilt(firsts);
        assert!(text.contains("cell_first_indices is ") && text.contains("of 4 sample_cameras"), "{text}");
    }
    assert!(spoilt(vec![0; 65]).contains("cell_first_indices has 65"));
}

/// A box around the mirrors of a mirror cell.
fn mirror(x: f32) -> CommonCell {
    let bounds = Aabb { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 1.0, 1.0, 0.0) };
    CommonCell { kind: CommonKind::Mirrors, bounds, sampling: "all".to_owned() }
}

/// As [`of_cells`], with two mirror cells of two cameras and of one.
fn with_mirrors() -> Assignment {
    let mirrors = vec![
        (mirror(0.0), vec![camera().into(); 2]),
        (mirror(5.0), vec![PinholeCamera { eye_in_world: Vec3::Z * 7.0, ..camera() }.into()]),
    ];
    let mut plan = of_cells();
    plan.workload = plan.workload.with_common_cells(mirrors);
    plan.samplers[1].image_indices.extend(8..14);
    plan
}

#[test]
fn mirror_cells_come_last_and_are_no_views() {
    let plan = with_mirrors();
    let view_cells = of_cells();
    assert_eq!(plan.validate(), Ok(()));
    assert_eq!((plan.workload.cell_count(), plan.workload.view_cell_count()), (5, 3));
    assert_eq!(plan.workload.cell_first_indices, [0, 1, 3, 4, 6]);
    let near_mirror = PinholeCamera { eye_in_world: Vec3::Z * 7.0, ..camera() };
    assert_eq!(plan.cell_of(&near_mirror), view_cells.cell_of(&near_mirror));
    assert_eq!((plan.workload.common_cell(2), plan.workload.common_cell(4)), (None, Some(&mirror(5.0))));
    let of_mirror = plan.of_cell(3).unwrap();
    assert_eq!((of_mirror.workload.sampling.as_str(), of_mirror.workload.common_cells.len()), ("all", 0));
    assert_eq!(of_mirror.samplers[0].image_indices, [0, 1, 2, 3], "its own, tile by tile");
    for cell in 0..3 {
        let content = |plan: &Assignment| plan.of_cell(cell).unwrap().set_content(0);
        assert_eq!(content(&plan), content(&view_cells), "views' images do not depend on mirrors");
    }
    assert_eq!(plan.workload.clone().without_common_cells(), view_cells.workload);
    assert_eq!(view_cells.workload.clone().without_common_cells(), view_cells.workload);
    assert_eq!(workload().with_common_cells(Vec::new()), workload());
}

#[test]
fn mirror_cells_stay_when_view_cells_change() {
    let plan = with_mirrors();
    let moved = plan.workload.clone().with_view_cells(vec![vec![camera().into()]]);
    assert_eq!((moved.cell_first_indices.clone(), moved.sample_cameras.len()), (vec![0, 1, 3], 4));
    assert_eq!(moved.validate(), Ok(()));
    let content = |workload: &Workload, cell: usize| {
        Assignment { workload: workload.of_cell(cell).unwrap(), ..assignment() }.set_content(0)
    };
    assert_eq!([content(&moved, 1), content(&moved, 2)], [content(&plan.workload, 3), content(&plan.workload, 4)]);
    let one = plan.workload.of_one_view();
    assert_eq!((one.cell_first_indices.clone(), one.common_cells.len()), (vec![0, 1, 3], 2));
    assert_eq!(of_cells().workload.of_one_view(), of_cells().workload.of_cell(0).unwrap());
}

#[test]
fn a_cube_is_one_cell_of_its_three_cameras_for_views_from_anywhere() {
    let cube = |timeline, change: &dyn Fn(&mut Vec<SampleCamera>)| {
        let grid = CubeGrid::around(&workload().volume, 64).unwrap();
        let mut sample_cameras = [0, 1, 2].map(|axis| grid.camera(axis).into()).to_vec();
        change(&mut sample_cameras);
        Workload { sample_cameras, timeline, ..workload() }
    };
    let still = Timeline::still(0.0);
    let good = cube(still, &|_| ());
    assert_eq!(good.validate(), Ok(()));
    assert!(good.samples_cube() && !workload().samples_cube());
    let views =
        [Vec3::X * 90.0, Vec3::splat(0.1), -Vec3::Z].map(|eye_in_world| PinholeCamera { eye_in_world, ..camera() });
    assert!(views.iter().all(|view| good.cell_of(view) == 0 && good.has_cell_near(view)));
    let refused = |workload: Workload| workload.validate().expect_err("refused").to_string();
    assert!(refused(cube(still, &|cameras| cameras.swap(0, 1))).contains("three cameras of one layered cube"));
    assert!(
        refused(cube(still, &|cameras| cameras[2] = camera().into())).contains("2 parallel and 0 light_field of 3")
    );
    assert!(refused(cube(still, &|cameras| cameras.truncate(2))).contains("2 parallel and 0 light_field of 2"));
    let grid = CubeGrid::around(&good.volume, 64).unwrap();
    let flat = CubeGrid { size: grid.size.with_y(15), ..grid };
    let flat = cube(still, &|cameras| *cameras = [0, 1, 2].map(|axis| flat.camera(axis).into()).to_vec());
    assert!(refused(flat).contains("16 rows and more"));
    let cells = Workload { cell_first_indices: vec![0, 1], ..good };
    assert!(refused(cells).contains("cells of a layered cube is 2, must be 1"));
    let moving = Timeline { start_s: 0.0, step_s: 0.1, set_count: 5 };
    assert!(refused(cube(moving, &|_| ())).contains("still for a layered cube"));
}

#[test]
fn one_light_field_may_follow_the_cameras_of_a_cube() {
    let still = Workload { timeline: Timeline::still(0.0), ..workload() };
    let cube = CubeGrid::around(&still.volume, 64).unwrap().cameras().map(SampleCamera::from);
    let around = LightFieldCamera::around(still.volume, LightDirections::D66, 16);
    let field = [SampleCamera::from(around)];
    let of = |cameras: &[&[SampleCamera]]| Workload { sample_cameras: cameras.concat(), ..still.clone() };
    let good = of(&[&cube, &field]);
    assert_eq!(good.validate(), Ok(()));
    assert!(good.samples_cube() && good.has_cell_near(&camera()));
    let content = |workload: Workload| Assignment { workload, ..assignment() }.set_content(0);
    assert_ne!(content(good.clone()), content(of(&[&cube])));
    let refused = |workload: Workload| workload.validate().expect_err("refused").to_string();
    for (cameras, given) in [
        (of(&[&cube, &field, &field]), "3 parallel and 2 light_field of 5"),
        (of(&[&field, &cube]), "0 parallel and 1 light_field of 4"),
        (of(&[&cube[..2], &field, &cube[2..]]), "2 parallel and 1 light_field of 4"),
        (of(&[&field]), "0 parallel and 1 light_field of 1"),
        (of(&[&[camera().into()], &field]), "0 parallel and 0 light_field of 2"),
    ] {
        let text = refused(cameras);
        assert!(text.contains("sample_cameras.model") && text.contains(given), "{text}");
    }
    let cell = CommonCell { kind: CommonKind::Base, ..mirror(0.0) };
    let base = still.clone().with_common_cells(vec![(cell, good.sample_cameras.clone())]);
    let text = refused(base);
    assert!(text.contains("sample_cameras.model") && text.contains("3 parallel and 1 light_field of 4"), "{text}");
    let dense = SampleCamera::from(LightFieldCamera { side_px: 91, ..around });
    assert!(refused(of(&[&cube, &[dense]])).contains("side_px"));
    let part = SampleCamera::from(LightFieldCamera { first_pair: 1, pairs: 32, ..around });
    assert!(refused(of(&[&cube, &[part]])).contains("sample_cameras.pairs is 32 of 33"));
}

#[test]
fn blocks_are_alone_and_have_their_own_volume() {
    let block = |x_m: f32| CommonCell { kind: CommonKind::Block, ..mirror(x_m) };
    let of = |cells: Vec<CommonCell>| {
        let common = cells.into_iter().map(|cell| (cell, vec![camera().into(); 4])).collect();
        workload().with_common_cells(common)
    };
    let good = of(vec![block(0.0), block(1.0)]);
    assert_eq!(good.validate(), Ok(()));
    let first = good.view_cell_count();
    assert_eq!(good.of_cell(first + 1).unwrap().volume, block(1.0).bounds);
    assert_eq!(good.of_cell(0).unwrap().volume, workload().volume);
    let refused = |workload: Workload| workload.validate().expect_err("refused").to_string();
    assert!(refused(of(vec![block(0.0), mirror(1.0)])).contains("1 beside 1 of blocks"));
    assert!(refused(of(vec![block(0.0); 65])).contains("at most 64"));
}

#[test]
fn a_base_is_one_cube_beside_the_cells_of_a_still_scene() {
    let grid = CubeGrid::around(&workload().volume, 64).unwrap();
    let cell = CommonCell { kind: CommonKind::Base, ..mirror(0.0) };
    let base = (cell.clone(), grid.cameras().map(SampleCamera::from).to_vec());
    let still = Workload { timeline: Timeline::still(0.0), ..with_mirrors().workload };
    let good = still.clone().with_common_cells(vec![base.clone()]);
    assert_eq!(good.validate(), Ok(()));
    assert!(!good.samples_cube() && good.common_cell(5) == Some(&cell));
    assert!(good.of_cell(5).unwrap().samples_cube());
    let refused = |workload: Workload| workload.validate().expect_err("refused").to_string();
    let with = |common| refused(still.clone().with_common_cells(common));
    assert!(with(vec![base.clone(), base.clone()]).contains("common_cells of a base has 2, at most 1"));
    let pinholes = vec![camera().into(); 3];
    assert!(with(vec![(cell, pinholes)]).contains("three cameras of one layered cube"));
    assert!(with(vec![(mirror(0.0), base.1.clone())]).contains("the model of the mirror cell's first camera"));
    assert!(refused(with_mirrors().workload.with_common_cells(vec![base])).contains("still for a layered cube"));
}

#[test]
fn only_mirror_cells_have_single_poles_and_each_has_one_model() {
    let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let bent = Camera::SinglePole(SinglePoleCamera::around(&bounds, Vec3::Z * 5.0, 20.0, UVec2::splat(64)));
    let with = |places: &[usize]| {
        let mut plan = with_mirrors();
        places.iter().for_each(|&place| plan.workload.sample_cameras[place] = bent.into());
        plan.validate().err().map(|error| error.to_string())
    };
    // Cameras 0 to 3 are those of view cells, 4 and 5 of one mirror, 6 of another.
    assert_eq!(with(&[4, 5]), None);
    assert_eq!(with(&[6]), None);
    // Planes of quads are those of view cells: no ray off a mirror reads them.
    let mut plan = with_mirrors();
    plan.workload.planes = SamplePlanes { normals: true, corner_inverse_depths: true, light: true };
    let planes = |cell: usize| plan.workload.of_cell(cell).map(|workload| workload.planes);
    assert_eq!([planes(0), planes(3)], [Some(plan.workload.planes), Some(SamplePlanes::default())]);
    for mixed in [4, 5] {
        assert!(with(&[mixed]).is_some_and(|text| text.contains("sample_cameras.model")), "{mixed}");
    }
    for of_view in 0..4 {
        let text = with(&[of_view]).unwrap_or_default();
        assert!(text.contains("sample_cameras.model is single_pole, must be pinhole"), "{of_view}: {text}");
    }
}

#[test]
fn mirror_cells_that_no_peer_may_send_are_refused() {
    let spoilt = |spoil: &dyn Fn(&mut Workload)| {
        let mut plan = with_mirrors();
        spoil(&mut plan.workload);
        refusal(&plan)
    };
    let many = |w: &mut Workload| w.common_cells = vec![mirror(0.0); 9];
    assert!(spoilt(&many).contains("common_cells of mirrors has 9, at most 8"));
    let no_views = |w: &mut Workload| w.common_cells = vec![mirror(0.0); 5];
    assert!(spoilt(&no_views).contains("common_cells is 5, must be fewer than cells"));
    for bounds in [Aabb::EMPTY, Aabb { min: Vec3::ZERO, max: Vec3::INFINITY }, Aabb { min: Vec3::NAN, max: Vec3::ONE }]
    {
        assert!(spoilt(&|w| w.common_cells[0].bounds = bounds).contains("common_cells.bounds"), "{bounds:?}");
    }
    assert!(spoilt(&|w| w.common_cells[1].sampling.clear()).contains("common_cells.sampling_method is missing"));
}
