//! `myriorama-lab scene`: a scene as a file.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::Outcome;
use clap::Args;
use scene::{Limits, MissingTextures, SceneSpec};

/// Writes a fixture or a built-in scene as a GLB file, which `myriorama up --scene FILE` shows the same way. Scenes that move
/// are refused.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama-lab scene bird-nest --out bird-nest.glb")]
pub struct SceneFileArgs {
    /// A fixture (quad, unit-cube, uv-sphere, checker-sphere, poles, blocks, bird-nest, tree, teapot-mirror, mirror-pair,
    /// mirror-box, teapot-floor, teapot-spheres, glass, hidden-block, maze:HEIGHT[:roofed] of heights 0.5, 1, 1.5, 2 and 3, car-park:N of
    /// 10, 40, 160 and 1200 cars, barrels:60), or a
    /// scene that the program takes
    #[arg(value_name = "NAME")]
    scene: SceneSpec,
    /// The file
    #[arg(long, value_name = "FILE.glb")]
    out: PathBuf,
}

/// Writes the file.
///
/// # Errors
/// The scene cannot be made or written.
pub fn run(args: &SceneFileArgs) -> anyhow::Result<Outcome> {
    let scene = args.scene.load(&Limits::default(), MissingTextures::Refuse).context("the scene cannot be used")?;
    fixtures::write_glb(&scene, &args.out)?;
    println!("{}: {} triangles of {}", args.out.display(), scene.triangle_count(), scene.name);
    Ok(Outcome::of(true))
}
