//! Limits on the requests of any peer, checked before anything is allocated.

/// Sample cameras of one view cell; provenance has room for 24.
pub const MAX_SAMPLE_CAMERAS: usize = 16;
/// View cells of one workload.
pub const MAX_CELLS: usize = 64;
/// Blocks of one scene.
pub const MAX_BLOCKS: usize = 64;
/// Common cells of one workload: mirrors and a base, or blocks.
pub const MAX_COMMON_CELLS: usize = MAX_BLOCKS;
/// Viewpoints of one session.
pub const MAX_VIEWPOINTS: usize = 256;
/// Tiles of one sample image.
pub const MAX_TILES: u32 = 16;
/// Fallbacks of one session.
pub const MAX_FALLBACKS: usize = 16;
/// Steps in which a still picture's light is refined.
pub const MAX_REFINEMENT_STEPS: u32 = 64;
/// Views of one request.
pub const MAX_VIEWS_PER_REQUEST: usize = 4096;
/// Views of one request of a live stream.
pub const MAX_LIVE_VIEWS_PER_REQUEST: usize = 1;
/// Views of one sample set in a session.
pub const MAX_VIEWS_PER_SET: u32 = 1 << 16;
/// Pictures a second of one session.
pub const MAX_FRAMES_PER_S: f64 = 1000.0;
/// Sample sets of one timeline.
pub const MAX_SETS: u32 = 1 << 20;
/// Scene time in seconds, to either side of 0: eleven days. Views of a set grow with the time that it is shown.
pub const MAX_SCENE_TIME_S: f64 = 1e6;
/// Nodes of one plan.
pub const MAX_NODES: usize = 1024;
/// Scenes on offer.
pub const MAX_SCENES: usize = 64;
/// Workloads that may be open at a time.
pub const MAX_WORKLOADS: usize = 64;
/// Views measured in one call.
pub const MAX_BATCH: u32 = 64;
/// Views probed in one call.
pub const MAX_PROBE_VIEWS: usize = 64;
/// The highest epoch that a member may join with: a coordinator goes on from there, which must leave room.
pub const MAX_JOINING_EPOCH: u64 = 1 << 48;
/// Bytes of a name, an address or a method.
pub const MAX_TEXT_BYTES: usize = 256;
/// Bytes of a reason or a progress line.
pub const MAX_REASON_BYTES: usize = 4096;
/// Bytes of one scene package.
pub const MAX_SCENE_BYTES: u64 = 8 << 30;
