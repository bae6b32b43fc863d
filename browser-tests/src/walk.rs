//! Closed forms of the page's camera, from rotations instead of the page's sines and cosines.

use std::f64::consts::PI;

use browser::input::Place;
use glam::{DQuat, DVec3};
use serde::Deserialize;

/// The steepest pitch.
const STEEPEST_RAD: f64 = 1.55;
/// The part of the distance that is left after a pixel of the wheel, as a logarithm.
const WHEEL_PER_PIXEL: f64 = 0.0015;

/// A camera's state, as the page keeps it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct State {
    /// The pivot.
    pub target: [f64; 3],
    /// The turn around +Y, in radians; 0 looks along -Z.
    pub yaw: f64,
    /// The angle from above, in radians.
    pub pitch: f64,
    /// From the eye to the pivot.
    pub distance: f64,
    /// The full vertical field of view, in degrees.
    pub fov_y: f64,
    /// The diagonal of the scene.
    pub size: f64,
    /// Whether the camera turns around itself.
    pub is_flying: bool,
}

impl State {
    fn world_from_camera(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(-self.pitch)
    }

    /// The pivot.
    #[must_use]
    pub fn pivot(&self) -> DVec3 {
        DVec3::from_array(self.target)
    }

    /// The place of the eye.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.pivot() + self.world_from_camera() * DVec3::Z * self.distance
    }

    /// The direction of the view.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        self.world_from_camera() * DVec3::NEG_Z
    }

    /// Turned around the pivot, or around the eye while flying.
    #[must_use]
    pub fn turned(self, by_yaw: f64, by_pitch: f64) -> Self {
        let pitch = (self.pitch + by_pitch).clamp(-STEEPEST_RAD, STEEPEST_RAD);
        let turned = Self { yaw: self.yaw + by_yaw, pitch, ..self };
        if !self.is_flying {
            return turned;
        }
        Self { target: (self.eye() + turned.forward() * self.distance).to_array(), ..turned }
    }

    /// After a drag of the main button, or of one finger: half a turn for the canvas's height.
    #[must_use]
    pub fn dragged(self, from: Place, to: Place, height_px: f64) -> Self {
        let per_pixel = PI / height_px * if self.is_flying { -0.5 } else { 1.0 };
        self.turned((from[0] - to[0]) * per_pixel, (to[1] - from[1]) * per_pixel)
    }

    /// The point of the pivot's plane at a place of the canvas, from the middle of the canvas.
    fn in_pivot_plane(&self, [x, y]: Place, height_px: f64) -> DVec3 {
        let per_pixel = 2.0 * self.distance * (self.fov_y.to_radians() / 2.0).tan() / height_px;
        self.pivot() + self.world_from_camera() * DVec3::new(x, -y, 0.0) * per_pixel
    }

    /// After a drag that takes the pivot's plane with it: what was under the pointer stays there.
    #[must_use]
    pub fn panned(self, from: Place, to: Place, height_px: f64) -> Self {
        let moved = self.in_pivot_plane(from, height_px) - self.in_pivot_plane(to, height_px);
        Self { target: (self.pivot() + moved).to_array(), ..self }
    }

    /// Closer to the pivot by a factor; while flying, the pivot goes ahead.
    #[must_use]
    pub fn closer(self, factor: f64) -> Self {
        let distance = self.distance / factor;
        if !self.is_flying {
            return Self { distance, ..self };
        }
        Self { target: (self.pivot() + self.forward() * (self.distance - distance)).to_array(), ..self }
    }

    /// After a turn of the wheel.
    #[must_use]
    pub fn wheeled(self, pixels: f64) -> Self {
        self.closer((-pixels * WHEEL_PER_PIXEL).exp())
    }

    /// After a move of one of two fingers: their middle pans, their distance comes closer.
    #[must_use]
    pub fn pinched(self, other: Place, from: Place, to: Place, height_px: f64) -> Self {
        let distance = |place: Place| (place[0] - other[0]).hypot(place[1] - other[1]);
        let middle = |place: Place| [(place[0] + other[0]) / 2.0, (place[1] + other[1]) / 2.0];
        self.panned(middle(from), middle(to), height_px).closer(distance(to) / distance(from))
    }

    /// The greatest difference between two cameras: of the eye, the pivot, and the field of view.
    #[must_use]
    pub fn difference(&self, other: &Self) -> f64 {
        let places = (self.eye() - other.eye()).length().max((self.pivot() - other.pivot()).length());
        places.max((self.fov_y - other.fov_y).abs())
    }
}
