//! Texels of a layered depth cube that grow in the picture as the viewer walks into the scene.

use depth_image::{Aabb, PinholeCamera, View};
use glam::Vec3;
use render::{LayerSelection, Lighting};

use crate::failures::curve::{Curve, Rows, Series, X};
use crate::failures::measures::{foreground, not_held};
use crate::failures::shape::Shape;
use crate::failures::stage::looking;
use crate::failures::stand::Stand;
use crate::layered::subject::Subject;
use crate::layered::views::{LAYERED, figures, made};

const SCENE: &str = "urban";
const FOV_DEG: f32 = 45.0;
/// Lines along the longest edge, in the study and in tests: a view from afar shows the whole scene.
const SIDES: [u32; 2] = [512, 256];
/// Directions from which a viewer walks in, around the upright axis.
const TURNS_DEG: [f32; 6] = [20.0, 80.0, 140.0, 200.0, 260.0, 320.0];
/// What a ray meets farther than this behind a surface is another one, in spacings.
const BEHIND: f32 = 4.0;

pub const CURVE: Curve = Curve {
    name: "Errors against texels in the picture",
    subject: "a town, a layered depth cube, the viewer walks in",
    x: X::log("side of a texel", "px", &[0.14, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0]),
    y: ["1 − SSIM of the foreground; hits off by 1 % of the distance; surfaces not held", ""],
    series: &[
        Series::new("1 − SSIM", &[Shape::rises(0.05, 0.025)]),
        Series::new("wrong hits", &[Shape::rises(0.02, 0.005)]),
        Series::new("not held", &[Shape::Bounded { least: 0.0, most: 0.06 }, Shape::Plateau { tolerance: 0.03 }]),
    ],
    why: "Silhouettes are those of squares, and colours are a texel apart: both grow in the picture. As many surfaces are lost from afar.",
    measure,
};

fn measure(stand: &Stand, sides_px: &[f64]) -> anyhow::Result<Rows> {
    let side = SIDES[usize::from(stand.is_small)];
    let walk = |bounds: &Aabb| -> Vec<PinholeCamera> {
        let spacing_m = bounds.size().max_element() / (side - 1) as f32;
        let towards =
            |side_px: f64| TURNS_DEG.map(|turn_deg| camera(stand, bounds, spacing_m / side_px as f32, turn_deg));
        sides_px.iter().flat_map(|&side_px| towards(side_px)).collect()
    };
    let subject = Subject::of_views(stand, SCENE, Lighting::default(), walk)?;
    let cube = subject.cube((side, LayerSelection::Dominant), subject.lighting, 1)?;
    let views = made(&subject, &subject.upload(&cube)?.0, &subject.views, LAYERED)?;
    let places = subject.truths.chunks(TURNS_DEG.len()).zip(views.chunks(TURNS_DEG.len()));
    let row = |(truths, views): (&[View], &[View])| {
        let wrong_hits = figures(truths, views, f64::NAN)?.wrong_hits;
        Ok(vec![
            1.0 - foreground(truths, views)?.ssim,
            wrong_hits,
            not_held(truths, views, BEHIND * cube.grid.spacing_m),
        ])
    };
    places.map(row).collect()
}

/// Towards the middle of the scene, where a pixel has this side.
fn camera(stand: &Stand, bounds: &Aabb, pixel_m: f32, turn_deg: f32) -> PinholeCamera {
    let focal_px = 0.5 * stand.view_px.y as f32 / (0.5 * FOV_DEG.to_radians()).tan();
    let from = Vec3::new(0.0, 0.5, 0.87).rotate_y(turn_deg.to_radians());
    looking(bounds.center() + from * (pixel_m * focal_px), bounds.center(), FOV_DEG, stand.view_px)
}
