//! Samples of what lamps see, for light of a grid: images from rectangles, or a layered cube of the scene.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use depth_image::{Camera, CameraError, CubeGrid, CubeImages, Environment, Illumination, LampRig, PinholeCamera};
use glam::Vec2;
use gpu::{Frame, Turn};
use parking_lot::Mutex;
use reconstruction::{DepthQuads, ReconstructionError, ReconstructionMethod, Reconstructor, SampleSet, SetDescription};
use render::{
    DrawWork, GpuScene, GridVisibility, LampMapSource, LampMaps, LayerSelection, Lighting, RenderError, Renderer,
    Visibility,
};
use sampling::{SampleWork, Sampler, SamplingError, SamplingMethod};

/// Sides of lamps' images, and of the cube.
const SIDES_PX: std::ops::RangeInclusive<u32> = 64..=4096;
/// Moments of scenes whose images are kept.
const MOST_KEPT: usize = 2;
/// Rectangles whose samples a scene may have: each takes some hundred megabytes.
pub(crate) const MOST_LAMPS: usize = 8;

/// How the images of lamps are taken and drawn: `non_redundant:pixel 1024 hybrid_mesh:0.5`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LampSampling {
    /// How samples are taken, from the corners of a lamp or, in layers, from its middle.
    pub sampling: SamplingMethod,
    /// Width and height of images, and of shadow maps; the side of the cube.
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

/// What the lamps of a scene see at a moment.
pub(crate) enum LampImages {
    /// The quads of each rectangle's images; `None` for other lamps.
    Quads(Vec<Option<DepthQuads>>),
    /// A layered cube of the scene.
    Cube(Box<SampleSet>),
}

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
    by_cube: bool,
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
        let none = LampMaps { side_px: self.side_px, ..LampMaps::default() };
        let Some(drawn) = &self.images else { return none };
        match &*drawn.images {
            LampImages::Quads(_) => LampMaps { samples: Some(drawn), ..none },
            LampImages::Cube(set) => LampMaps { cube: set.cube_bricks(), ..none },
        }
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
        let quads = if let LampImages::Quads(quads) = &*self.images { quads[lamp].as_ref() } else { None };
        let quads =
            quads.ok_or_else(|| RenderError::LampMaps { reason: format!("lamp {lamp} has no sample images") })?;
        let recorded = self.reconstructor.record_depths(frame, quads, cameras, reversed_depths);
        recorded.map_err(|error| RenderError::LampMaps { reason: error.to_string() })
    }
}

/// A scene at a moment, and the device's place for it.
#[derive(Clone, Copy)]
pub(crate) struct LampScene<'s> {
    pub hash: &'s str,
    pub scene: &'s GpuScene,
    pub time_s: f32,
    pub turn: Turn,
}

impl<'s> LampScene<'s> {
    fn unlit(self) -> DrawWork<'s> {
        DrawWork {
            scene_time_s: self.time_s,
            visibility: Visibility::Triangles,
            turn: self.turn,
            ..DrawWork::new(self.scene, Lighting::UNLIT)
        }
    }

    /// Of samples that only say where surfaces are.
    fn description(self, dark: &Illumination) -> SetDescription<'_> {
        SetDescription {
            volume: self.scene.bounds_in_world,
            background: Environment::default(),
            illumination: dark,
            highlight: None,
            environment: None,
            mips: false,
        }
    }
}

/// What samples lamps, and cuts their samples into quads.
#[derive(Clone, Copy)]
pub(crate) struct LampPipelines<'e> {
    pub renderer: &'e Renderer,
    pub sampler: &'e Sampler,
    pub reconstructor: &'e Reconstructor,
}

/// Why lamps have no images.
pub(crate) enum LampError {
    NoRectangle,
    Rectangles { count: usize },
    Bounds(CameraError),
    Render(RenderError),
    Sampling(SamplingError),
    Reconstruction(ReconstructionError),
}

impl<'e> LampPipelines<'e> {
    fn sample(self, of: LampScene<'_>, moment: &Moment) -> Result<LampImages, LampError> {
        match moment.by_cube {
            true => self.sample_cube(of, moment.sampling.side_px).map(|cube| LampImages::Cube(cube.into())),
            false => self.sample_rectangles(of, moment.sampling).map(LampImages::Quads),
        }
    }

    fn sample_rectangles(
        self,
        of: LampScene<'_>,
        sampling: LampSampling,
    ) -> Result<Vec<Option<DepthQuads>>, LampError> {
        let rigs = of.scene.lamp_rigs(sampling.side_px);
        match rigs.iter().flatten().count() {
            0 => return Err(LampError::NoRectangle),
            count if count > MOST_LAMPS => return Err(LampError::Rectangles { count }),
            _ => {}
        }
        let images = rigs.iter().map(|rig| rig.as_ref().map(|rig| self.sample_lamp(rig, of, sampling)).transpose());
        images.collect()
    }

    /// Every surface of the scene, on lines along three axes.
    fn sample_cube(self, of: LampScene<'_>, side: u32) -> Result<SampleSet, LampError> {
        let grid = CubeGrid::around(&of.scene.bounds_in_world, side).map_err(LampError::Bounds)?;
        let drawn = grid.cameras().map(|camera| {
            let kept = LayerSelection::Dominant;
            self.renderer.draw_layers(of.unlit(), &camera, kept).map_err(LampError::Render)
        });
        let [x, y, z] = drawn;
        let cube = CubeImages { grid, images: [x?, y?, z?], light_field: None };
        let set = self.reconstructor.upload_cube(&cube, &of.description(&Illumination::default()), of.turn);
        set.map_err(LampError::Reconstruction)
    }

    fn sample_lamp(self, rig: &LampRig, of: LampScene<'_>, sampling: LampSampling) -> Result<DepthQuads, LampError> {
        // Layers lie behind each other as the middle sees them.
        let cameras = match sampling.sampling.own_image_count() {
            Some(layers) => vec![rig.camera(Vec2::splat(0.5)); layers as usize],
            None => rig.corners().to_vec(),
        };
        let cameras: Vec<Camera> = cameras.into_iter().map(Camera::Pinhole).collect();
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let draw = DrawWork { both_faces: true, ..of.unlit() };
        let corners = sampling.reconstruction.needs_corners();
        let work = SampleWork {
            draw,
            cameras: &cameras,
            tile_count: 1,
            wanted: &wanted,
            method: sampling.sampling,
            planes: render::SamplePlanes { normal: true, corners, ..Default::default() },
        };
        let images = self.sampler.sample(&work).map_err(LampError::Sampling)?;
        let set = self
            .reconstructor
            .upload(&images, &of.description(&Illumination::default()), of.turn)
            .map_err(LampError::Reconstruction)?;
        let quads = self.reconstructor.depth_quads(Arc::new(set), sampling.reconstruction, of.turn);
        quads.map_err(LampError::Reconstruction)
    }
}

impl LampSamples {
    /// The lamps for light of a scene at a moment, whose images are made where there are none yet.
    pub fn lamps<'e>(
        &self,
        pipelines: LampPipelines<'e>,
        of: LampScene<'_>,
        lighting: Lighting,
    ) -> Result<Lamps<'e>, LampError> {
        let sampling = *self.sampling.lock();
        let side_px = sampling.side_px;
        let by_cube = match lighting.grid_visibility() {
            GridVisibility::Rays | GridVisibility::Maps => return Ok(Lamps { side_px, images: None }),
            GridVisibility::Samples => false,
            GridVisibility::Cube => true,
        };
        let moment = Moment { scene_hash: of.hash.to_owned(), scene_time_s: of.time_s, sampling, by_cube };
        let images = match self.find(&moment) {
            Some(images) => images,
            None => self.made(pipelines, of, moment)?,
        };
        Ok(Lamps { side_px, images: Some(Drawn { reconstructor: pipelines.reconstructor, images }) })
    }

    /// Images that are made now, unless another thread has made them meanwhile.
    fn made(
        &self,
        pipelines: LampPipelines<'_>,
        of: LampScene<'_>,
        moment: Moment,
    ) -> Result<Arc<LampImages>, LampError> {
        let _one = self.making.lock();
        if let Some(images) = self.find(&moment) {
            return Ok(images);
        }
        let images = Arc::new(pipelines.sample(of, &moment)?);
        self.keep(moment, images.clone());
        Ok(images)
    }

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
        Self { sampling: SamplingMethod::OF_LAMPS, side_px: LampMaps::default().side_px, reconstruction }
    }
}

impl FromStr for LampSampling {
    type Err = UnknownLampSampling;

    fn from_str(text: &str) -> Result<Self, UnknownLampSampling> {
        let [sampling, side, reconstruction] = text.split_whitespace().collect::<Vec<_>>()[..] else {
            return Err(unknown(
                text,
                format!(
                    "expected a sampling method, a side and a reconstruction method, as in {:?}",
                    Self::default().to_string()
                ),
            ));
        };
        let sampling: SamplingMethod = sampling.parse().map_err(|error| unknown(text, format!("{error}")))?;
        if !sampling.may_hold_light() && sampling.layer_selection().is_some() {
            return Err(unknown(text, format!("{sampling} takes no depth images")));
        }
        let side_px = side.parse().ok().filter(|side| SIDES_PX.contains(side));
        let side_px = side_px.ok_or_else(|| unknown(text, format!("the side {side} is not from 64 to 4096")))?;
        let reconstruction: ReconstructionMethod =
            reconstruction.parse().map_err(|error| unknown(text, format!("{error}")))?;
        if !reconstruction.draws_quads() {
            return Err(unknown(text, format!("{reconstruction} draws no quads, of which shadow maps are made")));
        }
        Ok(Self { sampling, side_px, reconstruction })
    }
}

fn unknown(text: &str, reason: String) -> UnknownLampSampling {
    UnknownLampSampling { text: text.to_owned(), reason }
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
