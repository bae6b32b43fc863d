//! Glossy pixels by rays into their lobes, drawn directly and in a cube, and gathered in light fields: error against time.

use depth_image::{LightDirections, PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use reconstruction::Mirrors;
use render::{LayerSelection, Lighting};
use report::{Axis, Bar, Better, Cell, Check, PictureRow, Report, Table, XyChart};

use super::accuracy::{Reached, over_time};
use super::figures;
use super::mirrors::{drawn, errors, shown};
use super::subject::Subject;
use super::views::LAYERED;
use crate::failures::stand::Stand;
use crate::impostors::changed;

pub const SCENE: &str = "teapot-floor";
/// As in the paper.
const VIEW_PX: UVec2 = UVec2::new(256, 256);
const VIEWS: usize = 3;
const LIGHT: &str = "shadows";
/// Rays a pixel, and those of the reference.
const RAYS: [u32; 5] = [1, 4, 16, 64, 128];
const MOST_RAYS: u32 = 256;
/// Rays of a quick run.
const QUICK: usize = 3;
/// The number of rays a pixel to which gathering in 258 directions is to be equal or better.
const FEW_RAYS: u32 = 4;
/// The number of rays a pixel against which the time of gathering is measured. The bound of the ratio is the paper's, 1/28.
const MANY_RAYS: u32 = 64;
const MOST_OF_DIRECT: f64 = 0.036;
const SIDE: u32 = 512;
/// Pictures show rays of this number, which quick runs have, too.
const PICTURED_RAYS: u32 = 16;
const NOTE: &str =
    "Numbers of rays a pixel and of directions stand beside the points; in a cube rays have the same numbers.";

/// How glossy pixels are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// By this number of rays a pixel, in the scene.
    Drawn(u32),
    /// The same, in a cube.
    InCube(u32),
    Gathered(LightDirections),
}

impl Way {
    /// The name in charts of each kind.
    const KINDS: [&'static str; 3] = ["rays, drawn directly", "rays in a cube", "gathered directions"];

    fn kind(self) -> &'static str {
        Self::KINDS[match self {
            Self::Drawn(_) => 0,
            Self::InCube(_) => 1,
            Self::Gathered(_) => 2,
        }]
    }

    fn count(self) -> u32 {
        match self {
            Self::Drawn(rays) | Self::InCube(rays) => rays,
            Self::Gathered(directions) => directions.count(),
        }
    }

    fn text(self) -> String {
        match self {
            Self::Drawn(_) | Self::InCube(_) => format!("{} {}", self.count(), self.kind()),
            Self::Gathered(_) => format!("gathered, {} directions", self.count()),
        }
    }

    /// What stands beside a point of charts. Points of rays in a cube lie beside those of rays that are drawn directly.
    fn label(self) -> String {
        if matches!(self, Self::InCube(_)) { String::new() } else { self.count().to_string() }
    }
}

/// The errors of a way, the seconds of a view, and one view.
struct Shown {
    way: Way,
    psnr_db: f64,
    flip: f64,
    view_s: f64,
    view: View,
}

/// Adds the table of all numbers of rays and of directions, its checks, charts and pictures; quick runs leave the most rays out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let columns = [("way", ""), ("PSNR", "dB"), ("FLIP", ""), ("a view", "ms"), ("a view without", "ms")];
    let title = format!("Glossy pixels of {SCENE}, against {MOST_RAYS} rays drawn directly");
    let mut table = Table::new(title, &columns);
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let rays = &RAYS[..if is_quick { QUICK } else { RAYS.len() }];
    let truths = stand.views(&subject.on_device, lighting(Some(MOST_RAYS))?, &subject.views, ViewPlanes::COLOR)?;
    let glossy: Vec<Vec<bool>> = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let mut all = Vec::new();
    let mut add = |way: Way, (views, view_s): (Vec<View>, f64), without_s: f64| {
        let [psnr_db, flip] = errors(&truths, &views, &glossy)?;
        let numbers = [psnr_db, flip, view_s * 1e3, without_s * 1e3].map(Cell::from);
        table.push([Cell::from(way.text())].into_iter().chain(numbers))?;
        all.push(Shown { way, psnr_db, flip, view_s, view: figures::middle(&views)?.clone() });
        anyhow::Ok(())
    };
    let without_s = drawn(&subject, lighting(None)?)?.1;
    for &rays in rays {
        add(Way::Drawn(rays), drawn(&subject, lighting(Some(rays))?)?, without_s)?;
    }
    let cube = subject.cube((SIDE, LayerSelection::Dominant), subject.lighting, 1)?;
    let (set, _) = subject.upload(&cube)?;
    let walk_s = shown(&subject, &set, LAYERED, Mirrors::default())?.1;
    let by_rays = |glossy_rays| Mirrors { glossy_rays, ..Mirrors::default() };
    for &rays in rays {
        add(Way::InCube(rays), shown(&subject, &set, LAYERED, by_rays(rays))?, walk_s)?;
    }
    for directions in LightDirections::ALL {
        let field = subject.light_field(directions, lighting(Some(1))?)?.0;
        let (set, _) = subject.upload_with(&cube, field)?;
        add(Way::Gathered(directions), shown(&subject, &set, LAYERED, by_rays(1))?, walk_s)?;
    }
    report.tables.push(table);
    report.checks.extend(checks(&all));
    report.charts.extend(charts(&all).map(Into::into));
    report.pictures.push(picture_row(&all, figures::middle(&truths)?)?);
    Ok(())
}

fn checks(all: &[Shown]) -> impl Iterator<Item = Check> {
    let of = |way: Way| all.iter().find(|shown| shown.way == way);
    let gathered = of(Way::Gathered(LightDirections::D258));
    let gain = gathered.zip(of(Way::Drawn(FEW_RAYS))).map(|(gathered, few)| {
        let name = format!("{SCENE}: gathering in 258 directions over {FEW_RAYS} rays");
        Check::new(name, gathered.psnr_db - few.psnr_db, "dB", Bar::AtLeast(0.0))
    });
    let over = gathered.zip(of(Way::Drawn(MANY_RAYS))).map(|(gathered, many)| {
        let name = format!("{SCENE}: a view by gathering over direct drawing with {MANY_RAYS} rays");
        Check::new(name, gathered.view_s / many.view_s, "", Bar::AtMost(MOST_OF_DIRECT))
    });
    gain.into_iter().chain(over)
}

/// PSNR and FLIP of all ways over the time of a view.
fn charts(all: &[Shown]) -> [XyChart; 2] {
    type Accuracy = (&'static str, Axis, Better, fn(&Shown) -> f64);
    let accuracies: [Accuracy; 2] = [
        ("PSNR", Axis::linear("PSNR", "dB"), Better::High, |shown| shown.psnr_db),
        ("FLIP", Axis::log("FLIP", ""), Better::Low, |shown| shown.flip),
    ];
    accuracies.map(|(quantity, axis, better, of)| {
        let reached = |shown: &Shown| Reached { setting: shown.way.label(), view_s: shown.view_s, accuracy: of(shown) };
        let ways =
            Way::KINDS.map(|kind| (kind, all.iter().filter(|shown| shown.way.kind() == kind).map(reached).collect()));
        over_time((format!("Glossy pixels of {SCENE}: {quantity} over time"), NOTE), (axis, better), ways)
    })
}

fn picture_row(all: &[Shown], truth: &View) -> anyhow::Result<PictureRow> {
    let is_shown = |way: Way| match way {
        Way::Drawn(rays) | Way::InCube(rays) => rays == PICTURED_RAYS,
        Way::Gathered(directions) => directions != LightDirections::D66,
    };
    let ways = all.iter().rev().filter(|shown| is_shown(shown.way)).map(|shown| (shown.way.text(), &shown.view));
    let truth = (format!("{MOST_RAYS} rays, drawn directly"), truth);
    figures::row(("5", "A teapot on a glossy floor"), ways.chain([truth]))
}

/// Towards the corner of the room, from left to right.
pub fn cameras() -> Vec<PinholeCamera> {
    let view = |number: usize| {
        let aside = number as f32 - 0.5 * (VIEWS - 1) as f32;
        PinholeCamera::looking_at(Vec3::new(8.0 + aside, 4.5, 8.0 - aside), Vec3::Y, Vec3::Y, 0.7, VIEW_PX)
    };
    (0..VIEWS).map(view).collect()
}

fn lighting(rays: Option<u32>) -> anyhow::Result<Lighting> {
    Ok(rays.map_or(LIGHT.to_owned(), |rays| format!("{LIGHT}, glossy {rays}")).parse()?)
}
