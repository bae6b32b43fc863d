//! Arguments of the demo.

use std::path::PathBuf;

use app_core::setup::{DeviceArgs, SceneArgs};
use clap::Args;
use clap::builder::ArgPredicate;
use render::Lighting;

/// The light in which sharing pays, unless the user names one.
const EXPENSIVE_LIGHT: &str = "soft 16, occlusion 16";
/// The light of the first page, unless the user names one.
const FIRST_PAGE_LIGHT: &str = "soft 16, indirect 64";

/// Shows what sharing samples gains. First a page: a room in indirect light whose light comes from four sample images,
/// beside direct drawing in the same time. Then 290 views of 200×150 of one scene, from four sample images by five nodes in
/// one process, beside views that are drawn directly; once in expensive light, once in plain light. Writes pictures,
/// tables and a chart to --out. Takes three minutes at most on two slow cores, and a minute with --quick.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myriorama demo\n  myriorama demo --showcase\n  myriorama demo --scene helmet.gltf --out out/helmet\n  myriorama demo --scene tree-terrain-30k --quick"
)]
pub struct DemoArgs {
    // The scene of the first page; `None` where the user names one. Its default is set before that of --scene, which counts as present.
    #[arg(long, hide = true, default_value = "gallery", default_value_if("scene", ArgPredicate::IsPresent, None))]
    first_page_scene: Option<String>,
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/demo", value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Makes only the first page, first-page.png in --out
    #[arg(long)]
    pub(super) showcase: bool,
    /// Makes 64 views in place of 290
    #[arg(long)]
    pub(super) quick: bool,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    pub(super) strict: bool,
}

impl DemoArgs {
    /// The light in which sharing pays.
    pub(super) fn expensive_light(&self) -> anyhow::Result<Lighting> {
        let is_named = self.scene.lighting != Lighting::default();
        if is_named { Ok(self.scene.lighting) } else { Ok(EXPENSIVE_LIGHT.parse()?) }
    }

    /// The scene and light of the first page.
    pub(super) fn first_page_scene(&self) -> anyhow::Result<SceneArgs> {
        let mut page_scene = self.scene.clone();
        if let Some(scene) = &self.first_page_scene {
            page_scene.scene = scene.parse()?;
        }
        if page_scene.lighting == Lighting::default() {
            page_scene.lighting = FIRST_PAGE_LIGHT.parse()?;
        }
        Ok(page_scene)
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        demo: DemoArgs,
    }

    fn first_page(arguments: &[&str]) -> String {
        let program = Program::try_parse_from([&["demo"], arguments].concat()).unwrap();
        program.demo.first_page_scene().unwrap().scene.to_string()
    }

    #[test]
    fn the_first_page_has_a_named_scene_even_if_it_is_the_default() {
        assert_eq!(first_page(&[]), "gallery");
        assert_eq!(first_page(&["--scene", "tree-terrain-500k"]), "tree-terrain-500k");
        assert_eq!(first_page(&["--scene=urban"]), "urban");
    }
}
