//! Which images surround the mirrors of a scene.

use std::fmt;
use std::str::FromStr;

/// The most images of a mirror.
const MOST_IMAGES: usize = 8;
/// The most single-pole images of a mirror: from two sides they show an object whole.
const MOST_SINGLE_POLES: usize = 2;
/// The share of mirrored rays that images need not see all the way, unless stated, in percent. Small objects are met by few
/// rays: with one percent they would be seen badly.
const UNSEEN_PERCENT: f32 = 0.3;

/// The images of what mirrors show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Impostors {
    /// None: mirrors show what a base holds, or else the environment alone.
    None,
    /// As few as see mirrored rays all the way, at most eight.
    Auto {
        /// The percentage of rays that they need not see.
        unseen_percent: f32,
    },
    /// A number of them, in the same order. An image that sees nothing new is left out.
    Pinholes {
        /// At most eight.
        images: u32,
    },
    /// Single-pole images of the object that most mirrored rays meet, which show nothing else. Where there is none, pinholes are
    /// taken, as many as are needed.
    SinglePoles {
        /// One, or two from both sides.
        images: u32,
    },
}

/// How many images a mirror has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImageLimits {
    pub models: Models,
    pub most: usize,
    /// The share of rays that images need not see all the way: fewer will do.
    pub unseen_ratio: f32,
}

/// The models of cameras that may be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Models {
    All,
    Pinholes,
    /// As many single-pole images, where they can be.
    SinglePoles(usize),
}

/// A text that names no images.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is none of auto, auto:UNSEEN (percent, 0 to 100), pinhole:N (1 to {MOST_IMAGES}), single_pole:N (1 or 2) and none"
)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct UnknownImpostors {
    pub text: String,
}

impl Impostors {
    /// `None` without images.
    pub(crate) fn limits(self) -> Option<ImageLimits> {
        match self {
            Self::None => None,
            Self::Auto { unseen_percent } => {
                Some(ImageLimits { models: Models::All, most: MOST_IMAGES, unseen_ratio: unseen_percent / 100.0 })
            }
            Self::Pinholes { images } => {
                Some(ImageLimits { models: Models::Pinholes, most: images as usize, unseen_ratio: 0.0 })
            }
            Self::SinglePoles { images } => {
                let models = Models::SinglePoles(images as usize);
                Some(ImageLimits { models, most: MOST_IMAGES, unseen_ratio: UNSEEN_PERCENT / 100.0 })
            }
        }
    }
}

impl Default for Impostors {
    fn default() -> Self {
        Self::Auto { unseen_percent: UNSEEN_PERCENT }
    }
}

impl fmt::Display for Impostors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Auto { unseen_percent } => write!(f, "auto:{unseen_percent}"),
            Self::Pinholes { images } => write!(f, "pinhole:{images}"),
            Self::SinglePoles { images } => write!(f, "single_pole:{images}"),
        }
    }
}

impl FromStr for Impostors {
    type Err = UnknownImpostors;

    fn from_str(text: &str) -> Result<Self, UnknownImpostors> {
        let unknown = || UnknownImpostors { text: text.to_owned() };
        match text.split_once(':') {
            None if text == "none" => Ok(Self::None),
            None if text == "auto" => Ok(Self::default()),
            None if text == "pinhole" => Ok(Self::Pinholes { images: 1 }),
            None if text == "single_pole" => Ok(Self::SinglePoles { images: 1 }),
            Some(("auto", percent)) => {
                let unseen_percent: f32 = percent.parse().map_err(|_| unknown())?;
                let is_percent = (0.0..=100.0).contains(&unseen_percent);
                is_percent.then_some(Self::Auto { unseen_percent }).ok_or_else(unknown)
            }
            Some((model @ ("pinhole" | "single_pole"), images)) => {
                let images: u32 = images.parse().map_err(|_| unknown())?;
                let is_pinhole = model == "pinhole";
                let most = if is_pinhole { MOST_IMAGES } else { MOST_SINGLE_POLES };
                let of = if is_pinhole { Self::Pinholes { images } } else { Self::SinglePoles { images } };
                (1..=most as u32).contains(&images).then_some(of).ok_or_else(unknown)
            }
            _ => Err(unknown()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written() {
        for text in ["none", "auto:1", "auto:0.5", "pinhole:1", "pinhole:8", "single_pole:2"] {
            assert_eq!(text.parse::<Impostors>().map(|impostors| impostors.to_string()), Ok(text.to_owned()));
        }
        assert_eq!("auto".parse(), Ok(Impostors::default()));
        assert_eq!("single_pole".parse(), Ok(Impostors::SinglePoles { images: 1 }));
        assert_eq!("pinhole".parse(), Ok(Impostors::Pinholes { images: 1 }));
        for text in
            ["", "all", "auto:", "auto:-1", "auto:101", "auto:NaN", "pinhole:0", "pinhole:9", "single_pole:3", "none:1"]
        {
            assert!(text.parse::<Impostors>().is_err(), "{text}");
        }
    }
}
