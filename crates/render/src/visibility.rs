//! Ways of finding surfaces: by drawing triangles, or by one ray a pixel. The faster way depends on the scene, the
//! size of its pictures and the device, so it is measured.

use std::{fmt, str::FromStr};

/// The ways of finding surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Visibility {
    /// Whichever was faster when both were tried.
    #[default]
    Measured,
    /// Every triangle is drawn.
    Triangles,
    /// Every pixel sends a ray.
    Rays,
}

/// A text that names no way of finding surfaces.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown visibility {0:?}, expected measured, triangles or rays")]
pub struct UnknownVisibility(String);

/// The costs of both ways for pictures of one size of a scene, unlit, to host pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Seconds a view.
    pub triangles_s: f64,
    /// Seconds a view, the tree not counted.
    pub rays_s: f64,
}

impl Choice {
    /// The way that is taken.
    #[must_use]
    pub fn rays_are_faster(&self) -> bool {
        self.rays_s < self.triangles_s
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let chosen = if self.rays_are_faster() { Visibility::Rays } else { Visibility::Triangles };
        let ms = |s: f64| s * 1e3;
        write!(f, "{chosen} (triangles {:.2} ms, rays {:.2} ms a view)", ms(self.triangles_s), ms(self.rays_s))
    }
}

impl FromStr for Visibility {
    type Err = UnknownVisibility;
    fn from_str(text: &str) -> Result<Self, UnknownVisibility> {
        let ways = [Self::Measured, Self::Triangles, Self::Rays];
        ways.into_iter().find(|way| way.to_string() == text).ok_or_else(|| UnknownVisibility(text.to_owned()))
    }
}

impl fmt::Display for Visibility {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Measured => "measured",
            Self::Triangles => "triangles",
            Self::Rays => "rays",
        })
    }
}
