//! Groups of views that share one sample set, and the set nearest to a view.
//!
//! The distance of two views follows from the change of the picture. It combines the parallax of the scene's middle with
//! the angle between the directions. Both are coordinates of one space, in which a group extends at most 1 along any axis.

use glam::UVec2;

use crate::{Aabb, PinholeCamera, ViewCell};

/// Longest edge of a group's eyes, as a share of their distance from the scene's middle.
const LONGEST_EDGE: f32 = 0.25;
/// Greatest difference of directions along an axis of the unit sphere.
const WIDEST_DIRECTION: f32 = 0.5;
/// Eyes closer than this share of the distance count as one place.
const SHORTEST_EDGE: f32 = 0.02;
/// Lower bound of distances, as a share of the scene's radius: inside the scene its middle may be nearer than its
/// surfaces.
const NEAREST: f32 = 0.5;
/// A view this little outside of a group, as a share of the longest group, counts as inside.
const TOLERANCE: f32 = 0.01;
/// Weight of the distance to a set's middle, which decides between sets at equal distance.
const OF_MIDDLE: f32 = 1e-3;

/// Eye and direction of a view.
type Place = [f32; 6];

/// Least and greatest of each coordinate.
type Bounds = [(f32, f32); 6];

/// Views that one sample set serves. A group only grows; its samples stay valid while it does not.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewGroup {
    /// One or more.
    views: Vec<PinholeCamera>,
    bounds: Bounds,
    /// Distance of the nearest view, whose picture changes most with a step.
    distance_m: f32,
    cell: ViewCell,
}

impl ViewGroup {
    /// Adds views to groups. A view inside a group changes nothing. Any other joins the group that it extends least, if that
    /// stays within the limit. The remaining views form new groups by halving.
    pub fn add(groups: &mut Vec<Self>, views: &[PinholeCamera], scene: &Aabb) {
        let mut apart = Vec::new();
        for view in views {
            if groups.iter().any(|group| group.serves(view, scene)) {
                continue;
            }
            let lengths = groups.iter_mut().map(|group| (group.length_with(view, scene), group));
            match lengths.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((length, group)) if length <= 1.0 => group.push(*view, scene),
                _ => apart.push(*view),
            }
        }
        groups.extend(halved(apart, scene));
    }

    /// Returns whether a view lies between the group's views, within their field of view.
    #[must_use]
    pub fn serves(&self, view: &PinholeCamera, scene: &Aabb) -> bool {
        outside(view, &self.bounds, scene) <= TOLERANCE && self.cell.sees_all_of(view)
    }

    /// The group's sample cameras, for images of this size.
    #[must_use]
    pub fn sample_cameras(&self, size_px: UVec2) -> Vec<PinholeCamera> {
        self.cell.sample_cameras(SHORTEST_EDGE * self.distance_m, size_px)
    }

    /// The box of viewpoints to which the group may grow about its middle.
    #[must_use]
    pub fn grown_cell(&self) -> ViewCell {
        self.cell.grown_to(LONGEST_EDGE * self.distance_m)
    }

    fn of(views: Vec<PinholeCamera>, scene: &Aabb) -> Option<Self> {
        let bounds = bounds(&views);
        let distance_m = least_distance_m(&views, scene);
        Some(Self { cell: ViewCell::between(&views)?, views, bounds, distance_m })
    }

    fn push(&mut self, view: PinholeCamera, scene: &Aabb) {
        self.views.push(view);
        if let Some(grown) = Self::of(std::mem::take(&mut self.views), scene) {
            *self = grown;
        }
    }

    fn length_with(&self, view: &PinholeCamera, scene: &Aabb) -> f32 {
        longest(&extended(self.bounds, place_of(view)), self.distance_m.min(distance_m(view, scene))).1
    }
}

/// Index of the sample set nearest to a view; each set is given by its cameras. `None` without sets.
#[must_use]
pub fn nearest_set(
    view: &PinholeCamera,
    sets: impl IntoIterator<Item = Vec<PinholeCamera>>,
    scene: &Aabb,
) -> Option<usize> {
    let distances = sets.into_iter().map(|cameras| {
        let bounds = bounds(&cameras);
        let middle = bounds.map(|(least, most)| ((least + most) * 0.5, (least + most) * 0.5));
        outside(view, &bounds, scene) + OF_MIDDLE * outside(view, &middle, scene)
    });
    distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(set, _)| set)
}

/// Halves views that spread too far along their longest axis, until each group is within the limit.
fn halved(views: Vec<PinholeCamera>, scene: &Aabb) -> Vec<ViewGroup> {
    if views.is_empty() {
        return Vec::new();
    }
    let bounds = bounds(&views);
    let (axis, length) = longest(&bounds, least_distance_m(&views, scene));
    let (least, most) = bounds[axis];
    let (low, high): (Vec<_>, Vec<_>) = views.iter().partition(|view| place_of(view)[axis] < (least + most) * 0.5);
    if length <= 1.0 || low.is_empty() || high.is_empty() {
        return ViewGroup::of(views, scene).into_iter().collect();
    }
    [halved(low, scene), halved(high, scene)].concat()
}

/// The axis of the greatest spread, and the spread.
fn longest(bounds: &Bounds, distance_m: f32) -> (usize, f32) {
    let lengths = bounds.iter().enumerate();
    let lengths = lengths.map(|(axis, (least, most))| (axis, (most - least) / unit(axis, distance_m)));
    lengths.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
}

/// Distance of a view from bounds, 0 inside.
fn outside(view: &PinholeCamera, bounds: &Bounds, scene: &Aabb) -> f32 {
    let place = place_of(view);
    let distance_m = distance_m(view, scene);
    let squares = bounds.iter().zip(place).enumerate().map(|(axis, (&(least, most), at))| {
        let off = (at - at.max(least).min(most)) / unit(axis, distance_m);
        off.powi(2)
    });
    squares.sum::<f32>().sqrt()
}

fn place_of(view: &PinholeCamera) -> Place {
    let eye = view.eye_in_world;
    let forward = view.forward_in_world();
    [eye.x, eye.y, eye.z, forward.x, forward.y, forward.z]
}

fn bounds(views: &[PinholeCamera]) -> Bounds {
    views.iter().map(place_of).fold([(f32::INFINITY, f32::NEG_INFINITY); 6], extended)
}

fn extended(bounds: Bounds, place: Place) -> Bounds {
    std::array::from_fn(|axis| (bounds[axis].0.min(place[axis]), bounds[axis].1.max(place[axis])))
}

/// Divisor of a coordinate.
fn unit(axis: usize, distance_m: f32) -> f32 {
    if axis < 3 { LONGEST_EDGE * distance_m } else { WIDEST_DIRECTION }
}

fn distance_m(view: &PinholeCamera, scene: &Aabb) -> f32 {
    let radius_m = scene.size().length() * 0.5;
    (view.eye_in_world - scene.center()).length().max(radius_m * NEAREST).max(f32::MIN_POSITIVE)
}

fn least_distance_m(views: &[PinholeCamera], scene: &Aabb) -> f32 {
    views.iter().map(|view| distance_m(view, scene)).fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
#[path = "view_group_tests.rs"]
mod tests;
