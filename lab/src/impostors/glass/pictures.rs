//! Bodies of the scene `glass`, one at a time, before its wall: by each way through them, beside rays through the scene.

use anyhow::Context as _;
use depth_image::{PinholeCamera, ToneMapping, View};
use glam::{UVec2, Vec3};
use metrics::flip_map;
use rayon::prelude::*;
use render::scalar;
use report::{Bar, Check, Picture, PictureRow, Report};

use super::ball::{SecondSurface, emerged};
use super::body::{Body, Emerged, Entry, of_parts};
use super::inside::{InsideImages, cameras};
use crate::failures::stand::Stand;
use crate::impostors::rays::unit_rays;
use crate::impostors::surfaces::{SKY_SRGB, Surfaces};
use crate::statistics::mean_of;
use crate::study::{Column, measure_rows, table};

/// Bodies and their parts of the scene's mesh; part 0 is the room.
const BODIES: [(&str, usize); 3] = [("ball", 1), ("slab", 2), ("pebble", 4)];
const ROOM: usize = 0;
const VIEW_PX: [UVec2; 2] = [UVec2::new(1280, 720), UVec2::new(320, 180)];
/// Views of a body: to the side of the axis, in radians.
const AZIMUTHS_RAD: [f32; 3] = [-0.4, 0.05, 0.45];
const DISTANCE_M: f32 = 3.5;
const UP_M: f32 = 0.5;
const FOV_DEG: f32 = 46.0;
const FAR_M: f32 = 1e3;
const NEAR_M: f32 = 1e-3;

/// FLIP of one body, over the pixels that show it.
struct BodyRow {
    body: &'static str,
    method: SecondSurface,
    flip: f64,
}

const COLUMNS: [Column<BodyRow>; 3] = [
    Column::new("body", |row| row.body.into()),
    Column::new("the second surface", |row| row.method.name().into()),
    Column::new("FLIP over glass", |row| row.flip.into()),
];

/// A body in the room.
struct Stage {
    body: Body,
    room: Surfaces,
    whole: scalar::rays::Scene,
}

/// What a pixel shows.
enum PixelContent {
    Glass(Entry),
    Other(Option<Vec3>),
}

/// Adds table, checks and pictures to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let size_px = VIEW_PX[usize::from(is_quick)];
    let mut rows = Vec::new();
    for (rows_of_body, pictures) in
        measure_rows("bodies of glass", BODIES, |(name, part)| of_body(stand, name, part, size_px))?
    {
        rows.extend(rows_of_body);
        report.pictures.push(pictures);
    }
    report.tables.push(table("Views of the scene glass, one body at a time", &COLUMNS, &rows)?);
    let ratio = mean_flip(&rows, SecondSurface::InsideImages) / mean_flip(&rows, SecondSurface::Wyman);
    report.checks.push(Check::new("FLIP over glass: inside images over Wyman", ratio, "×", Bar::AtMost(0.8)));
    Ok(())
}

fn mean_flip(rows: &[BodyRow], method: SecondSurface) -> f64 {
    let flips: Vec<f64> = rows.iter().filter(|row| row.method == method).map(|row| row.flip).collect();
    mean_of(&flips, |flip| *flip)
}

fn of_body(
    stand: &Stand,
    name: &'static str,
    part: usize,
    size_px: UVec2,
) -> anyhow::Result<(Vec<BodyRow>, PictureRow)> {
    let stage = Stage::new(stand, part)?;
    let cameras = cameras(&stage.body)?;
    let inside = InsideImages::take(&cameras, &stage.body);
    let mut flips = SecondSurface::ALL.map(|_| Vec::new());
    let mut pictures = Vec::new();
    for azimuth_rad in AZIMUTHS_RAD {
        let camera = stage.camera(azimuth_rad, size_px);
        let shown = stage.shown(&camera);
        let is_glass: Vec<bool> = shown.iter().map(|shown| matches!(shown, PixelContent::Glass(_))).collect();
        let truth = stage.truth(&camera, &shown);
        pictures.clear();
        pictures.push(picture(name, "rays", &truth)?);
        for (method, flips) in SecondSurface::ALL.into_iter().zip(&mut flips) {
            let view = stage.view(size_px, &shown, |entries| emerged(&stage.body, &inside, method, entries));
            flips.push(flip_map(&truth, &view)?.mean(Some(&is_glass))?.context("pixels of glass")?);
            pictures.push(picture(name, method.name(), &view)?);
        }
    }
    let rows = SecondSurface::ALL.into_iter().zip(&flips).map(|(method, flips)| BodyRow {
        body: name,
        method,
        flip: mean_of(flips, |flip| *flip),
    });
    Ok((rows.collect(), PictureRow { title: format!("{name}: refraction by rays and by images"), pictures }))
}

fn picture(body: &str, method: &str, view: &View) -> anyhow::Result<Picture> {
    let image = pictures::rgb(view).context("a picture")?;
    Ok(Picture::new(format!("{body} by {method}"), method, image))
}

impl Stage {
    fn new(stand: &Stand, part: usize) -> anyhow::Result<Self> {
        let scene = fixtures::glass();
        let body = Body::new(stand, &of_parts(&scene, &[part]))?;
        Ok(Self {
            body,
            room: Surfaces::new(&stand.upload(&of_parts(&scene, &[ROOM]))?)?,
            whole: scalar::rays::Scene::of(&stand.upload(&of_parts(&scene, &[ROOM, part]))?, 0.0)?,
        })
    }

    fn camera(&self, azimuth_rad: f32, size_px: UVec2) -> PinholeCamera {
        let middle = self.body.bounds.center();
        let eye = middle + Vec3::Z.rotate_y(azimuth_rad) * DISTANCE_M + Vec3::Y * UP_M;
        PinholeCamera::looking_at(eye, middle, Vec3::Y, FOV_DEG.to_radians(), size_px)
    }

    fn shown(&self, camera: &PinholeCamera) -> Vec<PixelContent> {
        let pixels = unit_rays(camera).map(|ray| {
            let met = self.room.meet(&ray, [NEAR_M, FAR_M]);
            let entry = self.body.entry(&ray);
            let entry = entry.filter(|entry| met.is_none_or(|met| met.t > entry.point.distance(entry.eye)));
            match entry {
                Some(entry) => PixelContent::Glass(entry),
                None => PixelContent::Other(met.map(|met| met.color_linear)),
            }
        });
        pixels.collect()
    }

    fn truth(&self, camera: &PinholeCamera, shown: &[PixelContent]) -> View {
        let colors = unit_rays(camera).zip(shown).enumerate().map(|(pixel, (ray, shown))| match shown {
            PixelContent::Other(color_linear) => srgb8(*color_linear),
            PixelContent::Glass(_) => self.whole.closest(&ray, 0.0).map_or(SKY_SRGB, |first| {
                let passage = self.whole.through_glass(&ray, first, pixel as u32);
                let color_linear = passage.hit.map(|hit| self.whole.look(&hit).base_linear);
                dimmed(color_linear, passage.throughput_linear)
            }),
        });
        view(camera.size_px, colors.collect())
    }

    fn view(&self, size_px: UVec2, shown: &[PixelContent], emerged: impl Fn(&[Entry]) -> Vec<Emerged>) -> View {
        let entries: Vec<Entry> = shown
            .iter()
            .filter_map(|shown| match shown {
                PixelContent::Glass(entry) => Some(*entry),
                PixelContent::Other(_) => None,
            })
            .collect();
        let ends: Vec<[u8; 3]> = emerged(&entries).par_iter().map(|emerged| self.end_of(emerged)).collect();
        let mut ends = ends.into_iter();
        let colors = shown.iter().map(|shown| match shown {
            PixelContent::Other(color_linear) => srgb8(*color_linear),
            PixelContent::Glass(_) => ends.next().unwrap_or(SKY_SRGB),
        });
        view(size_px, colors.collect())
    }

    fn end_of(&self, emerged: &Emerged) -> [u8; 3] {
        let met = self.room.meet(&emerged.ray, [NEAR_M, FAR_M]);
        dimmed(met.map(|met| met.color_linear), emerged.throughput_linear)
    }
}

fn srgb8(color_linear: Option<Vec3>) -> [u8; 3] {
    dimmed(color_linear, Vec3::ONE)
}

fn dimmed(color_linear: Option<Vec3>, throughput_linear: Vec3) -> [u8; 3] {
    let sky_linear = Vec3::from(SKY_SRGB.map(depth_image::linear_from_srgb8));
    ToneMapping::NONE.srgb8(color_linear.unwrap_or(sky_linear) * throughput_linear)
}

fn view(size_px: UVec2, colors: Vec<[u8; 3]>) -> View {
    View::from_srgb8(size_px, colors.into_flattened())
}
