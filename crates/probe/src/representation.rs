//! How views of a scene are made, in terms that a node understands.

use depth_image::Camera;

/// A row of a ladder, resolved for one scene and one size of views.
#[derive(Debug, Clone, PartialEq)]
pub struct Representation {
    /// The sampling method with its setting, as on the command line.
    pub sampling: String,
    /// The reconstruction method with its setting, as on the command line.
    pub method: String,
    /// The sample cameras, in the order in which images are taken.
    pub sample_cameras: Vec<Camera>,
}
