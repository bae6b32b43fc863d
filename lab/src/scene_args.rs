//! Arguments of a scene, without a command line.

use app_core::setup::SceneArgs;
use app_core::sizes::SampleSize;
use render::Lighting;
use scene::{MissingTextures, SceneSpec, UpAxis};

/// A scene with all other arguments by default.
#[must_use]
pub fn scene_args(scene: SceneSpec) -> SceneArgs {
    SceneArgs {
        scene,
        missing_textures: MissingTextures::default(),
        clip: None,
        up: UpAxis::default(),
        lighting: Lighting::default(),
        lights: Vec::new(),
        environment: None,
        method: None,
        sampling: None,
        sample_size: SampleSize::default(),
        base: None,
        impostors: Default::default(),
        samples: None,
    }
}
