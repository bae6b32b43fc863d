//! Whether ends at grazing surfaces should fade (Rosen et al., section 7.1): the paper blends a sample with what is behind it where
//! the camera's ray is nearly tangential to the surface.

use depth_image::{Camera, ProvenanceKind};
use glam::Vec3;
use reconstruction::{RayEnd, RayWork};
use report::{Cell, Table};

use super::found::{LEAST_ERROR, SIDE_PX, squared_error};
use super::teapot::{NEAR_M, Rays, Teapot};

/// Of the image that is followed.
const DISTORTION_PX: f32 = 120.0;
/// The cosine below which ends fade.
const FADES_BELOW: f32 = 0.15;
/// Upper bounds of the rows' cosines.
const COSINES: [f32; 5] = [0.05, 0.1, FADES_BELOW, 0.3, 1.0];

/// Ends of one range of cosines.
#[derive(Debug, Clone, Copy, Default)]
struct Ends {
    count: usize,
    /// Ends of rays that meet nothing.
    stray: usize,
    error: f64,
    faded_error: f64,
}

/// Colours at the ends of rays, faded and not, by the cosine between the camera's ray and the surface.
///
/// # Errors
/// The device fails.
pub fn measure(teapot: &Teapot<'_>, rays: &Rays) -> anyhow::Result<Table> {
    let camera = Camera::SinglePole(teapot.camera(rays.middle, DISTORTION_PX, SIDE_PX));
    let set = teapot.set(&[camera])?;
    let work = RayWork::new(&set, NEAR_M);
    let (ends, _) = teapot.stand.reconstructor().follow(work, &rays.rays)?;
    let mut rows = COSINES.map(|_| Ends::default());
    for ((ray, end), truth) in rays.rays.iter().zip(&ends).zip(&rays.truth) {
        if end.kind != ProvenanceKind::Hit {
            continue;
        }
        let cosine = camera.project(ray.at(end.way_m)).and_then(|at| teapot.facing(&camera.ray(at.pixel)));
        // The camera's own ray misses the edge beside which this one ends.
        let cosine = cosine.unwrap_or(0.0);
        let Some(row) = COSINES.iter().position(|most| cosine <= *most) else { continue };
        let faded = end.color_linear * (cosine / FADES_BELOW).min(1.0);
        let truth_linear = truth.map_or(Vec3::ZERO, |(_, color_linear)| color_linear);
        let ends = &mut rows[row];
        ends.count += 1;
        ends.stray += usize::from(truth.is_none());
        ends.error += squared_error(end, truth_linear);
        ends.faded_error += squared_error(&RayEnd { color_linear: faded, ..*end }, truth_linear);
    }
    table(&rows)
}

fn table(rows: &[Ends]) -> anyhow::Result<Table> {
    let columns = [
        ("cosine, at most", ""),
        ("ends", ""),
        ("of rays that meet nothing", "%"),
        ("PSNR", "dB"),
        ("PSNR, faded", "dB"),
    ];
    let mut table = Table::new("Ends at grazing surfaces in a single-pole image, as they are and faded", &columns);
    for (most, ends) in COSINES.iter().zip(rows).filter(|(_, ends)| ends.count > 0) {
        let count = ends.count as f64;
        let psnr_db = |error: f64| -10.0 * (error / count).max(LEAST_ERROR).log10();
        let numbers = [100.0 * ends.stray as f64 / count, psnr_db(ends.error), psnr_db(ends.faded_error)];
        table.push([Cell::from(f64::from(*most)), ends.count.into()].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}
