//! A linear search along each view ray, refined by bisection (Lages §4.2).

/// As in the paper.
pub(super) const DEFAULT_STEPS: u32 = 100;
const MAX_STEPS: u32 = 65_536;

pub(super) fn parse_steps(text: &str) -> Option<u32> {
    text.parse().ok().filter(|steps| (1..=MAX_STEPS).contains(steps))
}

/// Half as many steps.
pub(super) fn fewer_steps(steps: u32) -> Option<u32> {
    (steps > 1).then_some(steps / 2)
}
