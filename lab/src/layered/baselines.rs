//! The paper's own ways to the primary rays of a view, beside the walk through planes: its warp, and its quadtrees.
//!
//! The host does both, with the samples of all surfaces as in the paper. A pixel shows the colour of one sample: no scene here has
//! highlights under the study's light, so that a sample's colour is all that it sends.

use std::time::Instant;

use anyhow::ensure;
use depth_image::{PinholeCamera, ToneMapping, View, linear_from_rgb9e5};
use glam::Vec2;
use rayon::prelude::*;
use render::{LayerSelection, Lighting};
use report::{Axis, Bar, Better, Cell, Check, Report, Table, XyChart};

use super::accuracy::{Reached, over_time};
use super::pyramid::{EPSILON_FACTOR, Hit, Pyramids};
use super::subject::{Cube, Subject};
use super::views::{self, Figures};
use super::warp::warp;
use crate::failures::stand::Stand;

/// A quick run has the first alone.
const SCENES: [&str; 4] = ["bird-nest", "mirror-box", "teapot-spheres", "tree"];
const VIEWS: usize = 3;
const SIDE: u32 = 512;
/// Where the texels of the first side are too large for the bound beside the warp.
const FINER_SIDE: u32 = 1024;
const MOST_TEXEL_PX: f64 = 0.54;
/// Bounds beside the quadtrees: wrong hits as a share of theirs. PSNR above both of the paper's ways.
const MOST_WRONG_HITS: f64 = 0.4;
const LEAST_GAIN_DB: f64 = 3.0;
const WARP: &str = "warp";
const WAYS: [&str; 4] = ["pyramid", "pyramid, dominant axis", WARP, "layered"];
const IMAGES: &str = "joint_carve";
const NOTE: &str = "Sides of cubes stand beside the points. The device makes views by layered and joint_carve, the host those of the paper's ways.";

/// Adds the table of all scenes, its checks, and charts of each scene.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, lighting: Lighting, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let columns = [&views::COLUMNS[..], &[("texel", "px"), ("holes", "%")]].concat();
    let mut table = Table::new("The paper's ways beside the walk", &columns);
    for &name in &SCENES[..if is_quick { 1 } else { SCENES.len() }] {
        let subject = Subject::new(stand, name, lighting, VIEWS)?;
        let coarse = Ways::new(&Cubes::new(&subject, SIDE)?)?;
        let is_coarse = coarse.texel_px > MOST_TEXEL_PX;
        let finer = is_coarse.then(|| Ways::new(&Cubes::new(&subject, FINER_SIDE)?)).transpose()?;
        let all: Vec<&Ways> = [&coarse].into_iter().chain(&finer).collect();
        let images = views::of_images(&subject)?;
        for ways in &all {
            ways.push(name, &mut table)?;
        }
        table.push([images.row(name, IMAGES), vec![Cell::from(None::<f64>); 2]].concat())?;
        report.checks.extend(checks(name, &coarse, finer.as_ref().unwrap_or(&coarse)));
        report.charts.extend(charts(name, &all, &images).map(Into::into));
    }
    report.tables.push(table);
    Ok(())
}

fn checks(name: &str, ways: &Ways, beside_warp: &Ways) -> Vec<Check> {
    let [quadtrees, _, _, walk] = ways.figures;
    let over = |what: &str| format!("{name}: {what} of a walk over quadtrees, {}²", ways.side);
    let mut checks = vec![
        Check::new(over("wrong hits"), walk.wrong_hits / quadtrees.wrong_hits, "", Bar::AtMost(MOST_WRONG_HITS)),
        Check::new(over("PSNR"), walk.psnr_db - quadtrees.psnr_db, "dB", Bar::AtLeast(LEAST_GAIN_DB)),
    ];
    let [_, _, warped, walk] = beside_warp.figures;
    let gain = format!("{name}: PSNR of a walk over the warp, {}²", beside_warp.side);
    checks.push(Check::new(gain, walk.psnr_db - warped.psnr_db, "dB", Bar::AtLeast(LEAST_GAIN_DB)));
    checks
}

/// PSNR and wrong hits of all ways over the time of a view.
fn charts(name: &str, all: &[&Ways], images: &Figures) -> [XyChart; 2] {
    type Accuracy = (&'static str, Axis, Better, fn(&Figures) -> f64);
    let accuracies: [Accuracy; 2] = [
        ("PSNR", Axis::linear("PSNR", "dB"), Better::High, |figures| figures.psnr_db),
        ("wrong hits", Axis::log("wrong hits", "%"), Better::Low, |figures| figures.wrong_hits * 100.0),
    ];
    accuracies.map(|(quantity, axis, better, of)| {
        let reached =
            |setting: String, figures: &Figures| Reached { setting, view_s: figures.view_s, accuracy: of(figures) };
        let ways = WAYS.into_iter().enumerate().map(|(way, by)| {
            (by, all.iter().map(|ways| reached(format!("{}²", ways.side), &ways.figures[way])).collect())
        });
        let images = (IMAGES, vec![reached(String::new(), images)]);
        over_time((format!("{name}: {quantity} over time"), NOTE), (axis, better), ways.chain([images]))
    })
}

/// All ways to views, in cubes of one side.
struct Ways {
    side: u32,
    /// Of each of [`WAYS`].
    figures: [Figures; 4],
    texel_px: f64,
    /// The share of holes of the warp.
    holes: f64,
}

impl Ways {
    fn new(cubes: &Cubes<'_>) -> anyhow::Result<Self> {
        let [quadtrees, of_dominant] = [cubes.traced(&cubes.all)?, cubes.traced(&cubes.dominant)?];
        let (warped, holes) = cubes.warped()?;
        let walk = views::of_cube(cubes.subject, &cubes.subject.upload(&cubes.dominant)?.0)?;
        let figures = [quadtrees, of_dominant, warped, walk];
        Ok(Self { side: cubes.side, figures, texel_px: cubes.texel_px(), holes })
    }

    fn push(&self, name: &str, table: &mut Table) -> anyhow::Result<()> {
        for (by, figures) in WAYS.into_iter().zip(&self.figures) {
            let holes = (by == WARP).then_some(self.holes * 100.0);
            let more = [Cell::from(self.texel_px), Cell::from(holes)];
            table.push([figures.row(name, &format!("{by}, {}²", self.side)), more.to_vec()].concat())?;
        }
        Ok(())
    }
}

/// Cubes of one scene and side: all surfaces for the paper's ways, those of the dominant axis for the walk.
pub struct Cubes<'s> {
    subject: &'s Subject<'s>,
    side: u32,
    pub all: Cube,
    pub dominant: Cube,
}

impl<'s> Cubes<'s> {
    /// # Errors
    /// The device fails, or the subject's light has highlights.
    pub fn new(subject: &'s Subject<'s>, side: u32) -> anyhow::Result<Self> {
        let [all, dominant] =
            [LayerSelection::All, LayerSelection::Dominant].map(|kept| subject.cube((side, kept), subject.lighting, 1));
        let (all, dominant) = (all?, dominant?);
        ensure!(all.images.iter().all(|image| image.specular.is_none()), "{} has highlights", subject.name);
        Ok(Self { subject, side, all, dominant })
    }

    /// A texel in the middle of the scene, in pixels of the first view.
    fn texel_px(&self) -> f64 {
        let at_m = |view: &PinholeCamera| view.eye_in_world.distance(self.subject.scene.bounds().center());
        let view = self.subject.views.first();
        view.map_or(f64::NAN, |view| f64::from(self.all.grid.spacing_m * view.focal_px.y / at_m(view)))
    }

    /// By quadtrees; rays are shared among the cores.
    fn traced(&self, cube: &Cube) -> anyhow::Result<Figures> {
        let pyramids = Pyramids::new(&cube.images, EPSILON_FACTOR);
        self.figures(cube, |camera| {
            let found = (0..camera.pixel_count())
                .into_par_iter()
                .map(|pixel| pyramids.trace(camera.ray(center(camera, pixel)), camera.near_m));
            let found: Vec<(Option<Hit>, usize)> = found.collect();
            let loads = found.iter().map(|(_, loads)| loads).sum();
            (found.into_iter().map(|(hit, _)| hit).collect(), loads)
        })
    }

    /// By the warp, on one core but for its holes. Gives also their share of the pixels that show a surface: the others of the
    /// background are followed in vain.
    ///
    /// # Errors
    /// Views of other sizes.
    pub fn warped(&self) -> anyhow::Result<(Figures, f64)> {
        let pyramids = Pyramids::new(&self.all.images, EPSILON_FACTOR);
        let mut are_holes = Vec::new();
        let figures = self.figures(&self.all, |camera| {
            let warped = warp(&self.all.images, &pyramids, camera);
            are_holes.extend(warped.is_hole);
            (warped.hits, warped.loads)
        })?;
        let surfaces = self.subject.truths.iter().flat_map(|truth| truth.inverse_depth_per_m.iter().flatten());
        let shown: Vec<bool> =
            are_holes.iter().zip(surfaces).filter(|(_, depth)| **depth > 0.0).map(|(hole, _)| *hole).collect();
        Ok((figures, shown.iter().filter(|hole| **hole).count() as f64 / shown.len() as f64))
    }

    /// Of views by hits and the loads of all their rays.
    fn figures(
        &self,
        cube: &Cube,
        mut hits: impl FnMut(&PinholeCamera) -> (Vec<Option<Hit>>, usize),
    ) -> anyhow::Result<Figures> {
        let start = Instant::now();
        let found: Vec<_> = self.subject.views.iter().map(|camera| (camera, hits(camera))).collect();
        let view_s = start.elapsed().as_secs_f64() / found.len() as f64;
        let rays: usize = found.iter().map(|(camera, _)| camera.pixel_count()).sum();
        let loads: usize = found.iter().map(|(_, (_, loads))| loads).sum();
        let views: Vec<View> = found.iter().map(|(camera, (hits, _))| self.view(cube, camera, hits)).collect();
        let figures = views::figures(&self.subject.truths, &views, view_s)?;
        Ok(Figures { loads: Some(loads as f64 / rays as f64), ..figures })
    }

    fn view(&self, cube: &Cube, camera: &PinholeCamera, hits: &[Option<Hit>]) -> View {
        let background = |pixel| {
            let towards = camera.ray(center(camera, pixel)).direction_in_world.normalize_or_zero();
            self.subject.scene.background.radiance_linear(towards)
        };
        let shown = hits.iter().enumerate().map(|(pixel, hit)| match hit {
            Some(hit) => linear_from_rgb9e5(cube.images[hit.image].color_rgb9e5[hit.sample]),
            None => background(pixel),
        });
        View {
            size_px: camera.size_px,
            srgb8: shown.flat_map(|shown| ToneMapping::NONE.srgb8(shown)).collect(),
            inverse_depth_per_m: Some(hits.iter().map(|hit| hit.map_or(0.0, |hit| hit.t.recip())).collect()),
            provenance: None,
        }
    }
}

fn center(camera: &PinholeCamera, pixel: usize) -> Vec2 {
    let columns = camera.size_px.x as usize;
    Vec2::new((pixel % columns) as f32, (pixel / columns) as f32) + 0.5
}
