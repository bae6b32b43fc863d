//! Fallbacks of a live session under overload, in order: fewer rays of light, a coarser method, smaller sample images,
//! fewer pictures a second. Each fallback includes those before it.

use cluster::Quality;
use reconstruction::ReconstructionMethod;
use render::Lighting;

/// Sides of sample images, over those asked for.
const SAMPLE_SIDE_RATIO: f64 = 0.7;
/// Pictures a second, over those asked for.
const FRAME_RATE_RATIO: f64 = 0.8;

/// All fallbacks of a lighting and a method, named as on the command line. Steps that they do not have are skipped.
#[must_use]
pub fn ladder(lighting: &str, method: &str) -> Vec<Quality> {
    let fewer_rays = lighting.parse().ok().and_then(|lighting: Lighting| lighting.with_fewer_rays());
    let fewer_steps = method.parse().ok().and_then(|method: ReconstructionMethod| method.coarser());
    let all = Quality {
        lighting: lighting.to_owned(),
        method: method.to_owned(),
        sample_side_ratio: 1.0,
        frame_rate_ratio: 1.0,
    };
    let dim = fewer_rays.map(|lighting| Quality { lighting: lighting.to_string(), ..all.clone() });
    let above = dim.clone().unwrap_or(all);
    let coarse = fewer_steps.map(|method| Quality { method: method.to_string(), ..above.clone() });
    let above = coarse.clone().unwrap_or(above);
    let small = Quality { sample_side_ratio: SAMPLE_SIDE_RATIO, ..above };
    let slow = Quality { frame_rate_ratio: FRAME_RATE_RATIO, ..small.clone() };
    dim.into_iter().chain(coarse).chain([small, slow]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_reduced_first_and_the_frame_rate_last() {
        let ladder = ladder("soft 16, occlusion 8", "light_field_search:100");
        let steps: Vec<_> = ladder
            .iter()
            .map(|q| (q.lighting.as_str(), q.method.as_str(), q.sample_side_ratio, q.frame_rate_ratio))
            .collect();
        let (dim, coarse) = ("soft 4, occlusion 2", "light_field_search:50");
        assert_eq!(
            steps,
            [
                (dim, "light_field_search:100", 1.0, 1.0),
                (dim, coarse, 1.0, 1.0),
                (dim, coarse, 0.7, 1.0),
                (dim, coarse, 0.7, 0.8)
            ]
        );
    }

    #[test]
    fn steps_without_a_coarser_setting_are_skipped() {
        assert_eq!(ladder("phong", "mesh").len(), 2);
        assert_eq!(ladder("phong", "joint_carve").len(), 3);
        assert_eq!(ladder("of the future", "of the future").len(), 2);
    }
}
