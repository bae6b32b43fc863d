//! The rows of a subject.

use std::fmt;

use depth_image::LightCacheQuality::{self, Balanced, Fast, Fine};
use report::Point;

use crate::lit_views::light::LightRays;
use crate::lit_views::subject::SetSize;

pub const QUALITIES: [LightCacheQuality; 3] = [Fast, Balanced, Fine];
/// Numbers of sample images, and their densities.
const IMAGES: [usize; 2] = [1, 4];
const DENSITIES: [f32; 3] = [0.25, 0.5, 1.0];
/// Rays of direct drawing at each position.
pub const DIRECT_RAYS: [LightRays; 7] = LightRays::up_to(LightRays::new(4, 64));
/// Rows of a subject: all qualities with all sets, `joint_carve`, and direct drawing.
pub const ROWS: usize = QUALITIES.len() * IMAGES.len() * DENSITIES.len() + 1 + DIRECT_RAYS.len();

/// How views are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drawing {
    /// All light is traced in the view, with these rays at each position.
    Direct(LightRays),
    LightCache(LightCacheQuality),
    JointCarve,
}

/// A measured row. Errors are over the foreground, means over views.
#[derive(Debug, Clone)]
pub struct LightRow {
    pub drawing: Drawing,
    /// `None` in direct drawing.
    pub set: Option<SetSize>,
    /// The median of the views.
    pub view_ms: f64,
    /// Of the whole set; 0 in direct drawing.
    pub sampling_s: f64,
    pub flip: f64,
    pub psnr_db: f64,
    /// The share of surface pixels whose light no sample knows; `None` but with light from samples.
    pub unknown: Option<f64>,
}

impl LightRow {
    /// The time of a view, and its FLIP.
    pub fn point(&self) -> Point {
        (self.view_ms, self.flip).into()
    }
}

impl fmt::Display for Drawing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct(rays) => write!(formatter, "direct, {} and {} rays", rays.to_lamps, rays.ambient),
            Self::LightCache(quality) => write!(formatter, "light_cache:{quality}"),
            Self::JointCarve => formatter.write_str("joint_carve"),
        }
    }
}

/// All sets of light.
pub fn sets() -> impl Iterator<Item = SetSize> {
    IMAGES.into_iter().flat_map(|images| DENSITIES.into_iter().map(move |density| SetSize { images, density }))
}
