//! Views of a scene with mirrors: by images of their surroundings, and drawn directly.

use std::time::Instant;

use anyhow::Context as _;
use depth_image::{Aabb, DepthImage, Highlight, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::{UVec2, Vec3};
use metrics::{Rgb8Image, flip_map, psnr_db};
use reconstruction::{MirrorCell, Mirrors, SampleSet, SetDescription};
use render::{GpuScene, Lighting, SamplePlanes};
use scene::Scene;

use super::candidates::Candidate;
use crate::failures::stage::CARVE;
use crate::failures::stand::Stand;
use crate::statistics::median;

const VIEW_PX: UVec2 = UVec2::new(200, 150);
/// Times that a view is made; the median counts.
const REPEATS: usize = 5;
/// A mirror shows the scene where it differs from the environment by more than this, in codes.
const SEEN_CODES: u8 = 8;
const PLANES: SamplePlanes = SamplePlanes {
    antialias: depth_image::Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: true,
    corners: false,
};

/// A view, its own sample set, and the truth. The set's one image is the view's, so that errors are those of the mirror.
struct Subject {
    camera: PinholeCamera,
    set: SampleSet,
    truth: View,
    /// Pixels in which a mirror shows the scene.
    mirrored: Vec<bool>,
}

/// A scene on the device with its views.
pub struct Hall<'s> {
    stand: &'s Stand,
    scene: &'s Scene,
    on_device: GpuScene,
    lighting: Lighting,
    subjects: Vec<Subject>,
}

/// What a candidate costs and how well it answers.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub images: usize,
    pub texels: usize,
    pub sample_s: f64,
    pub flip: f64,
    pub psnr_db: f64,
    pub guessed_ratio: f64,
    /// A view with mirrors, and without.
    pub view_s: [f64; 2],
}

impl<'s> Hall<'s> {
    /// Draws the truth of `views` views on a circle around a scene. Views in which no mirror shows the scene are left out.
    ///
    /// # Errors
    /// The device fails, or no view shows a mirror.
    pub fn new(stand: &'s Stand, scene: &'s Scene, lighting: Lighting, views: usize) -> anyhow::Result<Self> {
        let on_device = stand.upload(scene)?;
        let mut hall = Self { stand, scene, on_device, lighting, subjects: Vec::new() };
        for camera in around(&scene.bounds(), views) {
            hall.subjects.extend(hall.subject(camera)?);
        }
        anyhow::ensure!(!hall.subjects.is_empty(), "no view shows the scene in a mirror");
        Ok(hall)
    }

    /// `None` where no mirror shows the scene.
    fn subject(&self, camera: PinholeCamera) -> anyhow::Result<Option<Subject>> {
        let unmirrored = self.lighting.without_reflections().unwrap_or(self.lighting);
        let draw = |lighting| -> anyhow::Result<View> {
            let views = self.stand.views(&self.on_device, lighting, &[camera], ViewPlanes::WITH_DEPTH)?;
            views.into_iter().next().context("a view")
        };
        let (truth, plain) = (draw(self.lighting)?, draw(unmirrored)?);
        let pixels = truth.srgb8.chunks_exact(3).zip(plain.srgb8.chunks_exact(3));
        let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > SEEN_CODES);
        let mirrored: Vec<bool> = pixels.map(differs).collect();
        let set = self.set(&self.images(&[camera])?)?;
        Ok(mirrored.contains(&true).then_some(Subject { camera, set, truth, mirrored }))
    }

    fn images(&self, cameras: &[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>> {
        let lighting = self.lighting.without_reflections().unwrap_or(self.lighting);
        self.stand.images(&self.on_device, lighting, cameras, PLANES)
    }

    fn set(&self, images: &[DepthImage]) -> anyhow::Result<SampleSet> {
        let description = SetDescription {
            volume: self.scene.bounds(),
            background: self.scene.background,
            illumination: &self.scene.illumination,
            highlight: Some(Highlight::Ggx),
            environment: None,
        };
        Ok(self.stand.reconstructor().upload(images, &description)?)
    }

    /// The figures of a candidate for each mirror of the scene; without candidates, of mirrors that show the environment.
    ///
    /// # Errors
    /// The device fails.
    pub fn figures(&self, mirrors: &[Aabb], candidates: &[Candidate]) -> anyhow::Result<Figures> {
        let cameras: Vec<&[PinholeCamera]> = candidates.iter().map(|candidate| &candidate.cameras[..]).collect();
        let start = Instant::now();
        let images = cameras.iter().map(|cameras| self.images(cameras)).collect::<anyhow::Result<Vec<_>>>()?;
        let sample_s = start.elapsed().as_secs_f64();
        let sets = images.iter().map(|images| self.set(images)).collect::<anyhow::Result<Vec<_>>>()?;
        let cell = |(bounds, surroundings)| MirrorCell { bounds, surroundings };
        let cells: Vec<MirrorCell<'_>> = mirrors.iter().copied().zip(&sets).map(cell).collect();
        let mirrors = Mirrors { cells: &cells, reflections: self.lighting.reflections() };
        let mut answers = Vec::with_capacity(self.subjects.len());
        for subject in &self.subjects {
            answers.push(self.answer(subject, mirrors)?);
        }
        let mean = |of: fn(&Answer) -> f64| answers.iter().map(of).sum::<f64>() / answers.len() as f64;
        let count = |of: fn(&DepthImage) -> usize| images.iter().flatten().map(of).sum();
        Ok(Figures {
            images: count(|_| 1),
            texels: count(|image| image.color_rgb9e5.len()),
            sample_s,
            flip: mean(|answer| answer.flip),
            psnr_db: mean(|answer| answer.psnr_db),
            guessed_ratio: mean(|answer| answer.guessed_ratio),
            view_s: [0, 1].map(|with| median(answers.iter().map(|answer| answer.view_s[with]).collect())),
        })
    }

    fn answer(&self, subject: &Subject, mirrors: Mirrors<'_>) -> anyhow::Result<Answer> {
        let (view, with_s) = self.timed(subject, mirrors)?;
        let (_, without_s) = self.timed(subject, Mirrors::default())?;
        let [truth, picture] = [Rgb8Image::of_view(&subject.truth)?, Rgb8Image::of_view(&view)?];
        let mask = Some(&subject.mirrored[..]);
        let kinds = view.provenance.as_ref().context("provenance")?.iter().map(|provenance| provenance.kind());
        let guessed =
            kinds.zip(&subject.mirrored).filter(|(kind, is)| **is && *kind == ProvenanceKind::Guessed).count();
        let pixels = subject.mirrored.iter().filter(|is| **is).count();
        Ok(Answer {
            flip: flip_map(&truth, &picture)?.mean(mask)?.context("mirrored pixels")?,
            psnr_db: psnr_db(&truth, &picture, mask)?.context("mirrored pixels")?,
            guessed_ratio: guessed as f64 / pixels as f64,
            view_s: [with_s, without_s],
        })
    }

    /// A view, and the median time of several.
    fn timed(&self, subject: &Subject, mirrors: Mirrors<'_>) -> anyhow::Result<(View, f64)> {
        let make = || -> anyhow::Result<(View, f64)> {
            let start = Instant::now();
            let (set, cameras, planes) = (&subject.set, [subject.camera], ViewPlanes::ALL);
            let views = self.stand.reconstructor().reconstruct_mirrored(
                set,
                mirrors,
                &cameras,
                CARVE,
                planes,
                Default::default(),
            )?;
            Ok((views.into_iter().next().context("a view")?, start.elapsed().as_secs_f64()))
        };
        // The first builds shaders.
        let (view, _) = make()?;
        let times = (0..REPEATS).map(|_| Ok(make()?.1)).collect::<anyhow::Result<Vec<f64>>>()?;
        Ok((view, median(times)))
    }
}

/// How one view is answered.
struct Answer {
    flip: f64,
    psnr_db: f64,
    guessed_ratio: f64,
    view_s: [f64; 2],
}

/// Views on a circle around a scene, outside its bounds.
fn around(bounds: &Aabb, views: usize) -> Vec<PinholeCamera> {
    let (middle, size) = (bounds.center(), bounds.size());
    let radius_m = 0.55 * size.x.hypot(size.z);
    let view = |number: usize| {
        let (sin, cos) = (std::f32::consts::TAU * number as f32 / views as f32).sin_cos();
        let eye = middle + Vec3::new(sin * radius_m, 0.6 * size.y, cos * radius_m);
        PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.5, VIEW_PX)
    };
    (0..views).map(view).collect()
}
