//! The frames of a path on a device.

use cluster::Workload;
use depth_image::{PinholeCamera, View, ViewPlanes};
use node::{DirectWork, Engine, SampleSet, SampleWork, SharedSet, Turn, UploadedSet, ViewWork, WorkClass};
use rayon::prelude::*;

use super::figures::{Compared, Figures};
use super::paths::{Path, SetOfPath};
use super::subject::{Representation, Subject};

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
            let uploaded = self.upload(set)?;
            views.extend(self.views(uploaded.as_ref(), &set.representation, cameras.clone())?);
            truths.extend(self.truths(set, cameras)?);
        }
        let compared: Vec<Compared<'_>> =
            truths.iter().zip(&views).map(|(truth, view)| Compared { truth, view }).collect();
        let figures = compared.par_windows(2).map(|pair| Figures::new(pair[0], pair[1])).collect::<Result<_, _>>()?;
        Ok(Measured { path, figures })
    }

    /// A set on the device.
    pub fn upload(&self, set: &SetOfPath) -> anyhow::Result<SharedSet> {
        let workload = self.subject.workload(&set.representation);
        let planes = self.engine.sample_planes(&set.representation.method.to_string())?;
        let workload = Workload { planes, ..workload };
        let work = SampleWork { scene_time_s: set.time_s, refinement: set.refinement, ..SampleWork::of(&workload) };
        let images = self.engine.sample(&work, Self::TURN)?;
        Ok(self.engine.upload(&SampleSet::of(&workload, images, false)?, Self::TURN)?)
    }

    pub fn views(
        &self,
        set: &dyn UploadedSet,
        of: &Representation,
        cameras: Vec<PinholeCamera>,
    ) -> anyhow::Result<Vec<View>> {
        let work = ViewWork { cameras, method: of.method.to_string(), planes: ViewPlanes::COLOR };
        Ok(self.engine.reconstruct(set, &work, Self::TURN)?)
    }

    fn truths(&self, set: &SetOfPath, cameras: Vec<PinholeCamera>) -> anyhow::Result<Vec<View>> {
        let workload = self.subject.workload(&set.representation);
        let work = DirectWork::of(&workload, cameras, ViewPlanes::WITH_DEPTH);
        Ok(self.engine.draw_direct(&DirectWork { scene_time_s: set.time_s, ..work }, Self::TURN)?)
    }
}
