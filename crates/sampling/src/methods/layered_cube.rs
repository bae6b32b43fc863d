//! A layered depth cube (Lischinski §3.1): all surfaces of a scene on lines along three axes. Its shaders are in `render`, where
//! lines of fragments are drawn: `append.wgsl` and `layered/lit.wgsl`.

use std::fmt;

use depth_image::CUBE_SIDES;
use render::LayerSelection;

/// The setting, as users spell it.
pub(crate) const FORM: &str = "SIDE[:all|:dominant] (16 to 4096)";

/// The density of a cube, and the surfaces that it keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LayeredCube {
    /// Lines along the longest side of the scene's bounds; all lines are as far apart.
    pub side: u32,
    /// The surfaces on a line that are samples.
    pub kept: LayerSelection,
}

impl LayeredCube {
    pub(crate) const DEFAULT: Self = Self { side: 512, kept: LayerSelection::Dominant };
}

pub(crate) fn parse(text: &str) -> Option<LayeredCube> {
    let (side, kept) = text.split_once(':').unwrap_or((text, "dominant"));
    let kept = match kept {
        "all" => LayerSelection::All,
        "dominant" => LayerSelection::Dominant,
        _ => return None,
    };
    let side = side.parse().ok().filter(|side| CUBE_SIDES.contains(side))?;
    Some(LayeredCube { side, kept })
}

impl fmt::Display for LayeredCube {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kept {
            LayerSelection::All => write!(f, "{}:all", self.side),
            LayerSelection::Dominant => write!(f, "{}", self.side),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_parsed_and_printed_alike() {
        for text in ["16", "512", "4096:all"] {
            assert_eq!(parse(text).map(|cube| cube.to_string()).as_deref(), Some(text));
        }
        assert_eq!(parse("512:dominant"), Some(LayeredCube::DEFAULT));
        for text in ["", "all", "512:", ":all", "-16", "16.0", "512:All"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
