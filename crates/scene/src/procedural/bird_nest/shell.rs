//! The surface of the beams: a facade that leans out, a round eave, and a roof with an opening.

use glam::{Vec2, Vec3};

use super::super::geometry::{Station, on_ellipse};
use super::super::random::lerp;

/// The seed of all that is random in the model.
pub(super) const SEED: u64 = 2008;
/// Number of sectors of an ellipse around the stadium.
pub(super) const SECTORS: u32 = 96;

/// Half axes of the eave and of the opening of the roof, in plan.
const EAVE_M: Vec2 = Vec2::new(166.0, 148.0);
const OPENING_M: Vec2 = Vec2::new(91.0, 62.0);
/// The eave's height at the ends of the longer axis, and its additional height at those of the shorter.
const LOW_M: f32 = 42.0;
const RISE_M: f32 = 26.0;
/// Distance of the facade's foot behind the eave.
const LEAN_M: f32 = 13.0;
/// Distance from the sharp edge of an eave to the end of its rounding.
const ROUNDING_M: f32 = 13.0;
/// Begin and end of the rounding on the way up, 0 at the foot and 1 at the opening.
const ROUNDED: [f32; 2] = [0.3, 0.45];

/// Height of the eave.
pub(super) fn eave_height_m(angle_rad: f32) -> f32 {
    LOW_M + RISE_M * angle_rad.sin().powi(2)
}

/// A point at an angle around the stadium, `inwards_m` behind the outermost shell. `up` is 0 at the ground, about 0.4
/// at the eave and 1 at the opening.
pub(super) fn station(angle_rad: f32, up: f32, inwards_m: f32) -> Station {
    const STEP: f32 = 1e-3;
    let around = outermost(angle_rad + STEP, up) - outermost(angle_rad - STEP, up);
    let upwards = outermost(angle_rad, up + STEP) - outermost(angle_rad, up - STEP);
    let normal = upwards.cross(around).normalize_or(Vec3::Y);
    Station { middle: outermost(angle_rad, up) - normal * inwards_m, up: normal }
}

fn outermost(angle_rad: f32, up: f32) -> Vec3 {
    let height_m = eave_height_m(angle_rad);
    let eave = on_ellipse(EAVE_M, angle_rad, height_m);
    // The roof sinks a little towards the opening, whose edge is a flatter saddle.
    let opening = on_ellipse(OPENING_M, angle_rad, lerp(height_m, LOW_M + 0.5 * RISE_M, 0.4) - 4.0);
    let outwards = Vec3::new(eave.x - opening.x, 0.0, eave.z - opening.z).normalize_or(Vec3::X);
    let foot = Vec3::new(eave.x, 0.0, eave.z) - outwards * LEAN_M;
    let before = eave + (foot - eave).normalize_or(Vec3::NEG_Y) * ROUNDING_M;
    let after = eave + (opening - eave).normalize_or(Vec3::NEG_X) * ROUNDING_M;
    let [begins, ends] = ROUNDED;
    if up < begins {
        foot.lerp(before, up / begins)
    } else if up < ends {
        let t = (up - begins) / (ends - begins);
        before.lerp(eave, t).lerp(eave.lerp(after, t), t)
    } else {
        after.lerp(opening, (up - ends) / (1.0 - ends))
    }
}
