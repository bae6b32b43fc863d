//! Closed forms.

use glam::Vec3;

use super::*;

const SIZE: UVec2 = UVec2::new(40, 30);
const SCENE: Aabb = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
/// Of all eyes below.
const DISTANCE_M: f32 = 4.0;

fn towards_middle(azimuth_rad: f32) -> PinholeCamera {
    let eye = Vec3::new(azimuth_rad.sin(), 0.0, azimuth_rad.cos()) * DISTANCE_M;
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, SIZE)
}

fn circle(count: usize) -> Vec<PinholeCamera> {
    (0..count).map(|i| towards_middle(std::f32::consts::TAU * i as f32 / count as f32)).collect()
}

fn grouped(views: &[PinholeCamera]) -> Vec<ViewGroup> {
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, views, &SCENE);
    groups
}

fn cameras(groups: &[ViewGroup]) -> Vec<Vec<PinholeCamera>> {
    groups.iter().map(|group| group.sample_cameras(SIZE)).collect()
}

#[test]
fn what_is_near_is_one_group() {
    let near: Vec<_> = (0..9).map(|i| towards_middle(0.02 * i as f32)).collect();
    let groups = grouped(&near);
    assert_eq!(groups.len(), 1);
    assert_eq!(groups[0].sample_cameras(SIZE).len(), 2, "the ends of an arc");
    assert_eq!(grouped(&[]), []);
}

#[test]
fn a_circle_is_short_arcs_of_two_ends() {
    let views = circle(360);
    let groups = grouped(&views);
    // Edges are measured along the axes: an arc that runs across both is up to √2 longer. 18 at the least; halving finds 24.
    assert_eq!(groups.len(), 24);
    for group in &groups {
        assert!(longest(&group.bounds, group.distance_m).1 <= 1.0);
        assert_eq!(group.sample_cameras(SIZE).len(), 2);
    }
    assert_eq!(groups.iter().map(|group| group.views.len()).sum::<usize>(), 360);
}

#[test]
fn a_view_goes_to_the_set_that_was_made_for_it() {
    let groups = grouped(&circle(360));
    for (number, group) in groups.iter().enumerate() {
        for view in &group.views {
            assert!(group.serves(view, &SCENE));
            let nearest = nearest_set(view, cameras(&groups), &SCENE).unwrap();
            // Arcs of ends stand a little inside: at its end a view may be as near to the next.
            assert!(nearest == number || groups[nearest].length_with(view, &SCENE) < 1.05, "{number} {nearest}");
        }
    }
    assert_eq!(nearest_set(&towards_middle(0.0), Vec::new(), &SCENE), None);
}

#[test]
fn who_looks_the_other_way_is_in_another_group() {
    let here = towards_middle(0.0);
    let back = PinholeCamera::looking_at(here.eye_in_world, here.eye_in_world * 2.0, Vec3::Y, 0.8, SIZE);
    let groups = grouped(&[here, back]);
    assert_eq!(groups.len(), 2);
    for (number, view) in [(0, here), (1, back)] {
        let set = nearest_set(&view, cameras(&groups), &SCENE).unwrap();
        assert!(cameras(&groups)[set][0].forward_in_world().dot(view.forward_in_world()) > 0.99, "{number}");
    }
}

/// Clients that come one after the other share sets; nothing changes for those that are far away.
#[test]
fn groups_grow_and_others_stay() {
    let mut groups = grouped(&[towards_middle(0.0), towards_middle(2.0)]);
    let before = groups.clone();
    ViewGroup::add(&mut groups, &[towards_middle(0.1)], &SCENE);
    assert_eq!(groups.len(), 2);
    let far: Vec<_> = groups.iter().filter(|group| before.contains(group)).collect();
    assert_eq!(far.len(), 1, "one has grown");
    let grown = groups.clone();
    ViewGroup::add(&mut groups, &[towards_middle(0.05), towards_middle(2.0)], &SCENE);
    assert_eq!(groups, grown, "they are in what there is");
    let mut wide = towards_middle(0.05);
    wide.focal_px *= 0.5;
    assert!(!groups.iter().any(|group| group.serves(&wide, &SCENE)), "sees more");
    ViewGroup::add(&mut groups, &[wide], &SCENE);
    assert!(groups.len() == 2 && groups.iter().any(|group| group.serves(&wide, &SCENE)));
    ViewGroup::add(&mut groups, &[towards_middle(1.0)], &SCENE);
    assert_eq!(groups.len(), 3);
}

#[test]
fn eyes_in_the_middle_of_the_scene_are_grouped_too() {
    let aims = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let look = aims.map(|aim| PinholeCamera::looking_at(Vec3::ZERO, aim, Vec3::Y, 1.0, SIZE));
    let groups = grouped(&look);
    assert_eq!(groups.len(), 6);
    for group in &groups {
        let [sample] = group.sample_cameras(SIZE)[..] else { panic!("one place") };
        sample.validate().unwrap();
    }
    let nowhere = Aabb { min: Vec3::ZERO, max: Vec3::ZERO };
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, &look, &nowhere);
    assert_eq!(groups.len(), 6);
}
