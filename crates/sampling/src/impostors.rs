//! Which images surround the mirrors of a scene.

use std::fmt;
use std::str::FromStr;

/// The most images of a mirror.
const MOST_IMAGES: u32 = 8;
/// The most single-pole images of a mirror: from two sides they show an object whole.
const MOST_SINGLE_POLES: u32 = 2;

/// The images of what each mirror shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Impostors {
    /// Mirrors show what a base holds, or else the environment alone.
    #[default]
    None,
    /// Pinhole images.
    Pinholes {
        /// From 1 to 8.
        images: u32,
    },
    /// Single-pole images of the object that the mirror shows largest, and of nothing else. Where there is none, as many pinholes
    /// are taken.
    SinglePoles {
        /// One, or two from both sides.
        images: u32,
    },
}

/// A text that names no images.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is none of pinhole:N (1 to {MOST_IMAGES}), single_pole:N (1 or {MOST_SINGLE_POLES}) and none")]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct UnknownImpostors {
    pub text: String,
}

impl fmt::Display for Impostors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Pinholes { images } => write!(f, "pinhole:{images}"),
            Self::SinglePoles { images } => write!(f, "single_pole:{images}"),
        }
    }
}

impl FromStr for Impostors {
    type Err = UnknownImpostors;

    fn from_str(text: &str) -> Result<Self, UnknownImpostors> {
        let (model, images) = text.split_once(':').map_or((text, None), |(model, images)| (model, Some(images)));
        let count: Option<u32> = images.map_or(Some(1), |images| images.parse().ok());
        match (model, count) {
            ("none", _) if images.is_none() => Ok(Self::None),
            ("pinhole", Some(images @ 1..=MOST_IMAGES)) => Ok(Self::Pinholes { images }),
            ("single_pole", Some(images @ 1..=MOST_SINGLE_POLES)) => Ok(Self::SinglePoles { images }),
            _ => Err(UnknownImpostors { text: text.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written() {
        for text in ["none", "pinhole:1", "pinhole:8", "single_pole:2"] {
            assert_eq!(text.parse::<Impostors>().map(|impostors| impostors.to_string()), Ok(text.to_owned()));
        }
        assert_eq!("single_pole".parse(), Ok(Impostors::SinglePoles { images: 1 }));
        assert_eq!("pinhole".parse(), Ok(Impostors::Pinholes { images: 1 }));
        for text in ["", "all", "auto", "pinhole:", "pinhole:0", "pinhole:9", "single_pole:3", "none:1"] {
            assert!(text.parse::<Impostors>().is_err(), "{text}");
        }
    }
}
