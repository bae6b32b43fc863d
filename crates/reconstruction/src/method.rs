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
}

/// Most steps a search may ask for.
const MAX_STEPS: u32 = 65_536;
const MAX_STOP_LEVEL: u32 = 8;

impl Default for ReconstructionMethod {
    fn default() -> Self {
        Self::JointCarve { stop_level: 0 }
    }
}

/// Not the name of a method, or not a number it takes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown reconstruction method {0:?}, expected joint_carve, joint_carve:LEVEL (0 to 8), light_field_search or light_field_search:STEPS (1 to 65536)"
)]
pub struct UnknownMethod(String);

impl FromStr for ReconstructionMethod {
    type Err = UnknownMethod;
    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        let unknown = || UnknownMethod(text.to_owned());
        let (name, number) = match text.split_once(':') {
            Some((name, number)) => (name, Some(number.parse::<u32>().map_err(|_| unknown())?)),
            None => (text, None),
        };
        match (name, number) {
            ("joint_carve", level) if level.unwrap_or(0) <= MAX_STOP_LEVEL => {
                Ok(Self::JointCarve { stop_level: level.unwrap_or(0) })
            }
            // The paper's 100 steps.
            ("light_field_search", steps) if (1..=MAX_STEPS).contains(&steps.unwrap_or(100)) => {
                Ok(Self::LightFieldSearch { steps: steps.unwrap_or(100) })
            }
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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_nonsense_is_refused() {
        for name in ["joint_carve", "joint_carve:3", "light_field_search:8"] {
            assert_eq!(name.parse::<ReconstructionMethod>().expect(name).to_string(), name);
        }
        for name in [
            "",
            "carve",
            "joint_carve:9",
            "light_field_search:0",
            "light_field_search:-1",
            "light_field_search:99999999999",
        ] {
            assert!(name.parse::<ReconstructionMethod>().is_err(), "{name}");
        }
    }
}
