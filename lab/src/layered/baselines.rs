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
use report::{Bar, Check, Report};

use super::pyramid::{Hit, Pyramids};
use super::subject::{Cube, Subject};
use super::views::{self, Figures};
use super::warp::warp;
use crate::failures::stand::Stand;
use crate::impostors::around;
use crate::study::{Column, measure_rows, table};

/// A quick run has the first alone.
const SCENES: [&str; 4] = ["bird-nest", "mirror-box", "teapot-spheres", "tree"];
const VIEWS: usize = 3;
const SIDE: u32 = 512;
/// Bounds beside the quadtrees: wrong hits as a share of theirs. PSNR above both of the paper's ways.
const MOST_WRONG_HITS: f64 = 0.4;
const LEAST_GAIN_DB: f64 = 3.0;

/// A way to make views of a scene.
struct WayRow {
    scene: &'static str,
    way: &'static str,
    figures: Figures,
    /// The share of holes of the warp.
    holes: Option<f64>,
}

const COLUMNS: [Column<WayRow>; 9] = [
    Column::new("scene", |row| row.scene.into()),
    Column::new("views by", |row| row.way.into()),
    Column::with_unit("PSNR", "dB", |row| row.figures.psnr_db.into()),
    Column::new("FLIP", |row| row.figures.flip.into()),
    Column::with_unit("wrong hits", "%", |row| (row.figures.wrong_hits * 100.0).into()),
    Column::with_unit("missed", "%", |row| (row.figures.missed * 100.0).into()),
    Column::new("loads a ray", |row| row.figures.loads.into()),
    Column::with_unit("a view", "ms", |row| (row.figures.view_s * 1e3).into()),
    Column::with_unit("holes", "%", |row| row.holes.map(|share| share * 100.0).into()),
];

/// Adds the table of all scenes, and its checks.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let scenes = &SCENES[..if is_quick { 1 } else { SCENES.len() }];
    let ways = measure_rows("the paper's ways", scenes, |&scene| Ways::measure(stand, scene))?;
    report.checks.extend(ways.iter().flat_map(Ways::checks));
    let rows: Vec<WayRow> = ways.into_iter().flat_map(Ways::rows).collect();
    report.tables.push(table(format!("The paper's ways beside the walk, cubes of {SIDE}²"), &COLUMNS, &rows)?);
    Ok(())
}

/// All ways to views of a scene.
struct Ways {
    scene: &'static str,
    /// Quadtrees of all surfaces.
    pyramid: Figures,
    /// Quadtrees of the samples that the walk has.
    dominant_pyramid: Figures,
    warp: Figures,
    holes: f64,
    walk: Figures,
}

impl Ways {
    fn measure(stand: &Stand, scene: &'static str) -> anyhow::Result<Self> {
        let subject = Subject::of_views(stand, scene, Lighting::default(), |bounds| around(bounds, VIEWS))?;
        let cubes = Cubes::new(&subject, SIDE)?;
        let (warp, holes) = cubes.warped()?;
        Ok(Self {
            scene,
            pyramid: cubes.traced(&cubes.all)?,
            dominant_pyramid: cubes.traced(&cubes.dominant)?,
            warp,
            holes,
            walk: views::of_cube(&subject, &subject.upload(&cubes.dominant, None)?.0)?,
        })
    }

    fn rows(self) -> [WayRow; 4] {
        [
            ("pyramid", self.pyramid, None),
            ("pyramid, dominant axis", self.dominant_pyramid, None),
            ("warp", self.warp, Some(self.holes)),
            ("layered", self.walk, None),
        ]
        .map(|(way, figures, holes)| WayRow { scene: self.scene, way, figures, holes })
    }

    fn checks(&self) -> [Check; 3] {
        let Self { pyramid, warp, walk, .. } = self;
        let wrong_hits = walk.wrong_hits / pyramid.wrong_hits;
        let [over_quadtrees_db, over_warp_db] = [pyramid, warp].map(|way| walk.psnr_db - way.psnr_db);
        [
            ("wrong hits of a walk over quadtrees", wrong_hits, "", Bar::AtMost(MOST_WRONG_HITS)),
            ("PSNR of a walk over quadtrees", over_quadtrees_db, "dB", Bar::AtLeast(LEAST_GAIN_DB)),
            ("PSNR of a walk over the warp", over_warp_db, "dB", Bar::AtLeast(LEAST_GAIN_DB)),
        ]
        .map(|(what, value, unit, bar)| Check::new(format!("{}: {what}", self.scene), value, unit, bar))
    }
}

/// Cubes of one scene and side: all surfaces for the paper's ways, those of the dominant axis for the walk.
pub struct Cubes<'s> {
    subject: &'s Subject<'s>,
    pub all: Cube,
    pub dominant: Cube,
}

impl<'s> Cubes<'s> {
    /// # Errors
    /// The device fails, or the subject's light has highlights.
    pub fn new(subject: &'s Subject<'s>, side: u32) -> anyhow::Result<Self> {
        let all = subject.cube(side, LayerSelection::All, subject.lighting, 1)?;
        let dominant = subject.cube(side, LayerSelection::Dominant, subject.lighting, 1)?;
        ensure!(all.images.iter().all(|image| image.specular.is_none()), "{} has highlights", subject.name);
        Ok(Self { subject, all, dominant })
    }

    /// By quadtrees; rays are shared among the cores.
    fn traced(&self, cube: &Cube) -> anyhow::Result<Figures> {
        let pyramids = Pyramids::new(&cube.images);
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
        let pyramids = Pyramids::new(&self.all.images);
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
        let shown = hits.iter().enumerate().map(|(pixel, hit)| match hit {
            Some(hit) => linear_from_rgb9e5(cube.images[hit.image].color_rgb9e5[hit.sample]),
            None => {
                let towards = camera.ray(center(camera, pixel)).direction_in_world.normalize_or_zero();
                self.subject.scene.background.radiance_linear(towards)
            }
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
