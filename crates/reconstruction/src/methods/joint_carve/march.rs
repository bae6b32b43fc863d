//! Marches in the image of one sample camera, then asks all cameras about the point found.

use gpu::{DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use crate::view_work::{ONE_VIEW, SetVariant};

/// The marches that come before the carve, in the nearest cameras.
pub(crate) const MARCHES: usize = 2;
/// The coarsest level that a pixel's own search uses; its tile has done the rest.
pub(crate) const START_LEVEL: u32 = 3;
/// Moves from node to node.
pub(crate) const MAX_COARSE_MOVES: u32 = 64;
/// Moves from cell to cell.
pub(crate) const MAX_FINE_MOVES: u32 = 12;
/// Rays move this far past the edge of a node.
pub(crate) const NUDGE_PX: f32 = 1e-3;
/// A march ends at this share of its first depth before the plane through the camera's eye.
pub(crate) const EYE_SHARE: f32 = 0.01;

/// The switches of `march.wgsl`.
#[derive(Debug)]
pub(crate) struct March {
    pub set: SetVariant,
    /// The camera among a view's, nearest first.
    pub camera: usize,
    /// Only listed pixels are marched.
    pub listed: bool,
}

impl ShaderVariant for March {
    const TEMPLATE: &'static str = "joint_carve/march.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { march_camera => self.camera, listed => self.listed, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for set in SetVariant::all() {
            all.extend((1..set.cameras.min(MARCHES)).map(|camera| Self { set, camera, listed: true }));
            all.extend([false, true].map(|listed| Self { set, camera: 0, listed }));
        }
        all
    }
}
