//! Scenes by name, for the command line.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::procedural::{self, GrassDensity, grass, tree_terrain};
use crate::{Fault, ImportOptions, Limits, Scene, SceneError, at_most, load_file};

/// Names of the built-in scenes. A `tree-terrain-…` may have the suffix `-wind`, and `grass` a `:` with a
/// [density](GrassDensity). A file of such a name is reached as `./name`.
pub const BUILT_IN_NAMES: [&str; 10] = [
    "tree-terrain-30k",
    "tree-terrain-125k",
    "tree-terrain-500k",
    "tree-terrain-2m",
    "courtyard",
    "gallery",
    "grass",
    "urban",
    "snake",
    "mirror-hall",
];

/// The built-in scenes without an argument.
const PROCEDURAL: [ProceduralScene; 5] = [
    ProceduralScene { name: "courtyard", make: procedural::courtyard },
    ProceduralScene { name: "gallery", make: procedural::gallery },
    ProceduralScene { name: "urban", make: procedural::urban },
    ProceduralScene { name: "snake", make: procedural::snake },
    ProceduralScene { name: "mirror-hall", make: procedural::mirror_hall },
];

/// A scene that a function makes.
#[derive(Debug, Clone, Copy)]
pub struct ProceduralScene {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// Makes the scene.
    pub make: fn() -> Scene,
}

impl PartialEq for ProceduralScene {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for ProceduralScene {}

/// The name before the density of a meadow.
const GRASS: &str = "grass";

/// Built-in scenes that are named where a scene is mistyped: at most so many, and with this likeness of Jaro and Winkler.
const MOST_NEAREST: usize = 3;
const LEAST_LIKENESS: f64 = 0.85;

/// The seed of the named trees, equal on all nodes and in all runs.
const TREE_SEED: u64 = 2007;

/// The origin of a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SceneSpec {
    /// The paper's scene, by its number of triangles.
    TreeTerrain {
        /// Number of triangles, met within 3 %.
        triangles: u32,
        /// The tree sways in wind.
        wind: bool,
    },
    /// The meadow of [`BUILT_IN_NAMES`].
    Grass {
        /// Density of the blades.
        density: GrassDensity,
    },
    /// One of the other [`BUILT_IN_NAMES`], or a scene of a test.
    Procedural(ProceduralScene),
    /// A file to import.
    File(PathBuf),
}

/// A text that names no scene: the density of its meadow is no number, or out of range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("grass: {0:?} is no density from {min} to {max}", min = GrassDensity::MIN, max = GrassDensity::MAX)]
pub struct SceneSpecError(String);

impl SceneSpec {
    /// Makes or reads the scene. A file without light gets default lights.
    ///
    /// # Errors
    /// The errors of [`load_file`], and a meadow over the limits.
    pub fn load(&self, limits: &Limits, options: impl Into<ImportOptions>) -> Result<Scene, SceneError> {
        let scene = match self {
            Self::File(path) if path.extension().is_none() && !path.exists() => return Err(no_such_scene(path)),
            Self::File(path) => return Ok(load_file(path, limits, options)?.with_default_lights()),
            Self::TreeTerrain { triangles, wind: false } => tree_terrain(*triangles, TREE_SEED),
            Self::TreeTerrain { triangles, wind: true } => tree_terrain(*triangles, TREE_SEED).with_wind(),
            Self::Grass { density } => {
                // Sizes are checked before memory is allocated.
                at_most("triangles", density.triangles(), limits.triangles)
                    .and_then(|()| at_most("vertices", density.vertices(), limits.vertices))
                    .map_err(|fault| fault.in_file(self.to_string()))?;
                grass(*density)
            }
            Self::Procedural(scene) => (scene.make)(),
        };
        Ok(Scene { name: self.to_string(), ..scene })
    }
}

/// A mistyped name of a built-in scene.
fn no_such_scene(path: &Path) -> SceneError {
    let text = path.display().to_string();
    let mut names = BUILT_IN_NAMES.map(|name| (strsim::jaro_winkler(&text, name), name)).to_vec();
    names.retain(|(likeness, _)| *likeness >= LEAST_LIKENESS);
    names.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let nearest: Vec<&str> = names.into_iter().take(MOST_NEAREST).map(|(_, name)| name).collect();
    let meant = if nearest.is_empty() { String::new() } else { format!("; did you mean {}?", nearest.join(" or ")) };
    Fault::malformed("scene", format!("no built-in scene and no file has this name{meant}")).in_file(text)
}

/// Any text of the command line: a path need not be UTF-8.
impl TryFrom<OsString> for SceneSpec {
    type Error = SceneSpecError;

    fn try_from(text: OsString) -> Result<Self, Self::Error> {
        match text.to_str() {
            Some(text) => text.parse(),
            None => Ok(Self::File(text.into())),
        }
    }
}

impl FromStr for SceneSpec {
    type Err = SceneSpecError;

    /// Parses a built-in name; any other text is a file. Fails on an invalid density.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (base, wind) = text.strip_suffix("-wind").map_or((text, false), |base| (base, true));
        if let Some(triangles) = tree_triangles(base) {
            return Ok(Self::TreeTerrain { triangles, wind });
        }
        if let Some(density) = grass_density(text)? {
            return Ok(Self::Grass { density });
        }
        let built_in = PROCEDURAL.into_iter().find(|scene| scene.name == text);
        Ok(built_in.map_or_else(|| Self::File(text.into()), Self::Procedural))
    }
}

/// Parses a meadow; `None` for other names.
fn grass_density(text: &str) -> Result<Option<GrassDensity>, SceneSpecError> {
    if text == GRASS {
        return Ok(Some(GrassDensity::ONE));
    }
    let Some(density) = text.strip_prefix(GRASS).and_then(|rest| rest.strip_prefix(':')) else { return Ok(None) };
    let number = density.parse().ok().and_then(GrassDensity::new);
    number.map(Some).ok_or_else(|| SceneSpecError(density.into()))
}

fn tree_triangles(base: &str) -> Option<u32> {
    let size = base.strip_prefix("tree-terrain-")?;
    let known = [("30k", 30_000), ("125k", 125_000), ("500k", 500_000), ("2m", 2_000_000)];
    known.into_iter().find(|(name, _)| *name == size).map(|(_, triangles)| triangles)
}

impl fmt::Display for SceneSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TreeTerrain { triangles, wind } => {
                let size = match triangles {
                    n if n.is_multiple_of(1_000_000) => format!("{}m", n / 1_000_000),
                    n => format!("{}k", n / 1000),
                };
                write!(f, "tree-terrain-{size}{}", if *wind { "-wind" } else { "" })
            }
            Self::Grass { density } if *density == GrassDensity::ONE => f.write_str(GRASS),
            Self::Grass { density } => write!(f, "{GRASS}:{density}"),
            Self::Procedural(scene) => f.write_str(scene.name),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MissingTextures;

    fn parsed(text: &str) -> SceneSpec {
        text.parse().unwrap()
    }

    #[test]
    fn a_mistyped_scene_is_answered_with_the_nearest_names() {
        let refused = |text: &str| {
            parsed(text).load(&Limits::default(), MissingTextures::default()).map(|_| ()).unwrap_err().to_string()
        };
        let text = refused("tree-terain-30k");
        assert!(text.contains("did you mean tree-terrain-30k"), "{text}");
        let text = refused("galery");
        assert!(text.ends_with("did you mean gallery?"), "{text}");
        assert!(!refused("zzz").contains("mean"), "nothing is near");
    }

    #[cfg(unix)]
    #[test]
    fn a_path_need_not_be_utf_8() {
        use std::os::unix::ffi::OsStringExt as _;
        let path = OsString::from_vec(b"models/\xff/a.glb".to_vec());
        assert_eq!(SceneSpec::try_from(path.clone()), Ok(SceneSpec::File(path.into())));
        assert_eq!(SceneSpec::try_from(OsString::from("urban")), Ok(parsed("urban")));
    }

    #[test]
    fn every_built_in_name_round_trips() {
        for name in BUILT_IN_NAMES {
            assert!(!matches!(parsed(name), SceneSpec::File(_)), "{name}");
            assert_eq!(parsed(name).to_string(), name);
        }
        assert_eq!(parsed("tree-terrain-2m-wind"), SceneSpec::TreeTerrain { triangles: 2_000_000, wind: true });
        assert_eq!(parsed("tree-terrain-2m-wind").to_string(), "tree-terrain-2m-wind");
    }

    #[test]
    fn any_other_name_is_a_file() {
        for text in [
            "urban.obj",
            "./urban",
            "urban-wind",
            "tree-terrain-7k",
            "models/a.glb",
            "",
            "grassy",
            "./grass:2",
            "grass.obj",
        ] {
            assert_eq!(parsed(text), SceneSpec::File(text.into()));
        }
    }

    #[test]
    fn a_meadow_has_a_density() {
        for (text, density, shown) in
            [("grass", 1.0, "grass"), ("grass:1.0", 1.0, "grass"), ("grass:16", 16.0, "grass:16")]
        {
            let density = GrassDensity::new(density).unwrap();
            assert_eq!(parsed(text), SceneSpec::Grass { density });
            assert_eq!(parsed(text).to_string(), shown);
        }
        assert_eq!(parsed(&parsed("grass:0.37").to_string()), parsed("grass:0.37"));
    }

    #[test]
    fn invalid_densities_are_refused() {
        let malformed = ["", "x", "1,5", " 2", "2x", "16:1"];
        let out_of_range = ["0", "-1", "nan", "inf", "-inf", "1e-9", "1001", "1e40"];
        for text in malformed.into_iter().chain(out_of_range) {
            assert_eq!(format!("grass:{text}").parse::<SceneSpec>(), Err(SceneSpecError(text.into())));
        }
    }

    /// The larger meadow would take gigabytes if it were made before the check.
    #[test]
    fn a_meadow_over_the_limits_is_refused_before_it_is_made() {
        let limits = Limits { triangles: 55_000, ..Limits::default() };
        for (text, limits) in [("grass:1000", &Limits::default()), ("grass", &limits)] {
            let error = parsed(text).load(limits, MissingTextures::Refuse).unwrap_err();
            assert!(matches!(error.kind, crate::SceneErrorKind::TooLarge { .. }), "{error}");
        }
    }

    #[test]
    fn built_in_scenes_load_lit_and_valid() {
        let limits = Limits::default();
        for name in BUILT_IN_NAMES.iter().filter(|n| !n.starts_with("tree-terrain") || n.ends_with("30k")) {
            let scene = parsed(name).load(&limits, MissingTextures::Refuse).unwrap();
            scene.validate(&limits).unwrap();
            assert_eq!(scene.name, *name);
            assert!(!scene.bounds().is_empty());
        }
    }
}
