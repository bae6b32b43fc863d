//! Samples behind redundant ones that some viewpoint between the sample cameras can see past their blockers: the ring test of
//! effective depth peeling.

use render::RedundancyTest;

use super::Redundancy;

/// Places around a blocker that are looked at.
pub const RING: u32 = 16;
/// Depths within this many footprints belong to the blocker.
pub const BLOCKER_FOOTPRINTS: f32 = 4.0;

pub(super) const fn test(redundancy: Redundancy) -> RedundancyTest {
    RedundancyTest { usefulness: Some("useful.wgsl"), ..redundancy.test() }
}
