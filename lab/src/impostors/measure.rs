//! Views of a scene with mirrors: by images of their surroundings, and drawn directly.

use anyhow::Context as _;
use depth_image::{Aabb, Antialias, Camera, DepthImage, Highlight, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use glam::{UVec2, Vec3};
use gpu::Turn;
use metrics::{flip_map, psnr_db};
use reconstruction::{MirrorCell, Mirrors, ReconstructRequest, SampleSet, SetDescription};
use render::{GpuScene, Lighting, SamplePlanes};
use sampling::Impostors;
use scene::Scene;

use super::objects::{is_of_object, painted};
use crate::failures::stage::CARVE;
use crate::failures::stand::{Stand, description};
use crate::statistics::mean_of;

const VIEW_PX: UVec2 = UVec2::new(200, 150);
/// Texels of all images of a mirror together.
pub const TEXELS: f32 = 262_144.0;
/// A mirror shows the scene where it differs from the environment by more than this, in codes.
const SEEN_CODES: u8 = 8;
const PLANES: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: true,
    corners: false,
    light: false,
};

/// A view, its own sample set, and the truth. The set's one image is the view's, so that errors are those of the mirror.
struct Subject {
    camera: PinholeCamera,
    set: SampleSet,
    truth: View,
    /// Pixels in which a mirror shows the scene.
    mirrored: Vec<bool>,
    /// Those in which it shows an object, neither the ground nor the sky.
    of_objects: Vec<bool>,
}

/// A scene on the device with its views.
pub struct Hall<'s> {
    stand: &'s Stand,
    scene: &'s Scene,
    on_device: GpuScene,
    lighting: Lighting,
    subjects: Vec<Subject>,
}

/// What images of mirrors' surroundings show.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub impostors: Impostors,
    pub texels: usize,
    /// Over the pixels in which a mirror shows an object.
    pub of_objects: Errors,
    /// Over the pixels in which a mirror shows the scene.
    pub of_scene: Errors,
}

/// Errors of pixels, and the share of them that no image knew.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    pub flip: f64,
    pub psnr_db: f64,
    pub guessed_ratio: f64,
}

impl<'s> Hall<'s> {
    /// Draws the truth of views. Those in which no mirror shows an object are left out.
    ///
    /// # Errors
    /// The device fails, or no view shows a mirror.
    pub fn new(
        stand: &'s Stand,
        scene: &'s Scene,
        lighting: Lighting,
        views: &[PinholeCamera],
    ) -> anyhow::Result<Self> {
        let on_device = stand.upload(scene)?;
        let painted = stand.upload(&painted(scene))?;
        let mut hall = Self { stand, scene, on_device, lighting, subjects: Vec::new() };
        for camera in views {
            let subject = hall.subject(*camera, &painted)?;
            hall.subjects.extend(subject);
        }
        anyhow::ensure!(!hall.subjects.is_empty(), "no view shows an object in a mirror");
        Ok(hall)
    }

    /// `None` where no mirror shows an object.
    fn subject(&self, camera: PinholeCamera, painted: &GpuScene) -> anyhow::Result<Option<Subject>> {
        let truth = self.draw(&self.on_device, camera, 1)?;
        let mirrored = changed(&self.draw(&self.on_device, camera, 0)?, &truth);
        let shows_object = is_of_object(&self.draw(painted, camera, 0)?, &self.draw(painted, camera, 1)?);
        let of_objects: Vec<bool> = shows_object.iter().zip(&mirrored).map(|(shows, is)| *shows && *is).collect();
        if !of_objects.contains(&true) {
            return Ok(None);
        }
        let set = self.set(&self.images(&[camera.into()])?, false)?;
        Ok(Some(Subject { camera, set, truth, mirrored, of_objects }))
    }

    fn draw(&self, scene: &GpuScene, camera: PinholeCamera, reflections: u32) -> anyhow::Result<View> {
        let lighting = reflecting(self.lighting, reflections)?;
        Ok(self.stand.views(scene, lighting, &[camera], ViewPlanes::COLOR)?.remove(0))
    }

    fn images(&self, cameras: &[Camera]) -> anyhow::Result<Vec<DepthImage>> {
        self.stand.images(&self.on_device, reflecting(self.lighting, 0)?, cameras, PLANES)
    }

    fn set(&self, images: &[DepthImage], mips: bool) -> anyhow::Result<SampleSet> {
        let description = SetDescription { mips, ..description(self.scene, Some(Highlight::Ggx)) };
        Ok(self.stand.reconstructor().upload(images, &description, Turn::default())?)
    }

    /// The errors of views whose mirrors have these images, at [`TEXELS`] a mirror.
    ///
    /// # Errors
    /// The device fails.
    pub fn figures(&self, impostors: Impostors) -> anyhow::Result<Figures> {
        let (mirrors, _) = sampling::mirrors(self.scene, impostors);
        let mut sets = Vec::new();
        let mut texels = 0;
        for mirror in &mirrors {
            let images = self.images(&Camera::resized_together(&mirror.cameras, TEXELS, 1))?;
            texels += images.iter().map(|image| image.camera.pixel_count()).sum::<usize>();
            sets.push((mirror.bounds, self.set(&images, true)?));
        }
        let cells: Vec<MirrorCell<'_>> =
            sets.iter().map(|(bounds, surroundings)| MirrorCell { bounds: *bounds, surroundings }).collect();
        let views = self.views(&cells)?;
        Ok(Figures {
            impostors,
            texels,
            of_objects: self.errors(&views, |subject| &subject.of_objects)?,
            of_scene: self.errors(&views, |subject| &subject.mirrored)?,
        })
    }

    fn views(&self, cells: &[MirrorCell<'_>]) -> anyhow::Result<Vec<View>> {
        let mirrors = Mirrors { cells, reflections: 1, glossy_rays: 0 };
        let mut views = Vec::with_capacity(self.subjects.len());
        for subject in &self.subjects {
            views.extend(self.stand.reconstructor().reconstruct(ReconstructRequest {
                common: mirrors.into(),
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(&subject.set, &[subject.camera], CARVE)
            })?);
        }
        Ok(views)
    }

    /// The means over all views.
    fn errors(&self, views: &[View], pixels: fn(&Subject) -> &Vec<bool>) -> anyhow::Result<Errors> {
        let pairs = self.subjects.iter().zip(views);
        let errors = pairs.map(|(subject, view)| errors_of_view(subject, view, pixels(subject)));
        let errors = errors.collect::<anyhow::Result<Vec<Errors>>>()?;
        Ok(Errors {
            flip: mean_of(&errors, |errors| errors.flip),
            psnr_db: mean_of(&errors, |errors| errors.psnr_db),
            guessed_ratio: mean_of(&errors, |errors| errors.guessed_ratio),
        })
    }
}

fn errors_of_view(subject: &Subject, view: &View, pixels: &[bool]) -> anyhow::Result<Errors> {
    let kinds = view.provenance.as_ref().context("provenance")?.iter().map(|provenance| provenance.kind());
    let guessed = kinds.zip(pixels).filter(|(kind, is)| **is && *kind == ProvenanceKind::Guessed).count();
    let count = pixels.iter().filter(|is| **is).count();
    Ok(Errors {
        flip: flip_map(&subject.truth, view)?.mean(Some(pixels))?.context("mirrored pixels")?,
        psnr_db: psnr_db(&subject.truth, view, Some(pixels))?.context("mirrored pixels")?,
        guessed_ratio: guessed as f64 / count as f64,
    })
}

/// The lighting with this number of reflections.
pub fn reflecting(lighting: Lighting, reflections: u32) -> anyhow::Result<Lighting> {
    let plain = lighting.without_reflections().unwrap_or(lighting);
    if reflections == 0 { Ok(plain) } else { Ok(format!("{plain}, reflections {reflections}").parse()?) }
}

/// Pixels that differ by more than [`SEEN_CODES`].
pub fn changed(before: &View, after: &View) -> Vec<bool> {
    let pixels = before.srgb8.chunks_exact(3).zip(after.srgb8.chunks_exact(3));
    pixels.map(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > SEEN_CODES)).collect()
}

/// Views on a circle around a scene, outside its bounds.
pub fn around(bounds: &Aabb, views: usize) -> Vec<PinholeCamera> {
    let middle = bounds.center();
    let size = bounds.size();
    let radius_m = 0.55 * size.x.hypot(size.z);
    let cameras = (0..views).map(|number| {
        let (sin, cos) = f32::sin_cos(std::f32::consts::TAU * number as f32 / views as f32);
        let eye = middle + Vec3::new(sin * radius_m, 0.6 * size.y, cos * radius_m);
        PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.5, VIEW_PX)
    });
    cameras.collect()
}
