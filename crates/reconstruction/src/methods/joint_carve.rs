//! Min-max pyramids of all cameras, traversed together; the cameras' colours are blended.

const MAX_STOP_LEVEL: u32 = 8;

pub(super) fn parse_stop_level(text: &str) -> Option<u32> {
    text.parse().ok().filter(|&level| level <= MAX_STOP_LEVEL)
}

/// One level coarser.
pub(super) fn coarser_level(stop_level: u32) -> Option<u32> {
    (stop_level < MAX_STOP_LEVEL).then_some(stop_level + 1)
}
