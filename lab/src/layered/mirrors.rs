//! Views of surfaces that reflect: their cameras, their time, and the errors of the pixels that show what is reflected.

use anyhow::Context as _;
use depth_image::{PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use metrics::{flip_map, psnr_db};
use reconstruction::{Mirrors, ReconstructRequest, ReconstructionMethod, SampleSet};
use render::Lighting;

use super::subject::Subject;
use super::views::seconds_a_view;

pub const SCENE: &str = "mirror-box";
/// As in the paper.
pub const VIEW_PX: UVec2 = UVec2::new(256, 256);
const VIEWS: usize = 5;

/// Views, and the seconds of one.
pub struct TimedViews {
    pub views: Vec<View>,
    pub view_s: f64,
}

/// Cameras before the box, from left to right.
pub fn cameras() -> Vec<PinholeCamera> {
    let cameras = (0..VIEWS).map(|number| {
        let right = number as f32 / (VIEWS - 1) as f32 * 2.0 - 1.0;
        let eye = Vec3::new(2.2 * right, 1.9, 6.0);
        PinholeCamera::looking_at(eye, Vec3::Y * 1.1, Vec3::Y, 0.7, VIEW_PX)
    });
    cameras.collect()
}

impl TimedViews {
    /// Views from a cube, by a method that shows what surfaces reflect.
    ///
    /// # Errors
    /// The device fails.
    pub fn of_cube(
        subject: &Subject<'_>,
        set: &SampleSet,
        method: ReconstructionMethod,
        mirrors: Mirrors<'_>,
    ) -> anyhow::Result<Self> {
        let reconstructor = subject.stand.reconstructor();
        let request = ReconstructRequest::new(set, &subject.views, method);
        Self::timed(|| Ok(reconstructor.reconstruct(ReconstructRequest { common: mirrors.into(), ..request })?))
    }

    /// Views that are drawn directly in a light.
    ///
    /// # Errors
    /// The device fails.
    pub fn drawn(subject: &Subject<'_>, lighting: Lighting) -> anyhow::Result<Self> {
        Self::timed(|| subject.stand.views(&subject.on_device, lighting, &subject.views, ViewPlanes::COLOR))
    }

    fn timed(make: impl Fn() -> anyhow::Result<Vec<View>>) -> anyhow::Result<Self> {
        let view_s = seconds_a_view(&make)?;
        Ok(Self { views: make()?, view_s })
    }
}

/// The view of several that pictures show.
///
/// # Errors
/// There is none.
pub fn middle(views: &[View]) -> anyhow::Result<&View> {
    views.get(views.len() / 2).context("a view")
}

/// Mean PSNR and FLIP over the marked pixels.
///
/// # Errors
/// Views differ in size, or no pixel is marked.
pub fn errors(truths: &[View], views: &[View], pixels: &[Vec<bool>]) -> anyhow::Result<[f64; 2]> {
    let mut sums = [0.0; 2];
    for ((truth, view), pixels) in truths.iter().zip(views).zip(pixels) {
        sums[0] += psnr_db(truth, view, Some(pixels))?.context("pixels that reflect")?;
        sums[1] += flip_map(truth, view)?.mean(Some(pixels))?.context("pixels that reflect")?;
    }
    Ok(sums.map(|sum| sum / truths.len() as f64))
}
