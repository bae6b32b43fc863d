//! Single rays off the mirror that meet the teapot, in images of the teapot alone (Rosen et al., section 4).

use depth_image::{Aabb, Camera, DepthImage, Environment, PinholeCamera, ProvenanceKind, Ray, srgb8_from_linear};
use glam::{UVec2, Vec3};
use gpu::Turn;
use rayon::prelude::*;
use reconstruction::{RayEnd, RayWork, SampleSet};
use render::{GpuScene, Lighting, SamplePlanes, scalar};
use report::{Bar, Check};
use sampling::Impostors;
use scene::Scene;

use super::measure::TEXELS;
use crate::failures::stage::in_the_dark;
use crate::failures::stand::Stand;
use crate::study::Column;

/// The size of the views whose rays are followed, the paper's smallest.
const VIEW_PX: UVec2 = UVec2::new(640, 480);
/// What rises less is the floor.
const FLOOR_M: f32 = 1e-3;
/// Nothing is met nearer to the mirror.
pub const NEAR_M: f32 = 0.02;
/// Ends within this share of the teapot's longest side are right.
const RIGHT: f32 = 0.01;
/// No two colours differ by less.
const LEAST_ERROR: f64 = 1e-9;

/// The teapot alone, and the rays off the mirror that meet it.
pub struct Teapot<'s> {
    pub stand: &'s Stand,
    on_device: GpuScene,
    pub bounds: Aabb,
    mirrored: &'s Scene,
    pub rays: Vec<Ray>,
    /// The way to the teapot's surface and its colour.
    truth: Vec<(f32, Vec3)>,
}

/// What images tell of the rays that meet the teapot.
pub struct Figures {
    images: String,
    found_ratio: f64,
    /// Ends elsewhere.
    wrong_ratio: f64,
    psnr_db: f64,
}

pub const TITLE: &str = "Rays off the mirror that meet the teapot, in images of the teapot";
pub const COLUMNS: [Column<Figures>; 4] = [
    Column::new("images", |row| row.images.as_str().into()),
    Column::with_unit("found", "%", |row| (row.found_ratio * 100.0).into()),
    Column::with_unit("wrong", "%", |row| (row.wrong_ratio * 100.0).into()),
    Column::with_unit("PSNR", "dB", |row| row.psnr_db.into()),
];

impl<'s> Teapot<'s> {
    /// # Errors
    /// The device fails.
    pub fn new(stand: &'s Stand, scene: &'s Scene, views: &[PinholeCamera]) -> anyhow::Result<Self> {
        let on_device = stand.upload(&alone(scene))?;
        let twin = scalar::rays::Scene::of(&on_device, 0.0)?;
        let bounds = Aabb::around(twin.triangles_in_world().flatten());
        let whole = scalar::rays::Scene::of(&stand.upload(scene)?, 0.0)?;
        let met = mirrored(&whole, views).into_par_iter().filter_map(|ray| {
            let hit = twin.closest(&ray, NEAR_M)?;
            Some((ray, (hit.t, twin.look(&hit).base_linear)))
        });
        let (rays, truth) = met.unzip();
        Ok(Self { stand, on_device, bounds, mirrored: scene, rays, truth })
    }

    /// The mirror's images of this kind, at [`TEXELS`] together.
    pub fn cameras(&self, impostors: Impostors) -> Vec<Camera> {
        let (mirrors, _) = sampling::mirrors(self.mirrored, impostors);
        let cameras = mirrors.into_iter().next().map_or_else(Vec::new, |mirror| mirror.cameras);
        Camera::resized_together(&cameras, TEXELS, 1)
    }

    /// Images of the teapot in its own colours.
    ///
    /// # Errors
    /// The device fails.
    pub fn images(&self, cameras: &[Camera]) -> anyhow::Result<Vec<DepthImage>> {
        self.stand.images(&self.on_device, Lighting::UNLIT, cameras, SamplePlanes::default())
    }

    /// # Errors
    /// The device fails.
    pub fn set(&self, images: &[DepthImage]) -> anyhow::Result<SampleSet> {
        let description = in_the_dark(self.bounds, Environment::uniform(Vec3::ZERO));
        Ok(self.stand.reconstructor().upload(images, &description, Turn::default())?)
    }

    fn figures(&self, name: &str, cameras: &[Camera]) -> anyhow::Result<Figures> {
        let set = self.set(&self.images(cameras)?)?;
        let (ends, _) = self.stand.reconstructor().follow(RayWork::new(&set, NEAR_M), &self.rays)?;
        anyhow::ensure!(!ends.is_empty(), "no ray meets the teapot");
        let tolerance_m = RIGHT * self.bounds.size().max_element();
        let mut found = 0usize;
        let mut wrong = 0usize;
        let mut error = 0.0;
        for (end, (way_m, color_linear)) in ends.iter().zip(&self.truth) {
            let is_hit = end.kind == ProvenanceKind::Hit;
            let is_right = is_hit && (end.way_m - way_m).abs() <= tolerance_m;
            found += usize::from(is_right);
            wrong += usize::from(is_hit && !is_right);
            error += squared_error(end, *color_linear);
        }
        let count = ends.len() as f64;
        Ok(Figures {
            images: name.to_owned(),
            found_ratio: found as f64 / count,
            wrong_ratio: wrong as f64 / count,
            psnr_db: -10.0 * (error / count).max(LEAST_ERROR).log10(),
        })
    }
}

/// The part of the scene that is neither floor nor mirror.
fn alone(whole: &Scene) -> Scene {
    let mut alone = whole.clone();
    let mesh = &mut alone.meshes[0];
    mesh.parts.truncate(1);
    let part = &mut mesh.parts[0];
    let matt = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
    let triangles = matt.as_chunks::<3>().0.iter();
    let rising = triangles.filter(|corners| corners.iter().any(|&at| mesh.vertices[at as usize].position[1] > FLOOR_M));
    let kept: Vec<u32> = rising.flatten().copied().collect();
    part.first_index = 0;
    part.index_count = kept.len() as u32;
    mesh.indices = kept;
    alone
}

/// The rays off the mirrors that these views show, at [`VIEW_PX`].
fn mirrored(scene: &scalar::rays::Scene, views: &[PinholeCamera]) -> Vec<Ray> {
    let rays = views.par_iter().flat_map(|camera| {
        let camera = camera.resized(VIEW_PX);
        let pixels = (0..VIEW_PX.y).flat_map(|y| (0..VIEW_PX.x).map(move |x| UVec2::new(x, y)));
        pixels.filter_map(|pixel| off_mirror(scene, &camera, pixel)).collect::<Vec<Ray>>()
    });
    rays.collect()
}

/// The ray off the mirror that a pixel shows.
fn off_mirror(scene: &scalar::rays::Scene, camera: &PinholeCamera, pixel: UVec2) -> Option<Ray> {
    let ray = scalar::rays::pixel_ray(camera, pixel);
    let hit = scene.closest(&ray, camera.near_m)?;
    scene.look(&hit).reflector?;
    let towards = ray.direction_in_world.normalize_or_zero().reflect(scene.normal_in_world(&hit));
    Some(Ray { origin_in_world: ray.at(hit.t), direction_in_world: towards })
}

/// Of sRGB from 0 to 1; rays that find nothing are black.
fn squared_error(end: &RayEnd, truth_linear: Vec3) -> f64 {
    let found = if end.kind == ProvenanceKind::Hit { end.color_linear } else { Vec3::ZERO };
    let [found, truth] = [found, truth_linear]
        .map(|color| color.to_array().map(|channel| f64::from(srgb8_from_linear(channel)) / 255.0));
    let [r, g, b] = [0, 1, 2].map(|channel| (found[channel] - truth[channel]).powi(2));
    (r + g + b) / 3.0
}

/// Single-pole images, and the pinholes that they are made from, at equal texels.
///
/// # Errors
/// The device fails.
pub fn compare(teapot: &Teapot<'_>) -> anyhow::Result<Vec<Figures>> {
    let mut rows = Vec::new();
    for images in 1..=2 {
        let bent = teapot.cameras(Impostors::SinglePoles { images });
        let straight = bent.iter().map(|camera| undistorted(teapot, camera)).collect::<Vec<Camera>>();
        rows.push(teapot.figures(&format!("pinhole:{images}, around the teapot"), &straight)?);
        rows.push(teapot.figures(&format!("single_pole:{images}"), &bent)?);
    }
    Ok(rows)
}

/// The pinhole in a single-pole camera's place that fits around the teapot.
fn undistorted(teapot: &Teapot<'_>, camera: &Camera) -> Camera {
    let reference = camera.reference();
    let eye = reference.eye_in_world;
    depth_image::SinglePoleCamera::around(&teapot.bounds, eye, 0.0, reference.size_px).reference.into()
}

/// # Errors
/// A row is missing.
pub fn checks(rows: &[Figures]) -> anyhow::Result<Vec<Check>> {
    let [pinhole, single_pole, _, single_poles] = rows else { anyhow::bail!("{} rows of single rays", rows.len()) };
    let more_points = (single_pole.found_ratio - pinhole.found_ratio) * 100.0;
    let more_db = single_pole.psnr_db - pinhole.psnr_db;
    Ok(vec![
        Check::new("rays found by one single-pole image less one pinhole's", more_points, "points", Bar::AtLeast(2.0)),
        Check::new("colour of these rays: PSNR less one pinhole's", more_db, "dB", Bar::AtLeast(2.0)),
        Check::new("rays found by two single-pole images", single_poles.found_ratio * 100.0, "%", Bar::AtLeast(97.0)),
    ])
}
