//! Min-max pyramids of all cameras, traversed together; the cameras' colours are blended.

pub(crate) mod march;
pub(crate) mod smooth;

use gpu::{DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use self::march::{MARCHES, March};
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, surface};

pub(super) const MAX_STOP_LEVEL: u32 = 8;
/// Moves of a ray after its marches.
pub(crate) const MAX_MOVES: u32 = 96;
/// Moves after which a ray of a view meets no surface any more, in a set without holes: it wanders behind all that cameras see,
/// and a surface that it met would more likely be wrong than right (docs/methods/joint_carve.md). Its way may still be proven
/// free to its end.
pub(crate) const MAX_MOVES_TO_HIT: u32 = 24;
/// A ray that leaves no node moves by this share of its way in the volume.
pub(crate) const BLIND_MOVE: f32 = 0.01;
/// The least move into the unknown, as a factor.
pub(crate) const LEAST_MOVE: f32 = 1.00001;

/// The switches of `joint_carve.wgsl`.
#[derive(Debug)]
pub(crate) struct Carve {
    pub set: SetVariant,
    /// The pyramid level at which the search ends; 0 is exact.
    pub stop_level: u32,
    /// Mirrored rays are carved, from where they begin.
    pub bounced: bool,
}

impl ShaderVariant for Carve {
    const TEMPLATE: &'static str = "joint_carve.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { stop_level => self.stop_level, bounced => self.bounced, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let kinds = [(0, false), (1, false), (MAX_STOP_LEVEL, false), (0, true)];
        let sets = SetVariant::all().into_iter();
        sets.flat_map(|set| kinds.map(|(stop_level, bounced)| Self { set, stop_level, bounced })).collect()
    }
}

/// Marches in the nearest cameras, one after another; what they leave is carved by all together. Gives the pixels that
/// stay unknown.
pub(super) fn record(
    recording: &mut Recording<'_>,
    stop_level: u32,
    listed: Option<&PixelList>,
) -> Result<PixelList, ReconstructionError> {
    let set = recording.set.variant();
    let mut undecided: Option<PixelList> = None;
    for camera in 0..MARCHES.min(recording.set.cameras.len()) {
        let listed = undecided.as_ref().or(listed);
        let march = March { set, camera, listed: listed.is_some() };
        undecided = Some(surface::record(recording, &march, listed, &[])?);
    }
    surface::record(recording, &Carve { set, stop_level, bounced: false }, undecided.as_ref(), &[])
}
