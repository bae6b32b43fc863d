//! The camera that goes through corridors, from an entrance on (Rosen et al., section 5, Figure 9).

use depth_image::PinholeCamera;
use glam::{DVec2, DVec3, UVec2};

use super::camera::{FrustumPlan, GraphPlan, RootPlan};
use super::plane::Plane;

/// Planes that differ by less are one.
const SAME_PLANE: f64 = 1e-9;
/// Regions end at their walls, long before this.
const FAR_M: f64 = 1e3;

/// The entrance of a room: a straight part of a corridor, or a junction.
#[derive(Debug, Clone)]
pub struct Portal {
    /// The portal before it; `None` for the first.
    pub parent: Option<usize>,
    /// Four corners: the upper left, the upper right, the lower right and the lower left one, seen from before the portal.
    pub face: [DVec3; 4],
    /// Before the portal.
    pub eye_in_world: DVec3,
    /// The walls of the room. Those that later portals lie in need not be among them.
    pub walls: Vec<Plane>,
}

/// A frustum for each room. The first portal is the whole image; it faces along a level axis, and its eye lies straight before it.
pub fn through(portals: &[Portal], size_px: UVec2) -> Option<GraphPlan> {
    let (first, rest) = portals.split_first()?;
    let frusta = (1..).zip(rest).map(|(number, portal)| FrustumPlan {
        parent: portal.parent.unwrap_or(0),
        eye_in_world: portal.eye_in_world,
        face: portal.face.to_vec(),
        walls: walls(portals, number),
        far_m: FAR_M,
    });
    let root = RootPlan { camera: first.camera(size_px), walls: walls(portals, 0), far_m: FAR_M };
    Some(GraphPlan { root, frusta: frusta.collect() })
}

/// A room's own walls, and the planes of the portals that leave it.
fn walls(portals: &[Portal], number: usize) -> Vec<Plane> {
    let mut walls = portals[number].walls.clone();
    for next in portals.iter().filter(|next| next.parent == Some(number)) {
        let plane = Plane::through(next.face[0], -next.towards());
        if !walls.iter().any(|wall| is_same(wall, &plane)) {
            walls.push(plane);
        }
    }
    walls
}

fn is_same(a: &Plane, b: &Plane) -> bool {
    a.inwards.distance(b.inwards) < SAME_PLANE && (a.least_m - b.least_m).abs() < SAME_PLANE
}

impl Portal {
    /// The normal of the face, away from the eye.
    fn towards(&self) -> DVec3 {
        let [a, b, _, d] = self.face;
        let normal = (b - a).cross(d - a).normalize_or_zero();
        if normal.dot(a - self.eye_in_world) < 0.0 { -normal } else { normal }
    }

    /// The pinhole whose image is the face.
    fn camera(&self, size_px: UVec2) -> PinholeCamera {
        let eye = self.eye_in_world;
        let towards = self.towards();
        let right = towards.cross(DVec3::Y);
        let [upper_left, _, lower_right, _] = self.face;
        let distance_m = towards.dot(upper_left - eye);
        let across = lower_right - upper_left;
        let size_m = DVec2::new(across.dot(right), -across.y);
        let focal_px = size_px.as_dvec2() * distance_m / size_m;
        let corner = upper_left - eye;
        let from_axis = DVec2::new(corner.dot(right), -corner.y);
        let target = (eye + towards).as_vec3();
        PinholeCamera {
            focal_px: focal_px.as_vec2(),
            principal_px: (-from_axis * focal_px / distance_m).as_vec2(),
            near_m: distance_m as f32,
            ..PinholeCamera::looking_at(eye.as_vec3(), target, glam::Vec3::Y, 1.0, size_px)
        }
    }
}

/// A straight corridor of even width.
#[derive(Debug, Clone, Copy)]
pub struct Corridor {
    /// Two points of its middle line on the floor; it ends at the second, and where it begins its portal says.
    pub axis: [DVec3; 2],
    pub half_width_m: f64,
    pub height_m: f64,
}

impl Corridor {
    /// The corridor behind a portal. Its eye lies on the corridor's axis at this distance before the nearest corner of the face.
    pub fn portal(&self, parent: Option<usize>, face: [DVec3; 4], eye_distance_m: f64) -> Portal {
        let eye_m = self.start_m(&face) - eye_distance_m;
        let heading = self.heading();
        let foot = self.axis[0] + heading * (eye_m - heading.dot(self.axis[0]));
        let up = DVec3::Y * self.height_m;
        let right = heading.cross(DVec3::Y);
        let aside = right * self.half_width_m;
        let walls = [
            Plane::through(self.axis[0] - aside, right),
            Plane::through(self.axis[0] + aside, -right),
            Plane::through(self.axis[0], DVec3::Y),
            Plane::through(self.axis[0] + up, DVec3::NEG_Y),
            Plane::through(self.axis[1], -heading),
        ];
        Portal { parent, face, eye_in_world: foot + up * 0.5, walls: walls.into() }
    }

    /// From the nearest corner of the face to the end.
    pub fn length_m(&self, face: &[DVec3; 4]) -> f64 {
        self.heading().dot(self.axis[1]) - self.start_m(face)
    }

    fn start_m(&self, face: &[DVec3; 4]) -> f64 {
        face.iter().map(|corner| self.heading().dot(*corner)).fold(f64::INFINITY, f64::min)
    }

    fn heading(&self) -> DVec3 {
        (self.axis[1] - self.axis[0]).normalize_or_zero()
    }
}

/// An upright rectangle on a line of the floor.
pub fn upright([left, right]: [DVec3; 2], height_m: f64) -> [DVec3; 4] {
    let up = DVec3::Y * height_m;
    [left + up, right + up, right, left]
}
