//! A layered depth cube (Lischinski §3.1): all surfaces of a scene on lines along three axes; and a layered light field (§3.2): the light
//! of all surfaces on lines of many directions. Their shaders are in `render`, where lines of fragments are drawn: `append.wgsl`,
//! `layered/lit.wgsl` and those of `reflections`.

use std::fmt;

use depth_image::{CUBE_SIDES, LIGHT_FIELD_SIDES, LightDirections};
use render::LayerSelection;

/// The setting, as users spell it.
pub(crate) const FORM: &str = "SIDE[:all|:dominant][+light_field:N[xPX]] (16 to 4096)";

/// The density of a cube, and the surfaces that it keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LayeredCube {
    /// Lines along the longest side of the scene's bounds; all lines are as far apart.
    pub side: u32,
    /// The surfaces on a line that are samples.
    pub kept: LayerSelection,
    /// A light field of the same scene, in which what mirrors show is gathered.
    pub light_field: Option<LightFieldSize>,
}

/// The size of a light field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LightFieldSize {
    /// The directions of light.
    pub directions: LightDirections,
    /// Lines along each side of the square of a direction.
    pub side_px: u32,
}

/// Lines along each side of a light field's squares, where no number is given (Lischinski §5).
const DEFAULT_SIDE_PX: u32 = 64;
const LIGHT_FIELD: &str = "light_field:";

impl LayeredCube {
    pub(crate) const DEFAULT: Self = Self { side: 512, kept: LayerSelection::Dominant, light_field: None };
}

pub(crate) fn parse(text: &str) -> Option<LayeredCube> {
    let (text, light_field) = match text.split_once('+') {
        Some((cube, light_field)) => (cube, Some(parse_light_field(light_field.strip_prefix(LIGHT_FIELD)?)?)),
        None => (text, None),
    };
    let (side, kept) = text.split_once(':').unwrap_or((text, "dominant"));
    let kept = match kept {
        "all" => LayerSelection::All,
        "dominant" => LayerSelection::Dominant,
        _ => return None,
    };
    let side = side.parse().ok().filter(|side| CUBE_SIDES.contains(side))?;
    Some(LayeredCube { side, kept, light_field })
}

fn parse_light_field(text: &str) -> Option<LightFieldSize> {
    let (count, side_px) = match text.split_once('x') {
        Some((count, side_px)) => (count, side_px.parse().ok()?),
        None => (text, DEFAULT_SIDE_PX),
    };
    let directions = LightDirections::of(count.parse().ok()?).ok()?;
    LIGHT_FIELD_SIDES.contains(&side_px).then_some(LightFieldSize { directions, side_px })
}

impl fmt::Display for LayeredCube {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.side)?;
        if self.kept == LayerSelection::All {
            f.write_str(":all")?;
        }
        let Some(LightFieldSize { directions, side_px }) = self.light_field else { return Ok(()) };
        write!(f, "+{LIGHT_FIELD}{}", directions.count())?;
        if side_px == DEFAULT_SIDE_PX { Ok(()) } else { write!(f, "x{side_px}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_parsed_and_printed_alike() {
        let fields = ["512+light_field:258", "64:all+light_field:66x16", "512+light_field:1026x90"];
        for text in ["16", "512", "4096:all"].into_iter().chain(fields) {
            assert_eq!(parse(text).map(|cube| cube.to_string()).as_deref(), Some(text));
        }
        assert_eq!(parse("512:dominant"), Some(LayeredCube::DEFAULT));
        assert_eq!(parse("512+light_field:258x64"), parse("512+light_field:258"));
        for text in ["512+", "512+light_field", "512+light_field:", "512+light_field:100", "512+light_field:258x15"] {
            assert_eq!(parse(text), None, "{text}");
        }
        for text in [
            "512+light_field:258x91",
            "512+light_field:258x",
            "512+field:258",
            "+light_field:258",
            "512+light_field:258:all",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
        for text in ["", "all", "512:", ":all", "-16", "16.0", "512:All"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
