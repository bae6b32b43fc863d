//! The graph camera (Popescu, Rosen and Adamo-Villani 2009; Rosen et al., section 5): its rays, its images and their search.
//!
//! The camera is a tree of frusta. A ray is straight in each frustum and goes on at the face of the next in the direction from that one's
//! eye. One image so shows what lies behind corners.

mod behind;
mod camera;
mod error;
mod image;
mod plane;
mod region;
mod search;
#[cfg(test)]
pub mod test_support;
mod through;

pub use behind::behind;
pub use camera::{Frustum, GraphCamera, GraphPlace, GraphPlan, Layout, pinhole};
pub use image::{CORNERS, GraphImage, Met};
pub use plane::Plane;
pub use search::{GraphHit, GraphSearch};
pub use through::{Corridor, Portal, through, upright};
