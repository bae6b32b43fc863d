//! Ways of finding surfaces: by drawing triangles, or by one ray a pixel. The faster way depends on the scene, the
//! size of its pictures and the device. It is measured once for a scene, at two sizes, and predicted for others.

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

/// The costs of both ways as lines over a view's pixels, measured at two sizes: they predict every other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Costs {
    fixed: Choice,
    a_pixel: Choice,
}

impl Costs {
    /// Straight lines through measured costs over the number of pixels, the view with fewer pixels first. More pixels never
    /// cost less, and no pixels no less than nothing.
    pub fn through([(least_px, least), (px, most)]: [(usize, Choice); 2]) -> Self {
        let costs = [(least.triangles_s, most.triangles_s), (least.rays_s, most.rays_s)];
        let [triangles_s, rays_s] = costs.map(|(least_s, s)| {
            ((s - least_s) / px.saturating_sub(least_px).max(1) as f64).clamp(0.0, s / px.max(1) as f64)
        });
        let fixed = Choice {
            triangles_s: most.triangles_s - triangles_s * px as f64,
            rays_s: most.rays_s - rays_s * px as f64,
        };
        Self { fixed, a_pixel: Choice { triangles_s, rays_s } }
    }

    /// The pixels up to which rays are faster. Lines that do not cross where pictures are have one answer for all sizes, that of
    /// a view of `pixels`.
    pub fn most_traced_pixels(&self, pixels: usize) -> u32 {
        let gain_s = self.fixed.triangles_s - self.fixed.rays_s;
        let loss_a_pixel_s = self.a_pixel.rays_s - self.a_pixel.triangles_s;
        if gain_s > 0.0 && loss_a_pixel_s > 0.0 {
            return (gain_s / loss_a_pixel_s) as u32;
        }
        if self.at(pixels).rays_are_faster() { u32::MAX } else { 0 }
    }

    /// The predicted costs of a view with this number of pixels.
    pub fn at(&self, pixels: usize) -> Choice {
        let Self { fixed, a_pixel } = self;
        Choice {
            triangles_s: fixed.triangles_s + a_pixel.triangles_s * pixels as f64,
            rays_s: fixed.rays_s + a_pixel.rays_s * pixels as f64,
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let chosen = if self.rays_are_faster() { Visibility::Rays } else { Visibility::Triangles };
        let [triangles_ms, rays_ms] = [self.triangles_s, self.rays_s].map(|s| s * 1e3);
        write!(f, "{chosen} (triangles {triangles_ms:.2} ms, rays {rays_ms:.2} ms a view)")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_of_other_sizes_lie_on_the_lines_through_two_measured_ones() {
        let choice = |triangles_s, rays_s| Choice { triangles_s, rays_s };
        let costs = Costs::through([(1000, choice(4.0, 1.0)), (4000, choice(4.3, 4.0))]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let same = costs.at(4000);
        let large = costs.at(10_000);
        assert!(near(same.triangles_s, 4.3) && near(same.rays_s, 4.0) && same.rays_are_faster());
        assert!(near(large.triangles_s, 4.9) && near(large.rays_s, 10.0) && !large.rays_are_faster());
    }

    #[test]
    fn rays_are_faster_up_to_where_the_lines_cross() {
        let choice = |triangles_s, rays_s| Choice { triangles_s, rays_s };
        let crossing = Costs::through([(1000, choice(4.0, 1.0)), (4000, choice(4.0, 4.0))]);
        assert!((3998..=4000).contains(&crossing.most_traced_pixels(1)), "{}", crossing.most_traced_pixels(1));
        let rays = Costs::through([(1000, choice(4.0, 1.0)), (4000, choice(16.0, 4.0))]);
        assert_eq!(rays.most_traced_pixels(4000), u32::MAX);
        let triangles = Costs::through([(1000, choice(1.0, 4.0)), (4000, choice(4.0, 16.0))]);
        assert_eq!(triangles.most_traced_pixels(4000), 0);
    }

    #[test]
    fn noisy_measurements_predict_neither_negative_nor_falling_costs() {
        let choice = |s| Choice { triangles_s: s, rays_s: s };
        for measured in [[3.0, 2.0], [0.1, 8.0], [0.0, 0.0]] {
            let costs = Costs::through([(1000, choice(measured[0])), (4000, choice(measured[1]))]);
            assert!(costs.at(1).rays_s >= 0.0 && costs.at(100_000).rays_s >= costs.at(4000).rays_s, "{measured:?}");
        }
        assert!(Costs::through([(1, choice(1.0)), (1, choice(1.0))]).at(1).rays_s.is_finite());
    }
}
