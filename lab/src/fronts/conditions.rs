//! Named subjects, from `lab/conditions.toml` or a file of the same form.

use std::path::Path;

use app_core::exit::BadInput;
use glam::UVec2;
use serde::Deserialize;

/// The subjects that come with the program.
const OWN: &str = include_str!("../../conditions.toml");
/// The most bytes of a file, and subjects in it.
const MAX_BYTES: u64 = 1 << 20;
const MAX_SUBJECTS: usize = 256;
/// Sides of a cell, over that of the scene's own sample cameras.
const CELL_SIDES: std::ops::RangeInclusive<f32> = 0.01..=10.0;

/// A scene, and the views that rows are measured on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// The name in the report.
    pub name: String,
    /// As for `--scene`.
    pub scene: String,
    /// The side of the view cell, over that of the scene's own sample cameras.
    #[serde(default = "one")]
    pub cell_ratio: f32,
    /// Columns and rows of a view.
    #[serde(default = "paper_size_px")]
    pub size_px: UVec2,
    /// As for `--lighting`.
    #[serde(default = "plain")]
    pub lighting: String,
    /// V: the views that share the cost of a sample set.
    #[serde(default = "paper_views")]
    pub views: usize,
    /// The seed of random views.
    #[serde(default)]
    pub seed: u64,
    /// Whether the quick form measures it.
    #[serde(default)]
    pub quick: bool,
}

fn one() -> f32 {
    1.0
}

fn paper_size_px() -> UVec2 {
    app_core::experiment::VIEW_SIZE_PX
}

fn plain() -> String {
    render::Lighting::default().to_string()
}

fn paper_views() -> usize {
    app_core::experiment::PAPER_VIEWS
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    subject: Vec<Conditions>,
}

/// The subjects of a file, or those that come with the program.
///
/// # Errors
/// The file cannot be read, or has a field that cannot be used; the text names both.
pub fn read(path: Option<&Path>) -> Result<Vec<Conditions>, BadInput> {
    let Some(path) = path else { return parsed(OWN, "conditions.toml") };
    let wrong = |error: String| BadInput(format!("{}: {error}", path.display()));
    let bytes = std::fs::metadata(path).map_err(|error| wrong(error.to_string()))?.len();
    if bytes > MAX_BYTES {
        return Err(wrong(format!("{bytes} bytes are over the limit of {MAX_BYTES}")));
    }
    let text = std::fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
    parsed(&text, &path.display().to_string())
}

/// The subjects whose names contain one of the texts, in any case.
///
/// # Errors
/// No subject's name contains any of the texts.
pub fn named(all: Vec<Conditions>, texts: &[String]) -> Result<Vec<Conditions>, BadInput> {
    let named: Vec<Conditions> = all.into_iter().filter(|subject| is_named(&subject.name, texts)).collect();
    if named.is_empty() { Err(none_is_named(texts)) } else { Ok(named) }
}

/// Whether a name contains one of the texts, in any case.
#[must_use]
pub fn is_named(name: &str, texts: &[String]) -> bool {
    let name = name.to_lowercase();
    texts.iter().any(|text| name.contains(&text.to_lowercase()))
}

#[must_use]
pub fn none_is_named(texts: &[String]) -> BadInput {
    BadInput(format!("no subject's name contains {texts:?}"))
}

fn parsed(text: &str, file: &str) -> Result<Vec<Conditions>, BadInput> {
    let File { subject } = toml::from_str(text).map_err(|error| BadInput(format!("{file}: {error}")))?;
    if !(1..=MAX_SUBJECTS).contains(&subject.len()) {
        return Err(BadInput(format!("{file}: {} subjects, expected 1 to {MAX_SUBJECTS}", subject.len())));
    }
    let wrong =
        |subject: &Conditions| subject.fault().map(|fault| format!("{file}: subject {:?}: {fault}", subject.name));
    match subject.iter().find_map(wrong) {
        Some(fault) => Err(BadInput(fault)),
        None => Ok(subject),
    }
}

impl Conditions {
    /// A scene with the defaults of all else.
    #[must_use]
    pub fn of_scene(scene: &str) -> Self {
        Self {
            name: scene.to_owned(),
            scene: scene.to_owned(),
            cell_ratio: one(),
            size_px: paper_size_px(),
            lighting: plain(),
            views: paper_views(),
            seed: 0,
            quick: false,
        }
    }

    fn fault(&self) -> Option<String> {
        if !CELL_SIDES.contains(&self.cell_ratio) {
            return Some(format!("cell_ratio is {}, must be from 0.01 to 10", self.cell_ratio));
        }
        if !(1..=1_000_000).contains(&self.views) {
            return Some(format!("views is {}, must be from 1 to 1000000", self.views));
        }
        let most = depth_image::MAX_IMAGE_SIDE_PX;
        let is_size = self.size_px.min_element() >= 16 && self.size_px.max_element() <= most;
        (!is_size).then(|| format!("size_px is {:?}, sides must be from 16 to {most}", self.size_px.to_array()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_own_subjects_are_enough() {
        let own = read(None).unwrap();
        assert!(own.len() >= 12 && own.iter().filter(|subject| subject.quick).count() == 4);
        assert!(own.iter().any(|subject| subject.scene.ends_with("-wind")));
        for subject in &own {
            fixtures::spec(&subject.scene).unwrap();
            subject.lighting.parse::<render::Lighting>().unwrap();
        }
    }

    #[test]
    fn a_wrong_field_is_named() {
        let of = |text: &str| parsed(text, "a.toml").map(|_| ()).unwrap_err().0;
        for (text, named) in [
            ("", "subject"),
            ("subject = []", "0 subjects"),
            ("[[subject]]\nname = \"a\"", "scene"),
            ("[[subject]]\nname = \"a\"\nscene = \"b\"\ncell_ratio = -1.0", "cell_ratio is -1"),
            ("[[subject]]\nname = \"a\"\nscene = \"b\"\ncell_ratio = nan", "cell_ratio is NaN"),
            ("[[subject]]\nname = \"a\"\nscene = \"b\"\nviews = 0", "views is 0"),
            ("[[subject]]\nname = \"a\"\nscene = \"b\"\nsize_px = [0, 4]", "size_px is [0, 4]"),
            ("[[subject]]\nname = \"a\"\nscene = \"b\"\ncolour = 1", "colour"),
        ] {
            assert!(of(text).contains(named), "{text}: {}", of(text));
        }
    }
}
