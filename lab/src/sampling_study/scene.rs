//! Measurements of one scene.

use app_core::progress::bar;
use glam::UVec2;
use report::Report;
use sampling::SamplingMethod;

use super::availability::Availability;
use super::counts::{ImageCount, image_counts, mark_useful};
use super::extent::Extent;
use super::held::ImageSurfaces;
use super::methods::METHODS;
use super::pictures;
use super::subject::{Subject, WITH_IDS};
use super::visibility::{VisibilityEstimates, seen};

/// The side of output frames, as in the paper.
const FRAME_PX: UVec2 = UVec2::splat(512);

/// Measurements of one scene, by method.
pub struct SceneRow {
    pub(super) name: String,
    pub(super) counts: Vec<Vec<ImageCount>>,
    pub(super) seen: Vec<Vec<VisibilityEstimates>>,
    pub(super) available: Vec<Availability>,
}

impl SceneRow {
    /// Measures a scene, and adds its false colours.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(subject: &Subject, extent: Extent, report: &mut Report) -> anyhow::Result<Self> {
        let size_px = UVec2::splat(extent.side_px);
        let sets =
            METHODS.iter().map(|&method| subject.sample(method, size_px, WITH_IDS)).collect::<Result<Vec<_>, _>>()?;
        let mut counts = image_counts(&sets);
        let held: Vec<Vec<ImageSurfaces<'_>>> =
            sets.iter().map(|set| set.iter().filter_map(ImageSurfaces::of).collect()).collect();
        let mut available = vec![Availability::default(); METHODS.len()];
        let views = subject.between(extent.views, FRAME_PX);
        let progress = bar(format!("{}: frames", subject.name), views.len());
        subject.each_frame(&views, |frames| {
            for frame in frames {
                if let Some(frame) = ImageSurfaces::of(frame) {
                    mark_useful(&mut counts, &frame);
                }
                available.iter_mut().zip(&held).for_each(|(available, set)| available.add(frame, set));
            }
            progress.inc(frames.len() as u64);
            Ok(())
        })?;
        progress.finish_and_clear();
        let rays = render::scalar::rays::Scene::of(&subject.scene, 0.0)?;
        let viewpoints = subject.cameras(SamplingMethod::CONVENTIONAL, size_px);
        let seen = METHODS
            .iter()
            .zip(&sets)
            .map(|(&method, set)| seen(&rays, method, set, &viewpoints, &views, extent.seeds))
            .collect();
        report.pictures.push(pictures::false_colors(&subject.name, &sets, &counts));
        Ok(Self { name: subject.name.clone(), counts, seen, available })
    }
}
