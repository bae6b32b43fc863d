//! Which images surround the mirrors of a scene.

use std::fmt;
use std::str::FromStr;

/// The most images of a mirror.
const MOST_IMAGES: usize = 8;
/// The share of mirrored rays that images need not see all the way, unless stated, in percent. Small objects are met by few
/// rays: with one percent they would be seen badly.
const UNSEEN_PERCENT: f32 = 0.3;

/// The images of what mirrors show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Impostors {
    /// None: mirrors show the environment alone.
    None,
    /// As few as see all but this percentage of mirrored rays all the way, at most eight.
    Auto(f32),
    /// This number, those that see most; at most eight. An image that sees nothing new is left out.
    Pinholes(u32),
}

/// A text that names no images.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is none of auto, auto:UNSEEN (percent, 0 to 100), pinhole:N (1 to {MOST_IMAGES}) and none")]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct UnknownImpostors {
    pub text: String,
}

impl Impostors {
    /// The most images, and the share of rays below which fewer will do. `None` without images.
    pub(crate) fn bounds(self) -> Option<(usize, f32)> {
        match self {
            Self::None => None,
            Self::Auto(percent) => Some((MOST_IMAGES, percent / 100.0)),
            Self::Pinholes(images) => Some((images as usize, 0.0)),
        }
    }
}

impl Default for Impostors {
    fn default() -> Self {
        Self::Auto(UNSEEN_PERCENT)
    }
}

impl fmt::Display for Impostors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Auto(percent) => write!(f, "auto:{percent}"),
            Self::Pinholes(images) => write!(f, "pinhole:{images}"),
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
            None if text == "pinhole" => Ok(Self::Pinholes(1)),
            Some(("auto", percent)) => {
                let percent: f32 = percent.parse().map_err(|_| unknown())?;
                (0.0..=100.0).contains(&percent).then_some(Self::Auto(percent)).ok_or_else(unknown)
            }
            Some(("pinhole", images)) => {
                let images: u32 = images.parse().map_err(|_| unknown())?;
                (1..=MOST_IMAGES as u32).contains(&images).then_some(Self::Pinholes(images)).ok_or_else(unknown)
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
        for text in ["none", "auto:1", "auto:0.5", "pinhole:1", "pinhole:8"] {
            assert_eq!(text.parse::<Impostors>().map(|impostors| impostors.to_string()), Ok(text.to_owned()));
        }
        assert_eq!("auto".parse(), Ok(Impostors::default()));
        assert_eq!("pinhole".parse(), Ok(Impostors::Pinholes(1)));
        for text in ["", "all", "auto:", "auto:-1", "auto:101", "auto:NaN", "pinhole:0", "pinhole:9", "none:1"] {
            assert!(text.parse::<Impostors>().is_err(), "{text}");
        }
    }
}
