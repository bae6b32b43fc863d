//! The frames of a path on a device.

use depth_image::{DepthImage, PinholeCamera, SampleImage, View, ViewPlanes};
use node::{DirectWork, Engine, SampleWork, SharedSet, Turn, UploadedSet, ViewWork, WorkClass};
use probe::{Light, Representation, Subject};
use rayon::prelude::*;

use super::figures::{Compared, Figures};
use super::paths::{Path, SetOfPath};

/// The device, and a scene that it has loaded.
pub struct Stand<'a> {
    pub engine: &'a dyn Engine,
    pub subject: &'a Subject,
}

/// A path, and how its frames compare with the truth.
pub struct Measured {
    pub path: Path,
    /// The figures of the frames from the second on.
    pub figures: Vec<Figures>,
}

impl Stand<'_> {
    const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };

    /// Makes and compares all frames.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(&self, path: Path) -> anyhow::Result<Measured> {
        let mut views = Vec::new();
        let mut truths = Vec::new();
        for (place, set) in path.sets.iter().enumerate() {
            // Frames of a set follow one another.
            let frames = path.frames.iter().filter(|frame| frame.set == place);
            let cameras: Vec<PinholeCamera> = frames.map(|frame| frame.camera).collect();
            let uploaded = self.upload(&self.sample(set)?)?;
            views.extend(self.views(uploaded.as_ref(), &set.representation, cameras.clone())?);
            truths.extend(self.truths(cameras, set.time_s)?);
        }
        let compared: Vec<Compared<'_>> =
            truths.iter().zip(&views).map(|(truth, view)| Compared { truth, view }).collect();
        let figures = compared.par_windows(2).map(|pair| Figures::new(pair[0], pair[1])).collect::<Result<_, _>>()?;
        Ok(Measured { path, figures })
    }

    /// The images of a set.
    pub fn sample(&self, set: &SetOfPath) -> anyhow::Result<Vec<DepthImage>> {
        let finished = self.subject.sample_work(self.engine, &set.representation, Light::Session)?;
        let work = SampleWork { scene_time_s: set.time_s, refinement: set.refinement, ..finished };
        Ok(SampleImage::depth_images(self.engine.sample(&work, Self::TURN)?)?)
    }

    pub fn upload(&self, images: &[DepthImage]) -> anyhow::Result<SharedSet> {
        Ok(self.engine.upload(&self.subject.sample_set(images, Light::Session), Self::TURN)?)
    }

    pub fn views(
        &self,
        set: &dyn UploadedSet,
        of: &Representation,
        cameras: Vec<PinholeCamera>,
    ) -> anyhow::Result<Vec<View>> {
        let work = ViewWork { cameras, method: of.method.clone(), planes: self.subject.planes };
        Ok(self.engine.reconstruct(set, &work, Self::TURN)?)
    }

    fn truths(&self, cameras: Vec<PinholeCamera>, scene_time_s: f32) -> anyhow::Result<Vec<View>> {
        let planes = ViewPlanes { inverse_depth: true, ..self.subject.planes };
        let work = DirectWork { scene_time_s, ..self.subject.direct_work(cameras, Light::Session, planes) };
        Ok(self.engine.draw_direct(&work, Self::TURN)?)
    }
}
