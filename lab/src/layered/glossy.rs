//! Rays into the lobes of glossy pixels, drawn directly: error against time.

use depth_image::{PinholeCamera, View, ViewPlanes};
use glam::{UVec2, Vec3};
use study::{Cell, Table};

use super::mirrors::{errors, timed};
use super::subject::Subject;
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

/// The table of all numbers of rays.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool) -> anyhow::Result<Table> {
    let columns = [("rays a pixel", ""), ("PSNR", "dB"), ("FLIP", ""), ("a view", "ms"), ("a view without", "ms")];
    let title = format!("Glossy pixels of {SCENE} by rays into their lobes, against {MOST_RAYS} rays");
    let mut table = Table::new(title, &columns);
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let (_, without_s) = drawn(&subject, None)?;
    let truths = views(&subject, Some(MOST_RAYS))?;
    let glossy: Vec<Vec<bool>> = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    for &rays in &RAYS[..if is_quick { QUICK } else { RAYS.len() }] {
        let (views, view_s) = drawn(&subject, Some(rays))?;
        let [psnr_db, flip] = errors(&truths, &views, &glossy)?;
        let numbers = [psnr_db, flip, view_s * 1e3, without_s * 1e3].map(Cell::from);
        table.push([Cell::from(rays)].into_iter().chain(numbers))?;
    }
    Ok(table)
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
    let lighting = rays.map_or(LIGHT.to_owned(), |rays| format!("{LIGHT}, glossy {rays}")).parse()?;
    subject.stand.views(&subject.on_device, lighting, &subject.views, ViewPlanes::COLOR)
}

fn drawn(subject: &Subject<'_>, rays: Option<u32>) -> anyhow::Result<(Vec<View>, f64)> {
    timed(|| views(subject, rays))
}
