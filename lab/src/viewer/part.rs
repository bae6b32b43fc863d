//! The parts of the report, each measured by itself.

use clap::ValueEnum;

/// A row, or a group of rows, of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Part {
    /// Pictures of a drag: their rate, age, bytes, and the gateway's share
    Dragging,
    /// The lossless still after a drag
    Rest,
    /// The first picture of a page, and of a cluster
    FirstPicture,
    /// A link of 1 Mbit/s with a round trip of 80 ms, which is then freed
    SlowLink,
    /// A compositor is killed, then the gateway
    Faults,
    /// A walk around the scene, and its stills beside direct drawing
    Walk,
    /// The still of shared light of five models beside direct drawing with many rays
    Stills,
    /// Memory of the page and the gateway while a visitor drags and rests
    Memory,
}
