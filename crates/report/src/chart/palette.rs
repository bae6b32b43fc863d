//! One colour for each name, in all charts.

use std::collections::HashMap;

use plotters::style::RGBColor;

/// Colours that can be told apart on white and on near black, and by most of the colour-blind.
const COLORS: [RGBColor; 12] = [
    RGBColor(47, 127, 214),
    RGBColor(224, 138, 30),
    RGBColor(42, 163, 107),
    RGBColor(217, 80, 63),
    RGBColor(154, 109, 215),
    RGBColor(31, 167, 184),
    RGBColor(214, 103, 168),
    RGBColor(165, 115, 75),
    RGBColor(154, 160, 44),
    RGBColor(90, 111, 216),
    RGBColor(196, 71, 109),
    RGBColor(111, 176, 60),
];
/// The baseline is always grey.
const BASELINE: (&str, RGBColor) = ("direct", RGBColor(133, 141, 150));

/// The colours of a report's names.
///
/// A name prefers a colour by its own letters, so that other reports have it, too. Where two names prefer one colour,
/// the later name takes the next free one.
#[derive(Debug, Clone)]
pub(crate) struct Palette {
    slots: HashMap<String, usize>,
}

impl Palette {
    /// Colours for names in order of their first appearance.
    pub fn for_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let mut slots: HashMap<String, usize> = HashMap::new();
        for name in names {
            if name == BASELINE.0 || slots.contains_key(name) {
                continue;
            }
            let preferred = preferred_slot(name);
            let mut probes = (0..COLORS.len()).map(|step| (preferred + step) % COLORS.len());
            let free = probes.find(|slot| !slots.values().any(|taken| taken == slot));
            slots.insert(name.into(), free.unwrap_or(preferred));
        }
        Self { slots }
    }

    /// The colour of a name, known or not.
    pub(super) fn color(&self, name: &str) -> RGBColor {
        if name == BASELINE.0 { BASELINE.1 } else { COLORS[self.slot(name)] }
    }

    /// A number that selects the marker's shape.
    pub(super) fn slot(&self, name: &str) -> usize {
        self.slots.get(name).copied().unwrap_or_else(|| preferred_slot(name))
    }
}

/// FNV-1a: the same on every machine and in every release, unlike the standard hasher.
fn preferred_slot(name: &str) -> usize {
    let hash = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    (hash % COLORS.len() as u64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 12] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"];

    #[test]
    fn twelve_names_have_twelve_different_colours() {
        let palette = Palette::for_names(NAMES);
        let colors: std::collections::HashSet<_> = NAMES
            .iter()
            .map(|name| {
                let c = palette.color(name);
                (c.0, c.1, c.2)
            })
            .collect();
        assert_eq!(colors.len(), 12);
    }

    #[test]
    fn a_name_without_rivals_has_one_colour_everywhere() {
        let alone = Palette::for_names(["joint carve"]);
        let first = Palette::for_names(["joint carve", "lockstep", "min-max"]);
        assert_eq!(alone.color("joint carve"), first.color("joint carve"));
        assert_eq!(first.color("direct"), BASELINE.1);
    }
}
