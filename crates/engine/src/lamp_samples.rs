//! Sample images of what rectangle lights see, for light of a grid by samples.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use depth_image::{Camera, Environment, Illumination, LampRig, PinholeCamera};
use glam::Vec2;
use gpu::{Frame, Turn};
use node::EngineError;
use parking_lot::Mutex;
use reconstruction::{DepthQuads, ReconstructionMethod, Reconstructor, SetDescription};
use render::{DrawWork, GpuScene, GridAnswer, LampMapSource, LampMaps, Lighting, RenderError, Visibility};
use sampling::{SampleWork, SamplingMethod};

use crate::{Caught, GpuEngine, draw_work, invalid};

/// Sides of lamps' images.
const SIDES_PX: std::ops::RangeInclusive<u32> = 64..=4096;
/// Moments of scenes whose images are kept: each takes some hundred megabytes a lamp.
const MOST_KEPT: usize = 2;

/// How the images of lamps are taken and drawn: `non_redundant:pixel 1024 hybrid_mesh:0.5`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LampSampling {
    /// How samples are taken, from the corners of a lamp or, in layers, from its middle.
    pub sampling: SamplingMethod,
    /// Width and height of images, and of shadow maps.
    pub side_px: u32,
    /// How quads are cut from samples.
    pub reconstruction: ReconstructionMethod,
}

/// A text that says no such thing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("lamp samples {text:?}: {reason}")]
pub struct UnknownLampSampling {
    text: String,
    reason: String,
}

/// The images of all lamps of a scene at a moment; `None` for lamps that are no rectangles.
pub(crate) struct LampImages(Vec<Option<DepthQuads>>);

/// The images that were used last, at the end.
#[derive(Default)]
pub(crate) struct LampSamples {
    pub sampling: Mutex<LampSampling>,
    kept: Mutex<VecDeque<(Moment, Arc<LampImages>)>>,
    /// Images are made by one at a time.
    making: Mutex<()>,
}

#[derive(Debug, Clone, PartialEq)]
struct Moment {
    scene_hash: String,
    scene_time_s: f32,
    sampling: LampSampling,
}

/// The lamps of some work: their images are in use until it is done.
pub(crate) struct Lamps<'e> {
    side_px: u32,
    images: Option<Drawn<'e>>,
}

struct Drawn<'e> {
    reconstructor: &'e Reconstructor,
    images: Arc<LampImages>,
}

impl Lamps<'_> {
    pub fn maps(&self) -> LampMaps<'_> {
        let samples = self.images.as_ref().map(|images| images as &dyn LampMapSource);
        LampMaps { side_px: self.side_px, samples }
    }
}

impl LampMapSource for Drawn<'_> {
    fn record(
        &self,
        frame: &mut Frame<'_>,
        lamp: usize,
        cameras: &[PinholeCamera],
        reversed_depths: &[wgpu::TextureView],
    ) -> Result<(), RenderError> {
        let Some(quads) = &self.images.0[lamp] else { return Ok(()) };
        let recorded = self.reconstructor.record_depths(frame, quads, cameras, reversed_depths);
        recorded.map_err(|error| RenderError::LampMaps { reason: error.to_string() })
    }
}

impl GpuEngine {
    /// The lamps for light of a scene at a moment, whose images are made where there are none yet.
    pub(crate) fn lamps(
        &self,
        scene_hash: &str,
        scene: &GpuScene,
        lighting: Lighting,
        scene_time_s: f32,
        turn: Turn,
    ) -> Result<Lamps<'_>, EngineError> {
        let sampling = *self.lamp_samples.sampling.lock();
        let side_px = sampling.side_px;
        if lighting.grid_maps() != Some(GridAnswer::Samples) {
            return Ok(Lamps { side_px, images: None });
        }
        let moment = Moment { scene_hash: scene_hash.to_owned(), scene_time_s, sampling };
        let _one = self.lamp_samples.making.lock();
        let kept = self.lamp_samples.find(&moment);
        let images = match kept {
            Some(images) => images,
            None => {
                let images = Arc::new(self.sample_lamps(scene, &moment, turn)?);
                self.lamp_samples.keep(moment, images.clone());
                images
            }
        };
        Ok(Lamps { side_px, images: Some(Drawn { reconstructor: &self.reconstructor, images }) })
    }

    fn sample_lamps(&self, scene: &GpuScene, moment: &Moment, turn: Turn) -> Result<LampImages, EngineError> {
        let rigs = scene.lamp_rigs(moment.sampling.side_px);
        if rigs.iter().all(Option::is_none) {
            let reason = "soft NxN by samples needs a rectangle light that shines on the scene, and there is none";
            return Err(invalid("lighting", reason));
        }
        let images = rigs.iter().map(|rig| {
            let rig = rig.as_ref();
            rig.map(|rig| self.sample_lamp(scene, rig, moment, turn)).transpose()
        });
        Ok(LampImages(images.collect::<Result<_, _>>()?))
    }

    fn sample_lamp(
        &self,
        scene: &GpuScene,
        rig: &LampRig,
        moment: &Moment,
        turn: Turn,
    ) -> Result<DepthQuads, EngineError> {
        let LampSampling { sampling, reconstruction, .. } = moment.sampling;
        // Layers lie behind each other as the middle sees them.
        let cameras = match sampling.own_image_count() {
            Some(layers) => vec![rig.camera(Vec2::splat(0.5)); layers as usize],
            None => rig.corners().to_vec(),
        };
        let cameras: Vec<Camera> = cameras.into_iter().map(Camera::Pinhole).collect();
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let unlit = draw_work(scene, Lighting::UNLIT, moment.scene_time_s, None, turn);
        let work = SampleWork {
            draw: DrawWork { visibility: Visibility::Triangles, both_faces: true, ..unlit },
            cameras: &cameras,
            tile_count: 1,
            wanted: &wanted,
            method: sampling,
            planes: render::SamplePlanes {
                normal: true,
                corners: reconstruction.needs_corners(),
                ..Default::default()
            },
        };
        let images = self.catching(|| self.sampler.sample(&work))?;
        let description = SetDescription {
            volume: scene.bounds_in_world,
            background: Environment::default(),
            illumination: &Illumination::default(),
            highlight: None,
            environment: None,
            mips: false,
        };
        let quads = || {
            let set = self.reconstructor.upload(&images, &description, turn)?;
            self.reconstructor.depth_quads(Arc::new(set), reconstruction, turn)
        };
        self.catching(|| quads().map_err(Caught::from))
    }
}

impl LampSamples {
    fn find(&self, moment: &Moment) -> Option<Arc<LampImages>> {
        let mut kept = self.kept.lock();
        let at = kept.iter().position(|(of, _)| of == moment)?;
        let found = kept.remove(at)?;
        kept.push_back(found.clone());
        Some(found.1)
    }

    fn keep(&self, moment: Moment, images: Arc<LampImages>) {
        let mut kept = self.kept.lock();
        if kept.len() >= MOST_KEPT {
            kept.pop_front();
        }
        kept.push_back((moment, images));
    }
}

impl Default for LampSampling {
    fn default() -> Self {
        let reconstruction = ReconstructionMethod::lamp_default();
        Self { sampling: SamplingMethod::OF_LAMPS, side_px: 1024, reconstruction }
    }
}

impl FromStr for LampSampling {
    type Err = UnknownLampSampling;

    fn from_str(text: &str) -> Result<Self, UnknownLampSampling> {
        let unknown = |reason: String| UnknownLampSampling { text: text.to_owned(), reason };
        let [sampling, side, reconstruction] = text.split_whitespace().collect::<Vec<_>>()[..] else {
            return Err(unknown(format!(
                "expected a sampling method, a side and a reconstruction method, as in {:?}",
                Self::default().to_string()
            )));
        };
        let sampling: SamplingMethod = sampling.parse().map_err(|error| unknown(format!("{error}")))?;
        if !sampling.may_hold_light() && sampling.layer_selection().is_some() {
            return Err(unknown(format!("{sampling} takes no depth images")));
        }
        let side_px = side.parse().ok().filter(|side| SIDES_PX.contains(side));
        let side_px = side_px.ok_or_else(|| unknown(format!("the side {side} is not from 64 to 4096")))?;
        let reconstruction: ReconstructionMethod =
            reconstruction.parse().map_err(|error| unknown(format!("{error}")))?;
        if !reconstruction.draws_quads() {
            return Err(unknown(format!("{reconstruction} draws no quads; mesh and hybrid_mesh do")));
        }
        Ok(Self { sampling, side_px, reconstruction })
    }
}

impl fmt::Display for LampSampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.sampling, self.side_px, self.reconstruction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamp_samples_are_named_by_sampling_side_and_reconstruction() {
        let default = LampSampling::default();
        assert_eq!(default.to_string(), "non_redundant:pixel 1024 hybrid_mesh:0.5");
        for text in
            ["non_redundant:pixel 1024 hybrid_mesh:0.5", "depth_peeling:4 64 mesh", "conventional 4096 hybrid_mesh"]
        {
            assert_eq!(text.parse::<LampSampling>().expect(text).to_string(), text);
        }
        for text in [
            "",
            "conventional",
            "conventional 1024",
            "conventional 63 mesh",
            "conventional 4097 mesh",
            "conventional -1 mesh",
            "guess 1024 mesh",
            "conventional 1024 joint_carve",
            "conventional 1024 light_cache",
            "layered_cube:512 1024 mesh",
            "conventional 1024 mesh mesh",
        ] {
            assert!(text.parse::<LampSampling>().is_err(), "{text}");
        }
    }
}
