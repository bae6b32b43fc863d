//! How views are found in depth images.

use std::{fmt, str::FromStr};

/// A closed set: each variant is one file pair, one docs page and one row in the study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReconstructionMethod {
    /// Lages §4.2: a linear search of so many steps, refined by bisection.
    LightFieldSearch {
        /// From where a ray enters the volume to where it leaves it.
        steps: u32,
    },
    /// Min-max pyramids of all cameras traversed together; weighted blending.
    JointCarve {
        /// The pyramid level at which the search ends; 0 is exact.
        stop_level: u32,
    },
    /// Two triangles between each four neighbouring samples of one surface.
    Mesh,
    /// Xie's Algorithm 4: each sample a quad of its texel, its corners shared with its neighbours.
    HybridMesh {
        /// Merge blocks of quads that are flat within this; `None` leaves every quad its own.
        merged: Option<ErrorBound>,
    },
}

/// How far merged quads may be off what they replace, as seen from the side at the sample's distance: in hundredths of
/// a sample pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorBound(u16);

impl ErrorBound {
    const GREATEST: u16 = 10_000;

    /// From 0.01 to 100 pixels; `None` beyond, or where a hundredth is too coarse to say it.
    #[must_use]
    pub fn from_px(px: f64) -> Option<Self> {
        let hundredths = (px * 100.0).round();
        let fits = (1.0..=f64::from(Self::GREATEST)).contains(&hundredths) && (px * 100.0 - hundredths).abs() < 1e-6;
        fits.then_some(Self(hundredths as u16))
    }

    /// In pixels.
    #[must_use]
    pub fn px(self) -> f32 {
        f32::from(self.0) / 100.0
    }
}

impl fmt::Display for ErrorBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", f64::from(self.0) / 100.0)
    }
}

/// Most steps a search may ask for.
const MAX_STEPS: u32 = 65_536;
const MAX_STOP_LEVEL: u32 = 8;

impl Default for ReconstructionMethod {
    fn default() -> Self {
        Self::JointCarve { stop_level: 0 }
    }
}

impl ReconstructionMethod {
    /// With half the steps, or one level less deep; `None` where there are no fewer.
    #[must_use]
    pub fn with_fewer_steps(self) -> Option<Self> {
        match self {
            Self::LightFieldSearch { steps } => (steps > 1).then_some(Self::LightFieldSearch { steps: steps / 2 }),
            Self::JointCarve { stop_level } => {
                (stop_level < MAX_STOP_LEVEL).then_some(Self::JointCarve { stop_level: stop_level + 1 })
            }
            Self::Mesh | Self::HybridMesh { .. } => None,
        }
    }
}

/// Not the name of a method, or not a number it takes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown reconstruction method {0:?}, expected joint_carve, joint_carve:LEVEL (0 to 8), light_field_search, light_field_search:STEPS (1 to 65536), mesh, hybrid_mesh or hybrid_mesh:PX (0.01 to 100)"
)]
pub struct UnknownMethod(String);

impl FromStr for ReconstructionMethod {
    type Err = UnknownMethod;
    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        let unknown = || UnknownMethod(text.to_owned());
        let (name, number) = text.split_once(':').map_or((text, None), |(name, number)| (name, Some(number)));
        let name = name.replace('-', "_");
        if let ("hybrid_mesh", Some(px)) = (name.as_str(), number) {
            let bound = px.parse().ok().and_then(ErrorBound::from_px).ok_or_else(unknown)?;
            return Ok(Self::HybridMesh { merged: Some(bound) });
        }
        let number = number.map(|number| number.parse::<u32>().map_err(|_| unknown())).transpose()?;
        match (name.as_str(), number) {
            ("joint_carve", level) if level.unwrap_or(0) <= MAX_STOP_LEVEL => {
                Ok(Self::JointCarve { stop_level: level.unwrap_or(0) })
            }
            // The paper's 100 steps.
            ("light_field_search", steps) if (1..=MAX_STEPS).contains(&steps.unwrap_or(100)) => {
                Ok(Self::LightFieldSearch { steps: steps.unwrap_or(100) })
            }
            ("mesh", None) => Ok(Self::Mesh),
            ("hybrid_mesh", None) => Ok(Self::HybridMesh { merged: None }),
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for ReconstructionMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointCarve { stop_level: 0 } => f.write_str("joint_carve"),
            Self::JointCarve { stop_level } => write!(f, "joint_carve:{stop_level}"),
            Self::LightFieldSearch { steps } => write!(f, "light_field_search:{steps}"),
            Self::Mesh => f.write_str("mesh"),
            Self::HybridMesh { merged: None } => f.write_str("hybrid_mesh"),
            Self::HybridMesh { merged: Some(bound) } => write!(f, "hybrid_mesh:{bound}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_nonsense_is_refused() {
        let meshes = ["mesh", "hybrid_mesh", "hybrid_mesh:0.01", "hybrid_mesh:0.5", "hybrid_mesh:2", "hybrid_mesh:100"];
        for name in ["joint_carve", "joint_carve:3", "light_field_search:8"].into_iter().chain(meshes) {
            assert_eq!(name.parse::<ReconstructionMethod>().expect(name).to_string(), name);
            assert_eq!(name.replace('_', "-").parse::<ReconstructionMethod>().expect(name).to_string(), name);
        }
        for name in [
            "",
            "carve",
            "joint_carve:9",
            "light_field_search:0",
            "light_field_search:-1",
            "light_field_search:99999999999",
            "mesh:1",
            "hybrid_mesh:",
            "hybrid_mesh:0",
            "hybrid_mesh:0.001",
            "hybrid_mesh:0.123",
            "hybrid_mesh:-1",
            "hybrid_mesh:101",
            "hybrid_mesh:NaN",
            "hybrid_mesh:inf",
        ] {
            assert!(name.parse::<ReconstructionMethod>().is_err(), "{name}");
        }
    }

    #[test]
    fn fewer_steps_end_somewhere() {
        let steps = |name: &str| {
            let next = |method: &ReconstructionMethod| method.with_fewer_steps();
            std::iter::successors(Some(name.parse::<ReconstructionMethod>().expect(name)), next).count()
        };
        assert_eq!((steps("light_field_search:100"), steps("joint_carve"), steps("mesh")), (7, 9, 1));
    }

    #[test]
    fn the_error_names_every_method() {
        let error = "carve".parse::<ReconstructionMethod>().expect_err("no method").to_string();
        for name in ["joint_carve:LEVEL", "light_field_search:STEPS", " mesh,", "hybrid_mesh ", "hybrid_mesh:PX"] {
            assert!(error.contains(name), "{name} is not in {error}");
        }
    }
}
