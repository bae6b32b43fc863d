//! What a compositor pulls for viewers in many places: one cube for all, or the images of their view cells.

use gpu::Turn;
use std::time::Instant;

use anyhow::Context as _;
use codec::{PlaneSet, encode_depth_image};
use depth_image::{Aabb, Camera, DepthImage, PinholeCamera, View, ViewGroup, ViewPlanes, nearest_set};
use glam::{UVec2, Vec3};
use metrics::{PictureErrors, Rgb8Image};
use reconstruction::{ReconstructRequest, ReconstructionMethod, SampleSet};
use render::LayerSelection;
use report::{Axis, Bar, Cell, Check, Series, Table, XyChart};

use super::subject::{Cube, Subject};
use super::views::{LAYERED, PLAIN};
use crate::failures::stage::CARVE;

/// Numbers of viewpoints. A quick run has no more than the first four.
pub const COUNTS: [usize; 5] = [1, 4, 16, 64, 256];
/// The number, over a hemisphere, at which the bytes of a cube have a bound, as a share of those of cells.
const BOUNDED: (usize, f64) = (64, 0.5);
/// The views that are made at most, evenly among the viewpoints.
const COMPARED: usize = 12;
/// Sides of cubes. The smallest that is nearly as good as the cells counts, or else the largest.
const SIDES: [u32; 4] = [128, 256, 512, 1024];
/// How much worse a cube's views may be.
const WORSE_DB: f64 = 1.0;
/// The size of views; sample images have twice as many columns and rows.
const VIEW_PX: UVec2 = UVec2::new(200, 150);

/// Where viewers are.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Places {
    Ring,
    Hemisphere,
    /// On a walk through the scene's middle, looking ahead.
    Inside,
}

impl Places {
    const ALL: [Self; 3] = [Self::Ring, Self::Hemisphere, Self::Inside];

    fn name(self) -> &'static str {
        match self {
            Self::Ring => "on a ring",
            Self::Hemisphere => "over a hemisphere",
            Self::Inside => "walking inside",
        }
    }

    fn view(self, bounds: &Aabb, number: usize, count: usize) -> PinholeCamera {
        let share = number as f32 / count as f32;
        let (middle, size) = (bounds.center(), bounds.size());
        let radius_m = 0.55 * size.x.hypot(size.z);
        let turn =
            |turns: f32| Vec3::new((std::f32::consts::TAU * turns).sin(), 0.0, (std::f32::consts::TAU * turns).cos());
        let (eye, target) = match self {
            Self::Ring => (middle + turn(share) * radius_m + Vec3::Y * (0.6 * size.y), middle),
            Self::Hemisphere => {
                // Heights evenly, turns by the golden ratio.
                let up = 0.1 + 0.85 * share;
                let place = turn(number as f32 * 0.618_034) * (1.0 - up * up).sqrt() + Vec3::Y * up;
                (middle + place * radius_m, middle)
            }
            Self::Inside => {
                let at = |share: f32| middle + turn(share) * (0.2 * size.x.min(size.z)) + Vec3::Y * (0.2 * size.y);
                (at(share), at(share + 0.1))
            }
        };
        PinholeCamera::looking_at(eye, target, Vec3::Y, 0.5, VIEW_PX)
    }

    fn views(self, bounds: &Aabb, count: usize) -> Vec<PinholeCamera> {
        (0..count).map(|number| self.view(bounds, number, count)).collect()
    }
}

/// What serves the viewpoints, and how well.
struct Served {
    bytes: usize,
    sample_s: f64,
    psnr_db: f64,
}

pub fn table() -> Table {
    let columns = [
        ("scene", ""),
        ("viewpoints", ""),
        ("number", ""),
        ("cells", ""),
        ("pulled for cells", "MB"),
        ("sampled", "s"),
        ("PSNR", "dB"),
        ("side of the cube", ""),
        ("pulled for it", "MB"),
        ("sampled", "s"),
        ("PSNR", "dB"),
        ("bytes over those of cells", ""),
    ];
    Table::new("Bytes that a compositor pulls, and seconds of sampling, for viewers in many places", &columns)
}

/// Rows of the table for one scene, its chart, and the checks at its bound.
///
/// # Errors
/// The device fails.
pub fn measure(subject: &Subject<'_>, counts: &[usize], table: &mut Table) -> anyhow::Result<(XyChart, Vec<Check>)> {
    let cubes = SIDES.iter().map(|&side| {
        let cube = subject.cube((side, LayerSelection::Dominant), subject.lighting, 1)?;
        Ok((side, cube.encoded_bytes()?, cube))
    });
    let cubes = cubes.collect::<anyhow::Result<Vec<(u32, usize, Cube)>>>()?;
    let name = format!("Bytes pulled, {}", subject.name);
    let mut chart = XyChart::new(name, Axis::log("viewpoints", ""), Axis::log("pulled by a compositor", "MB"));
    let mut checks = Vec::new();
    for places in Places::ALL {
        let (mut of_cells, mut of_cube) = (Vec::new(), Vec::new());
        for &count in counts {
            let [bytes, ratio, worse_db] = row(subject, (places, count), &cubes, table)?;
            of_cells.push((count as f64, bytes / 1e6));
            of_cube.push((count as f64, ratio * bytes / 1e6));
            if (places, count) == (Places::Hemisphere, BOUNDED.0) {
                let name = format!("{}: bytes of a cube over those of cells, {count} viewpoints", subject.name);
                checks.push(Check::new(name, ratio, "", Bar::AtMost(BOUNDED.1)));
                let name = format!("{}: PSNR of cells over that of this cube", subject.name);
                checks.push(Check::new(name, worse_db, "dB", Bar::AtMost(WORSE_DB)));
            }
        }
        chart = chart.with(Series::line(format!("cells, {}", places.name()), of_cells));
        chart = chart.with(Series::line(format!("cube, {}", places.name()), of_cube));
    }
    Ok((chart, checks))
}

/// One row. Gives the bytes of the cells, those of the cube over them, and by how many dB the cube is worse.
fn row(
    subject: &Subject<'_>,
    (places, count): (Places, usize),
    cubes: &[(u32, usize, Cube)],
    table: &mut Table,
) -> anyhow::Result<[f64; 3]> {
    let views = places.views(&subject.scene.bounds(), count);
    let compared: Vec<PinholeCamera> = views.iter().step_by(count.div_ceil(COMPARED)).copied().collect();
    let truths = subject.stand.views(&subject.on_device, subject.lighting, &compared, ViewPlanes::WITH_DEPTH)?;
    let (cells, served) = of_cells(subject, &views, (&compared, &truths))?;
    let mut best = None;
    for (side, bytes, cube) in cubes {
        let set = subject.upload(cube)?.0;
        let psnr_db = mean_psnr_db(&made(subject, &set, &compared, LAYERED)?, &truths)?;
        best = Some((*side, Served { bytes: *bytes, sample_s: cube.sample_s, psnr_db }));
        if psnr_db > served.psnr_db - WORSE_DB {
            break;
        }
    }
    let (side, cube) = best.context("a cube")?;
    let ratio = cube.bytes as f64 / served.bytes as f64;
    let numbers = |served: &Served| [served.bytes as f64 / 1e6, served.sample_s, served.psnr_db].map(Cell::from);
    let first = [Cell::from(subject.name), Cell::from(places.name()), Cell::from(count), Cell::from(cells)];
    let cells = first.into_iter().chain(numbers(&served)).chain([Cell::from(side)]);
    table.push(cells.chain(numbers(&cube)).chain([Cell::from(ratio)]).collect::<Vec<_>>())?;
    Ok([served.bytes as f64, ratio, served.psnr_db - cube.psnr_db])
}

/// The view cells of viewpoints, as a cluster places them, and what they bring.
fn of_cells(
    subject: &Subject<'_>,
    views: &[PinholeCamera],
    (compared, truths): (&[PinholeCamera], &[View]),
) -> anyhow::Result<(usize, Served)> {
    let bounds = subject.scene.bounds();
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, views, &bounds);
    let cells: Vec<Vec<PinholeCamera>> = groups.iter().map(|group| group.sample_cameras(2 * VIEW_PX)).collect();
    let (mut bytes, mut sample_s) = (0, 0.0);
    let nearest = |view: &PinholeCamera| nearest_set(view, cells.iter().cloned(), &bounds).unwrap_or(0);
    let places: Vec<usize> = compared.iter().map(nearest).collect();
    let mut made_views = vec![None; compared.len()];
    for (number, cell) in cells.iter().enumerate() {
        let start = Instant::now();
        let cameras: Vec<Camera> = cell.iter().copied().map(Into::into).collect();
        let images = subject.stand.images(&subject.on_device, subject.lighting, &cameras, PLAIN)?;
        sample_s += start.elapsed().as_secs_f64();
        bytes += encoded_bytes(&images)?;
        let own: Vec<usize> = (0..compared.len()).filter(|&view| places[view] == number).collect();
        if own.is_empty() {
            continue;
        }
        let set = subject.stand.reconstructor().upload(&images, &subject.description(), Turn::default())?;
        let cameras: Vec<PinholeCamera> = own.iter().map(|&view| compared[view]).collect();
        own.iter().zip(made(subject, &set, &cameras, CARVE)?).for_each(|(&at, view)| made_views[at] = Some(view));
    }
    let made_views: Vec<View> = made_views.into_iter().flatten().collect();
    Ok((cells.len(), Served { bytes, sample_s, psnr_db: mean_psnr_db(&made_views, truths)? }))
}

fn encoded_bytes(images: &[DepthImage]) -> anyhow::Result<usize> {
    let bytes = |image| Ok(encode_depth_image(image, PlaneSet::ALL)?.payload.len());
    images.iter().map(bytes).sum()
}

fn made(
    subject: &Subject<'_>,
    set: &SampleSet,
    cameras: &[PinholeCamera],
    method: ReconstructionMethod,
) -> anyhow::Result<Vec<View>> {
    Ok(subject.stand.reconstructor().reconstruct(ReconstructRequest::new(set, cameras, method))?)
}

fn mean_psnr_db(views: &[View], truths: &[View]) -> anyhow::Result<f64> {
    let psnr_db = |(view, truth): (&View, &View)| -> anyhow::Result<f64> {
        Ok(PictureErrors::of(truth, &Rgb8Image::of_view(view)?)?[0].psnr_db)
    };
    let sum: f64 = views.iter().zip(truths).map(psnr_db).sum::<anyhow::Result<f64>>()?;
    Ok(sum / views.len().max(1) as f64)
}
