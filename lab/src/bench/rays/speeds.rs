//! Rays a second by kind.

use depth_image::{DepthImage, Light, unit_from_oct16};
use glam::{UVec2, Vec3};
use render::{Lighting, SamplePlanes};
use report::{Cell, Report, Table};

use super::subject::{RUNS, Subject};
use crate::bench::timing::in_turn;

/// Rays a pixel and lamp, or of occlusion a pixel, in the lightings below.
const MANY: usize = 16;
/// The lightings that are timed; [`Kind`] has indices into them.
const LIGHTINGS: [&str; 5] = ["unlit", "phong", "shadows", "soft 16", "phong, occlusion 16"];

/// Rays of one kind: their time is that of one lighting less that of another without them.
struct Kind {
    name: &'static str,
    with: usize,
    without: Option<usize>,
    count: fn(&Counts) -> usize,
}

const KINDS: [Kind; 4] = [
    Kind { name: "primary", with: 0, without: None, count: |counts| counts.pixels },
    Kind { name: "shadow", with: 2, without: Some(1), count: |counts| counts.lamps_faced },
    Kind { name: "soft shadow", with: 3, without: Some(1), count: |counts| counts.lamps_faced * MANY },
    Kind { name: "occlusion", with: 4, without: Some(1), count: |counts| counts.surfaces * MANY },
];

/// Origins of rays.
#[derive(Default)]
struct Counts {
    pixels: usize,
    /// Pixels with a surface.
    surfaces: usize,
    /// Lamps whose light reaches the front of a surface, over all surfaces.
    lamps_faced: usize,
}

const SPEEDS: [(&str, &str); 7] = [
    ("rays", ""),
    ("lighting", ""),
    ("less the time of", ""),
    ("traced", "million"),
    ("time", "ms"),
    ("speed of", ""),
    ("speed", "million rays/s"),
];

/// Adds the table; returns primary rays a second on the whole device.
pub(super) fn measure(subject: &Subject<'_>, lamps: &[Light], report: &mut Report) -> anyhow::Result<f64> {
    let lightings = LIGHTINGS.map(str::parse::<Lighting>).into_iter().collect::<Result<Vec<_>, _>>()?;
    let draw = |lighting| subject.draw(lighting, SamplePlanes::default()).map(drop);
    let seconds = in_turn(&lightings, RUNS, draw)?;
    let normals = SamplePlanes { normal: true, ..SamplePlanes::default() };
    let counts = Counts::of(&subject.draw(Lighting::UNLIT, normals)?, lamps);
    let mut table = Table::new(speeds_name(subject), &SPEEDS);
    for kind in &KINDS {
        table.push(kind.row(&counts, &seconds, subject.workers()))?;
    }
    report.tables.push(table);
    Ok(counts.pixels as f64 / KINDS[0].seconds(&seconds))
}

fn speeds_name(subject: &Subject<'_>) -> String {
    let size = subject.cameras.first().map_or(UVec2::ZERO, |camera| camera.size_px);
    let images = subject.cameras.len();
    format!("Rays, depth images of {}x{}: {images} (primary with all that is written and read back)", size.x, size.y)
}

impl Kind {
    fn seconds(&self, of_lightings: &[f64]) -> f64 {
        of_lightings[self.with] - self.without.map_or(0.0, |place| of_lightings[place])
    }

    fn row(&self, counts: &Counts, of_lightings: &[f64], (of, workers): (&str, f64)) -> [Cell; 7] {
        let (rays, seconds) = ((self.count)(counts) as f64, self.seconds(of_lightings));
        [
            self.name.into(),
            LIGHTINGS[self.with].into(),
            self.without.map(|place| LIGHTINGS[place]).into(),
            (rays * 1e-6).into(),
            (seconds * 1e3).into(),
            of.into(),
            (rays / seconds / workers * 1e-6).into(),
        ]
    }
}

impl Counts {
    fn of(images: &[DepthImage], lamps: &[Light]) -> Self {
        let mut counts = Self::default();
        for image in images {
            let size = image.size_px();
            counts.pixels += size.element_product() as usize;
            for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
                let Some(point) = image.sample_in_world(x, y) else { continue };
                let normal =
                    image.normal_oct16.as_ref().map_or(Vec3::ZERO, |n| unit_from_oct16(n[(y * size.x + x) as usize]));
                counts.surfaces += 1;
                counts.lamps_faced += lamps.iter().filter(|lamp| faces(lamp, point, normal)).count();
            }
        }
        counts
    }
}

fn faces(lamp: &Light, point_in_world: Vec3, normal_in_world: Vec3) -> bool {
    let incident = lamp.from_middle(point_in_world);
    normal_in_world.dot(incident.towards_light_in_world) > 0.0 && incident.irradiance_linear.max_element() > 0.0
}
