//! Subjects, lightings, and how much of them is measured.

use glam::UVec2;

use crate::lit_views::light::{Light, LightRays};
use crate::lit_views::subject::{OrbitViews, VIEW_PX};

/// The lightings of the subjects. Their rays are those of samples and of points that no sample knows.
pub const LIGHTS: [Light; 2] = [Light::Indirect, Light::Occlusion];
/// Rays a pixel, as in `soft 16, indirect 64`.
const INDIRECT_RAYS: LightRays = LightRays::new(16, 64);
const OCCLUSION_RAYS: LightRays = LightRays::new(16, 16);
/// Two interiors, and two subjects that are seen from outside; the quick ones come first.
const SUBJECTS: [&str; 4] = ["courtyard, inside", "urban, inside", "tree-terrain-500k", "FlightHelmet"];
const QUICK_SUBJECTS: usize = 1;
const VIEWS: OrbitViews = OrbitViews { count: 8, size_px: VIEW_PX };
const QUICK_VIEWS: OrbitViews = OrbitViews { count: 3, size_px: UVec2::new(160, 90) };

pub fn subject_names(is_quick: bool) -> &'static [&'static str] {
    if is_quick { &SUBJECTS[..QUICK_SUBJECTS] } else { &SUBJECTS }
}

/// Whether viewers stand among the surfaces that light each other.
pub fn is_interior(subject: &str) -> bool {
    subject.ends_with(", inside")
}

pub fn views(is_quick: bool) -> OrbitViews {
    if is_quick { QUICK_VIEWS } else { VIEWS }
}

/// The lighting of all rows but direct drawing.
pub fn lighting(light: Light) -> String {
    light.lighting(match light {
        Light::Indirect => INDIRECT_RAYS,
        Light::Occlusion => OCCLUSION_RAYS,
    })
}
