//! Surfaces found by triangles or by rays: the renderer's choice beside both times.

use depth_image::{PinholeCamera, ViewPlanes};
use glam::UVec2;
use render::{Choice, Lighting, Visibility};
use report::{Bar, Cell, Check, Report, Table};

use super::subject::{RUNS, Subject};
use crate::bench::timing::in_turn;

/// Sizes of the pictures.
const SIZES_PX: [UVec2; 3] = [UVec2::new(200, 150), UVec2::new(400, 300), UVec2::new(800, 600)];

const CHOICES: [(&str, &str); 7] = [
    ("picture", ""),
    ("by triangles", "ms"),
    ("by rays", "ms"),
    ("chosen", ""),
    ("again by triangles", "ms"),
    ("again by rays", "ms"),
    ("chosen over other", "×"),
];

/// Adds the table and a check: both times are taken again for every size.
pub(super) fn measure(subject: &Subject<'_>, hash: &str, report: &mut Report) -> anyhow::Result<()> {
    let mut table = Table::new("How surfaces are found, one view unlit", &CHOICES);
    let mut worst = 0f64;
    for size_px in SIZES_PX {
        let camera = subject.camera()?.resized(size_px);
        let choice = subject.engine.renderer.choice(&*subject.engine.scene(hash)?, &camera, 0.0)?;
        let again = again(subject, &camera)?;
        worst = worst.max(chosen_over_other(&choice, &again));
        table.push(choice_row(size_px, &choice, &again))?;
    }
    report.tables.push(table);
    let name = "surfaces: time of the chosen way over the other, worst size";
    report.checks.push(Check::new(name, worst, "×", Bar::AtMost(1.0)));
    Ok(())
}

fn choice_row(size_px: UVec2, choice: &Choice, again: &Choice) -> [Cell; 7] {
    let chosen = if choice.rays_are_faster() { Visibility::Rays } else { Visibility::Triangles };
    let ms = |s: f64| Cell::from(s * 1e3);
    [
        format!("{}x{}", size_px.x, size_px.y).into(),
        ms(choice.triangles_s),
        ms(choice.rays_s),
        chosen.to_string().into(),
        ms(again.triangles_s),
        ms(again.rays_s),
        chosen_over_other(choice, again).into(),
    ]
}

fn chosen_over_other(choice: &Choice, again: &Choice) -> f64 {
    let rays_over_triangles = again.rays_s / again.triangles_s;
    if choice.rays_are_faster() { rays_over_triangles } else { rays_over_triangles.recip() }
}

/// Times both ways in turn.
fn again(subject: &Subject<'_>, camera: &PinholeCamera) -> anyhow::Result<Choice> {
    let draw = |visibility| {
        let work = subject.work(Lighting::UNLIT, visibility);
        subject.engine.renderer.draw_views(work, &[*camera], ViewPlanes::default())?;
        Ok(())
    };
    let seconds = in_turn(&[Visibility::Triangles, Visibility::Rays], RUNS, draw)?;
    Ok(Choice { triangles_s: seconds[0], rays_s: seconds[1] })
}
