//! Scenes by name, for the command line.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use crate::procedural::{self, tree_terrain};
use crate::{Limits, Scene, SceneError, load_file};

/// The names that are not files. Each `tree-terrain-…` may be followed by `-wind`. A file of such a name
/// is reached as `./name`.
pub const BUILT_IN_NAMES: [&str; 10] = [
    "tree-terrain-30k",
    "tree-terrain-125k",
    "tree-terrain-500k",
    "tree-terrain-2m",
    "quad",
    "unit-cube",
    "uv-sphere",
    "checker-sphere",
    "poles",
    "courtyard",
];

/// The seed of the named trees, so that all nodes and all runs grow the same one.
const TREE_SEED: u64 = 2007;

/// Where a scene comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SceneSpec {
    /// The paper's scene, by its number of triangles.
    TreeTerrain {
        /// Within 3 %.
        triangles: u32,
        /// Whether the tree sways.
        wind: bool,
    },
    /// One of the other [`BUILT_IN_NAMES`].
    BuiltIn(&'static str),
    /// A file to import.
    File(PathBuf),
}

impl SceneSpec {
    /// Makes or reads the scene, and lights it where its source does not.
    ///
    /// # Errors
    /// Those of [`load_file`].
    pub fn load(&self, limits: &Limits) -> Result<Scene, SceneError> {
        match self {
            Self::File(path) => Ok(load_file(path, limits)?.with_default_lights()),
            Self::TreeTerrain { triangles, wind } => Ok(named(self, grown(*triangles, *wind))),
            Self::BuiltIn(name) => Ok(named(self, procedural::by_name(name))),
        }
    }
}

fn grown(triangles: u32, wind: bool) -> Scene {
    let scene = tree_terrain(triangles, TREE_SEED);
    if wind { scene.with_wind() } else { scene }
}

fn named(spec: &SceneSpec, scene: Scene) -> Scene {
    Scene { name: spec.to_string(), ..scene }
}

impl FromStr for SceneSpec {
    type Err = std::convert::Infallible;

    /// Never fails: what is no name is a file.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (base, wind) = text.strip_suffix("-wind").map_or((text, false), |base| (base, true));
        if let Some(triangles) = tree_triangles(base) {
            return Ok(Self::TreeTerrain { triangles, wind });
        }
        let built_in = BUILT_IN_NAMES.into_iter().find(|name| *name == text);
        Ok(built_in.map_or_else(|| Self::File(text.into()), Self::BuiltIn))
    }
}

fn tree_triangles(base: &str) -> Option<u32> {
    match base.strip_prefix("tree-terrain-")? {
        "30k" => Some(30_000),
        "125k" => Some(125_000),
        "500k" => Some(500_000),
        "2m" => Some(2_000_000),
        _ => None,
    }
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
            Self::BuiltIn(name) => f.write_str(name),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> SceneSpec {
        text.parse().unwrap()
    }

    #[test]
    fn every_name_is_shown_as_it_is_parsed() {
        for name in BUILT_IN_NAMES {
            assert!(!matches!(parsed(name), SceneSpec::File(_)), "{name}");
            assert_eq!(parsed(name).to_string(), name);
        }
        assert_eq!(parsed("tree-terrain-2m-wind"), SceneSpec::TreeTerrain { triangles: 2_000_000, wind: true });
        assert_eq!(parsed("tree-terrain-2m-wind").to_string(), "tree-terrain-2m-wind");
    }

    #[test]
    fn all_else_is_a_file() {
        for text in ["quad.obj", "./quad", "quad-wind", "tree-terrain-7k", "models/a.glb", ""] {
            assert_eq!(parsed(text), SceneSpec::File(text.into()));
        }
    }

    #[test]
    fn the_small_ones_load_lit_and_valid() {
        let limits = Limits::default();
        for name in BUILT_IN_NAMES.iter().filter(|n| !n.starts_with("tree") || n.ends_with("30k")) {
            let scene = parsed(name).load(&limits).unwrap();
            scene.validate(&limits).unwrap();
            assert_eq!(scene.name, *name);
            assert!(!scene.bounds().is_empty());
        }
    }
}
