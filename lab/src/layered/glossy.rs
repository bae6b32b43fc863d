//! Glossy pixels by rays into their lobes, drawn directly and in a cube, and gathered in light fields: error against time.

use depth_image::{LightDirections, PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use reconstruction::Mirrors;
use render::{LayerSelection, Lighting};
use study::{Bar, Cell, Check, Table};

use super::mirrors::{errors, shown, timed};
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

/// The table of all numbers of rays and of directions, and its checks; quick runs leave the most out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool) -> anyhow::Result<(Table, Vec<Check>)> {
    let columns = [("way", ""), ("PSNR", "dB"), ("FLIP", ""), ("a view", "ms"), ("a view without", "ms")];
    let title = format!("Glossy pixels of {SCENE}, against {MOST_RAYS} rays drawn directly");
    let mut table = Table::new(title, &columns);
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let without_s = drawn(&subject, None)?.1;
    let truths = views(&subject, Some(MOST_RAYS))?;
    let glossy: Vec<Vec<bool>> = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let mut row = |way: String, (views, view_s): (Vec<View>, f64), without_s: f64| {
        let [psnr_db, flip] = errors(&truths, &views, &glossy)?;
        let numbers = [psnr_db, flip, view_s * 1e3, without_s * 1e3].map(Cell::from);
        table.push([Cell::from(way)].into_iter().chain(numbers))?;
        anyhow::Ok((psnr_db, view_s))
    };
    let mut checks = Checks::default();
    for &rays in &RAYS[..if is_quick { QUICK } else { RAYS.len() }] {
        let drawn = row(format!("{rays} rays, drawn directly"), drawn(&subject, Some(rays))?, without_s)?;
        checks.few = if rays == FEW_RAYS { Some(drawn) } else { checks.few };
        checks.many = if rays == MANY_RAYS { Some(drawn) } else { checks.many };
    }
    let cube = subject.cube((SIDE, LayerSelection::Dominant), subject.lighting, 1)?;
    let (set, _) = subject.upload(&cube)?;
    let walk_s = shown(&subject, &set, LAYERED, Mirrors::default())?.1;
    for &rays in &RAYS[..if is_quick { QUICK } else { RAYS.len() }] {
        let views = shown(&subject, &set, LAYERED, Mirrors { glossy_rays: rays, ..Mirrors::default() })?;
        row(format!("{rays} rays in a cube"), views, walk_s)?;
    }
    for directions in LightDirections::ALL {
        let field = subject.light_field(directions, lighting(Some(1))?)?.0;
        let set = subject.upload_with(&cube, field)?;
        let views = shown(&subject, &set, LAYERED, Mirrors { glossy_rays: 1, ..Mirrors::default() })?;
        let gathered = row(format!("gathered, {} directions", directions.count()), views, walk_s)?;
        checks.gathered = if directions == LightDirections::D258 { Some(gathered) } else { checks.gathered };
    }
    Ok((table, checks.all()))
}

/// PSNR and seconds of the ways that are compared.
#[derive(Default)]
struct Checks {
    few: Option<(f64, f64)>,
    many: Option<(f64, f64)>,
    gathered: Option<(f64, f64)>,
}

impl Checks {
    fn all(self) -> Vec<Check> {
        let gain = self.gathered.zip(self.few).map(|((gathered_db, _), (few_db, _))| {
            let name = format!("{SCENE}: gathering in 258 directions over {FEW_RAYS} rays");
            Check::new(name, gathered_db - few_db, "dB", Bar::AtLeast(0.0))
        });
        let over = self.gathered.zip(self.many).map(|((_, gathered_s), (_, many_s))| {
            let name = format!("{SCENE}: a view by gathering over direct drawing with {MANY_RAYS} rays");
            Check::new(name, gathered_s / many_s, "", Bar::AtMost(MOST_OF_DIRECT))
        });
        gain.into_iter().chain(over).collect()
    }
}

/// Towards the corner of the room, from left to right.
pub fn cameras() -> Vec<PinholeCamera> {
    let view = |number: usize| {
        let aside = number as f32 - 0.5 * (VIEWS - 1) as f32;
        PinholeCamera::looking_at(Vec3::new(8.0 + aside, 4.5, 8.0 - aside), Vec3::Y, Vec3::Y, 0.7, VIEW_PX)
    };
    (0..VIEWS).map(view).collect()
}

fn views(subject: &Subject<'_>, rays: Option<u32>) -> anyhow::Result<Vec<View>> {
    subject.stand.views(&subject.on_device, lighting(rays)?, &subject.views, ViewPlanes::COLOR)
}

fn lighting(rays: Option<u32>) -> anyhow::Result<Lighting> {
    Ok(rays.map_or(LIGHT.to_owned(), |rays| format!("{LIGHT}, glossy {rays}")).parse()?)
}

fn drawn(subject: &Subject<'_>, rays: Option<u32>) -> anyhow::Result<(Vec<View>, f64)> {
    timed(|| views(subject, rays))
}
