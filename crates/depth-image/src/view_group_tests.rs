//! Tests against closed forms.

use glam::Vec3;

use super::*;

const SIZE: UVec2 = UVec2::new(40, 30);
const SCENE: Aabb = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
/// Distance of all eyes below.
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
fn near_views_form_one_group() {
    let near: Vec<_> = (0..9).map(|i| towards_middle(0.02 * i as f32)).collect();
    let groups = grouped(&near);
    assert_eq!(groups.len(), 1);
    assert_eq!(groups[0].sample_cameras(SIZE).len(), 2, "the ends of an arc");
    assert_eq!(grouped(&[]), []);
}

#[test]
fn a_circle_splits_into_arcs_of_two_cameras() {
    let views = circle(360);
    let groups = grouped(&views);
    // Edges are measured along the axes: an arc across both is up to √2 longer. The minimum is 18; halving finds 24.
    assert_eq!(groups.len(), 24);
    for group in &groups {
        assert!(longest(&group.bounds, group.distance_m).1 <= 1.0);
        assert_eq!(group.sample_cameras(SIZE).len(), 2);
    }
    assert_eq!(groups.iter().map(|group| group.views.len()).sum::<usize>(), 360);
}

#[test]
fn the_nearest_set_of_a_view_is_that_of_its_group() {
    let groups = grouped(&circle(360));
    for (number, group) in groups.iter().enumerate() {
        for view in &group.views {
            assert!(group.serves(view, &SCENE));
            let nearest = nearest_set(view, cameras(&groups), &SCENE).unwrap();
            // Sample cameras stand a little inside their arc: a view at its end may be as near to the next set.
            assert!(nearest == number || groups[nearest].length_with(view, &SCENE) < 1.05, "{number} {nearest}");
        }
    }
    assert_eq!(nearest_set(&towards_middle(0.0), Vec::new(), &SCENE), None);
}

#[test]
fn opposite_views_are_in_different_groups() {
    let here = towards_middle(0.0);
    let back = PinholeCamera::looking_at(here.eye_in_world, here.eye_in_world * 2.0, Vec3::Y, 0.8, SIZE);
    let groups = grouped(&[here, back]);
    assert_eq!(groups.len(), 2);
    for (number, view) in [(0, here), (1, back)] {
        let set = nearest_set(&view, cameras(&groups), &SCENE).unwrap();
        assert!(cameras(&groups)[set][0].forward_in_world().dot(view.forward_in_world()) > 0.99, "{number}");
    }
}

#[test]
fn a_near_view_extends_its_group_and_leaves_others_unchanged() {
    let mut groups = grouped(&[towards_middle(0.0), towards_middle(2.0)]);
    let before = groups.clone();
    ViewGroup::add(&mut groups, &[towards_middle(0.1)], &SCENE);
    assert_eq!(groups.len(), 2);
    let far: Vec<_> = groups.iter().filter(|group| before.contains(group)).collect();
    assert_eq!(far.len(), 1, "one has grown");
    let grown = groups.clone();
    ViewGroup::add(&mut groups, &[towards_middle(0.05), towards_middle(2.0)], &SCENE);
    assert_eq!(groups, grown, "both views are inside existing groups");
    let mut wide = towards_middle(0.05);
    wide.focal_px *= 0.5;
    assert!(!groups.iter().any(|group| group.serves(&wide, &SCENE)), "its field of view is wider");
    ViewGroup::add(&mut groups, &[wide], &SCENE);
    assert!(groups.len() == 2 && groups.iter().any(|group| group.serves(&wide, &SCENE)));
    ViewGroup::add(&mut groups, &[towards_middle(1.0)], &SCENE);
    assert_eq!(groups.len(), 3);
}

#[test]
fn eyes_in_the_middle_of_the_scene_are_grouped_too() {
    let aims = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let views = aims.map(|aim| PinholeCamera::looking_at(Vec3::ZERO, aim, Vec3::Y, 1.0, SIZE));
    let groups = grouped(&views);
    assert_eq!(groups.len(), 6);
    for group in &groups {
        let [sample] = group.sample_cameras(SIZE)[..] else { panic!("one place") };
        sample.validate().unwrap();
    }
    let nowhere = Aabb { min: Vec3::ZERO, max: Vec3::ZERO };
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, &views, &nowhere);
    assert_eq!(groups.len(), 6);
}
