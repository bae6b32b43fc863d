//! Images that leave out what those before them hold (Xie §3, Algorithm 1): by which test.

use render::{Asks, LeaveOut};

use crate::Redundancy;

const PIXEL: &str = "non_redundant_pixel.wgsl";
const VISIBILITY: &str = "non_redundant_visibility.wgsl";
const TOLERANCE: &str = "non_redundant_tolerance.wgsl";

pub(crate) const SHADERS: [(&str, &str); 3] = [
    (PIXEL, include_str!("non_redundant_pixel.wgsl")),
    (VISIBILITY, include_str!("non_redundant_visibility.wgsl")),
    (TOLERANCE, include_str!("non_redundant_tolerance.wgsl")),
];

pub(crate) const fn test(redundancy: Redundancy) -> LeaveOut {
    let (shader, asks) = match redundancy {
        Redundancy::Pixel => (PIXEL, Asks::SurfaceIds),
        Redundancy::Visibility => (VISIBILITY, Asks::Scene),
        Redundancy::Tolerance => (TOLERANCE, Asks::Samples),
    };
    LeaveOut { shader, asks, from_one_place: false, settled: false, only_useful: false }
}
