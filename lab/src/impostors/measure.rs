//! Views of a scene with mirrors: by images of their surroundings, and drawn directly.

use anyhow::Context as _;
use depth_image::{
    Aabb, Antialias, Camera, DepthImage, Highlight, PinholeCamera, ProvenanceKind, View, ViewPlanes, linear_from_srgb8,
    srgb8_from_linear,
};
use glam::{UVec2, Vec3};
use gpu::Turn;
use metrics::{Rgb8Image, flip_map, psnr_db};
use reconstruction::{MirrorCell, Mirrors, ReconstructRequest, SampleSet, SetDescription};
use render::{GpuScene, Lighting, SamplePlanes};
use sampling::Impostors;
use scene::Scene;

use super::candidates::{Candidate, in_a_cluster};
use super::objects::{is_of_object, painted};
use crate::failures::stage::CARVE;
use crate::failures::stand::Stand;

pub const VIEW_PX: UVec2 = UVec2::new(200, 150);
/// A mirror shows the scene where it differs from the environment by more than this, in codes.
const SEEN_CODES: u8 = 8;
/// Rays a pixel of the smooth truth.
const RAYS: u32 = 64;
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
    /// The truth with 64 rays a pixel, of some views.
    smooth: Option<View>,
}

/// A scene on the device with its views.
pub struct Hall<'s> {
    pub stand: &'s Stand,
    scene: &'s Scene,
    pub on_device: GpuScene,
    painted: GpuScene,
    pub lighting: Lighting,
    subjects: Vec<Subject>,
}

/// What a candidate's images show.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub images: usize,
    pub texels: usize,
    /// Over the pixels in which a mirror shows an object.
    pub of_objects: Answer,
    /// Over the pixels in which a mirror shows the scene.
    pub of_scene: Answer,
    /// Over both kinds of pixels, against 64 rays a pixel.
    pub of_smooth: [Answer; 2],
}

/// Errors of pixels, and the share of them that no image knew.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    pub flip: f64,
    pub psnr_db: f64,
    pub guessed_ratio: f64,
}

impl<'s> Hall<'s> {
    /// Draws the truth of views, of the first `smooth` also with several rays a pixel. Those in which no mirror shows an object are left
    /// out.
    ///
    /// # Errors
    /// The device fails, or no view shows a mirror.
    pub fn new(
        stand: &'s Stand,
        scene: &'s Scene,
        (lighting, smooth): (Lighting, usize),
        views: &[PinholeCamera],
    ) -> anyhow::Result<Self> {
        let (on_device, painted) = (stand.upload(scene)?, stand.upload(&painted(scene))?);
        let mut hall = Self { stand, scene, on_device, painted, lighting, subjects: Vec::new() };
        for camera in views {
            let is_smooth = hall.subjects.len() < smooth;
            hall.subjects.extend(hall.subject(*camera, is_smooth)?);
        }
        anyhow::ensure!(!hall.subjects.is_empty(), "no view shows an object in a mirror");
        Ok(hall)
    }

    /// Of the pixels in which mirrors show the scene, the share in which they show an object.
    pub fn object_share(&self) -> f64 {
        let count = |of: fn(&Subject) -> &Vec<bool>| self.subjects.iter().flat_map(of).filter(|is| **is).count() as f64;
        count(|subject| &subject.of_objects) / count(|subject| &subject.mirrored)
    }

    /// `None` where no mirror shows an object.
    fn subject(&self, camera: PinholeCamera, is_smooth: bool) -> anyhow::Result<Option<Subject>> {
        let draw = |scene, lighting| -> anyhow::Result<View> {
            let views = self.stand.views(scene, lighting, &[camera], ViewPlanes::WITH_DEPTH)?;
            views.into_iter().next().context("a view")
        };
        let both = |scene| anyhow::Ok((draw(scene, self.lighting)?, draw(scene, plain(self.lighting))?));
        let (truth, unmirrored) = both(&self.on_device)?;
        let (in_paint, unmirrored_in_paint) = both(&self.painted)?;
        let mirrored = changed(&unmirrored, &truth);
        let of_objects: Vec<bool> = is_of_object(&unmirrored_in_paint, &in_paint)
            .into_iter()
            .zip(&mirrored)
            .map(|(is, of)| is && *of)
            .collect();
        if !of_objects.contains(&true) {
            return Ok(None);
        }
        let set = self.set(&self.images(&[camera.into()])?, false)?;
        let smooth = is_smooth.then(|| self.smooth(&camera)).transpose()?;
        Ok(Some(Subject { camera, set, truth, mirrored, of_objects, smooth }))
    }

    /// The truth, of 64 rays a pixel: four pixels of twice the size are averaged.
    fn smooth(&self, camera: &PinholeCamera) -> anyhow::Result<View> {
        let antialias = Antialias::of(RAYS / 4).context("a number of samples")?;
        let planes = ViewPlanes { antialias, ..ViewPlanes::COLOR };
        let twice = camera.resized(camera.size_px * 2);
        let view = self.stand.views(&self.on_device, self.lighting, &[twice], planes)?.into_iter().next();
        let view = view.context("a view")?;
        Ok(View { size_px: camera.size_px, srgb8: halved(&view), ..view })
    }

    pub fn images(&self, cameras: &[Camera]) -> anyhow::Result<Vec<DepthImage>> {
        self.stand.images(&self.on_device, plain(self.lighting), cameras, PLANES)
    }

    pub fn set(&self, images: &[DepthImage], mips: bool) -> anyhow::Result<SampleSet> {
        let description = SetDescription {
            volume: self.scene.bounds(),
            background: self.scene.background,
            illumination: &self.scene.illumination,
            highlight: Some(Highlight::Ggx),
            environment: None,
            mips,
        };
        Ok(self.stand.reconstructor().upload(images, &description, Turn::default())?)
    }

    /// The scene's mirrors and the sets of what they show, as in a cluster.
    ///
    /// # Errors
    /// The device fails.
    pub fn surroundings(&self, impostors: Impostors) -> anyhow::Result<(Vec<Aabb>, Vec<SampleSet>)> {
        let (mirrors, _) = sampling::mirrors(self.scene, impostors);
        let set = |mirror| self.set(&self.images(&in_a_cluster(mirror))?, true);
        let sets = mirrors.iter().map(set).collect::<anyhow::Result<Vec<_>>>()?;
        Ok((mirrors.iter().map(|mirror| mirror.bounds).collect(), sets))
    }

    /// The figures of a candidate for each mirror of the scene; without candidates, of mirrors that show the environment.
    ///
    /// # Errors
    /// The device fails.
    pub fn figures(&self, mirrors: &[Aabb], candidates: &[Candidate]) -> anyhow::Result<Figures> {
        let images = candidates.iter().map(|candidate| self.images(&candidate.cameras));
        let images = images.collect::<anyhow::Result<Vec<_>>>()?;
        let sets = candidates.iter().zip(&images).map(|(candidate, images)| self.set(images, candidate.mips));
        let sets = sets.collect::<anyhow::Result<Vec<_>>>()?;
        let views = self.views(&cells(mirrors, &sets), self.lighting.reflections())?;
        let answered = |of: fn(&Subject) -> &Vec<bool>| -> anyhow::Result<Answer> {
            let each =
                self.subjects.iter().zip(&views).map(|(subject, view)| answer(&subject.truth, view, of(subject)));
            mean(&each.collect::<anyhow::Result<Vec<_>>>()?)
        };
        let smooth = |of: fn(&Subject) -> &Vec<bool>| -> anyhow::Result<Answer> {
            let each = self.subjects.iter().zip(&views);
            let each = each.filter_map(|(subject, view)| Some(answer(subject.smooth.as_ref()?, view, of(subject))));
            mean(&each.collect::<anyhow::Result<Vec<_>>>()?)
        };
        let count = |of: fn(&DepthImage) -> usize| images.iter().flatten().map(of).sum();
        Ok(Figures {
            images: count(|_| 1),
            texels: count(|image| image.color_rgb9e5.len()),
            of_objects: answered(|subject| &subject.of_objects)?,
            of_scene: answered(|subject| &subject.mirrored)?,
            of_smooth: [smooth(|subject| &subject.of_objects)?, smooth(|subject| &subject.mirrored)?],
        })
    }

    /// Its views, with these mirror cells.
    ///
    /// # Errors
    /// The device fails.
    pub fn views(&self, cells: &[MirrorCell<'_>], reflections: u32) -> anyhow::Result<Vec<View>> {
        let mirrors = Mirrors { cells, reflections, glossy_rays: 0 };
        let view = |subject: &Subject| {
            let (set, cameras, turn) = (&subject.set, [subject.camera], Default::default());
            let reconstructor = self.stand.reconstructor();
            let views = reconstructor.reconstruct(ReconstructRequest {
                common: mirrors.into(),
                turn,
                planes: ViewPlanes::ALL,
                ..ReconstructRequest::new(set, &cameras, CARVE)
            })?;
            views.into_iter().next().context("a view")
        };
        self.subjects.iter().map(view).collect()
    }

    /// Errors of rays that meet `order` mirrors and no fewer, where some do: of views whose rays meet as many, and of views
    /// whose rays meet none.
    ///
    /// # Errors
    /// The device fails.
    pub fn order(&self, mirrors: &[Aabb], sets: &[SampleSet], order: u32) -> anyhow::Result<Option<[Answer; 2]>> {
        let mut answers = [Vec::new(), Vec::new()];
        let [with, without] = [order, 0].map(|reflections| self.views(&cells(mirrors, sets), reflections));
        let (truths, before) = (self.truths(order)?, self.truths(order - 1)?);
        for (((truth, before), with), without) in truths.iter().zip(&before).zip(with?).zip(without?) {
            let pixels = changed(before, truth);
            if pixels.contains(&true) {
                answers[0].push(answer(truth, &with, &pixels)?);
                answers[1].push(answer(truth, &without, &pixels)?);
            }
        }
        if answers[0].is_empty() { Ok(None) } else { Ok(Some([mean(&answers[0])?, mean(&answers[1])?])) }
    }

    /// Its views, drawn directly with this number of reflections.
    ///
    /// # Errors
    /// The device fails.
    pub fn truths(&self, reflections: u32) -> anyhow::Result<Vec<View>> {
        let cameras: Vec<PinholeCamera> = self.subjects.iter().map(|subject| subject.camera).collect();
        self.stand.views(&self.on_device, reflecting(self.lighting, reflections)?, &cameras, ViewPlanes::COLOR)
    }
}

/// Cells of mirrors and the sets of their surroundings.
pub fn cells<'s>(mirrors: &[Aabb], sets: &'s [SampleSet]) -> Vec<MirrorCell<'s>> {
    mirrors.iter().zip(sets).map(|(bounds, surroundings)| MirrorCell { bounds: *bounds, surroundings }).collect()
}

/// The lighting without reflections.
pub fn plain(lighting: Lighting) -> Lighting {
    lighting.without_reflections().unwrap_or(lighting)
}

/// The lighting with this number of reflections.
pub fn reflecting(lighting: Lighting, reflections: u32) -> anyhow::Result<Lighting> {
    let plain = plain(lighting);
    if reflections == 0 { Ok(plain) } else { Ok(format!("{plain}, reflections {reflections}").parse()?) }
}

/// The means of two rows and two columns each, of linear light.
fn halved(view: &View) -> Vec<u8> {
    let size_px = view.size_px / 2;
    let color = |x: u32, y: u32| {
        let first = 3 * (y * view.size_px.x + x) as usize;
        Vec3::from_array([0, 1, 2].map(|channel| linear_from_srgb8(view.srgb8[first + channel])))
    };
    let mean = |index: u32| {
        let place = UVec2::new(index % size_px.x, index / size_px.x) * 2;
        let of = |x: u32, y: u32| color(place.x + x, place.y + y);
        0.25 * (of(0, 0) + of(1, 0) + of(0, 1) + of(1, 1))
    };
    (0..size_px.element_product()).flat_map(|index| mean(index).to_array().map(srgb8_from_linear)).collect()
}

/// Pixels that differ by more than [`SEEN_CODES`].
pub fn changed(before: &View, after: &View) -> Vec<bool> {
    let pixels = before.srgb8.chunks_exact(3).zip(after.srgb8.chunks_exact(3));
    pixels.map(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > SEEN_CODES)).collect()
}

fn answer(truth: &View, view: &View, pixels: &[bool]) -> anyhow::Result<Answer> {
    let [reference, picture] = [Rgb8Image::of_view(truth)?, Rgb8Image::of_view(view)?];
    let kinds = view.provenance.as_ref().context("provenance")?.iter().map(|provenance| provenance.kind());
    let guessed = kinds.zip(pixels).filter(|(kind, is)| **is && *kind == ProvenanceKind::Guessed).count();
    let count = pixels.iter().filter(|is| **is).count();
    Ok(Answer {
        flip: flip_map(&reference, &picture)?.mean(Some(pixels))?.context("mirrored pixels")?,
        psnr_db: psnr_db(&reference, &picture, Some(pixels))?.context("mirrored pixels")?,
        guessed_ratio: guessed as f64 / count as f64,
    })
}

fn mean(answers: &[Answer]) -> anyhow::Result<Answer> {
    anyhow::ensure!(!answers.is_empty(), "no view has such pixels");
    let mean = |of: fn(&Answer) -> f64| answers.iter().map(of).sum::<f64>() / answers.len() as f64;
    Ok(Answer {
        flip: mean(|answer| answer.flip),
        psnr_db: mean(|answer| answer.psnr_db),
        guessed_ratio: mean(|answer| answer.guessed_ratio),
    })
}

/// Views on a circle around a scene, outside its bounds.
pub fn around(bounds: &Aabb, views: usize) -> Vec<PinholeCamera> {
    let (middle, size) = (bounds.center(), bounds.size());
    let radius_m = 0.55 * size.x.hypot(size.z);
    let view = |number: usize| {
        let (sin, cos) = (std::f32::consts::TAU * number as f32 / views as f32).sin_cos();
        let eye = middle + Vec3::new(sin * radius_m, 0.6 * size.y, cos * radius_m);
        PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.5, VIEW_PX)
    };
    (0..views).map(view).collect()
}
