//! Camera files: nerfstudio's `transforms.json`, so that anyone can run someone else's experiment.
//!
//! `transform_matrix` is camera to world, the camera looking down −Z with +Y up. Focal lengths and principal points are
//! in pixels, for a frame or for all. Only pinhole cameras can be used: distortion that is not zero is refused by name.
//! Files are in the scene file's own space: the origin of a re-centred scene is subtracted in double precision.

mod error;
mod placement;
mod read;
mod write;

pub use error::{CameraFault, CameraFileError};
pub use placement::Placement;
pub use read::{MAX_FILE_BYTES, MAX_FRAMES, read};
pub use write::{NamedCamera, write};
