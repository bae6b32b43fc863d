//! Relief textures from images that no pinhole takes: one object's images at many places (Rosen et al., section 6.2).

mod coverage;
mod park;
mod placements;
mod relief;
mod sun;

use anyhow::Context as _;
use depth_image::PinholeCamera;
use glam::UVec2;
use metrics::flip_map;
use report::{Bar, Check, Picture, PictureRow, Report};

use self::coverage::{DISTORTION, IMAGES, SINGLE_POLE};
use self::park::{Park, ParkPicture, ReliefPark, ReliefPicture, shadow_iou};
use self::relief::ReliefImages;
use crate::failures::stand::Stand;
use crate::statistics::median;
use crate::study::{Column, measure_rows, table};

const VIEW_PX: [UVec2; 2] = [UVec2::new(1280, 720), UVec2::new(640, 360)];
/// Numbers of cars, with the paper's frames a second (section 7.2).
const CARS: [(u32, Option<f64>); 6] =
    [(1, Some(51.0)), (10, Some(26.0)), (20, None), (40, Some(14.0)), (160, None), (1200, None)];
/// The numbers of cars whose times are compared.
const FEW: u32 = 10;
const MANY: u32 = 40;
/// More triangles than a ray tree takes.
const MOST: u32 = 1200;
const BARRELS: u32 = 60;
const REPEATS: usize = 3;

/// A park drawn by reliefs of one single pole.
struct ParkRow {
    cars: u32,
    triangles: u64,
    drawn: ReliefPicture,
    view_s: f64,
    sun_map_s: f64,
    paper_frames_per_s: Option<f64>,
}

const COLUMNS: [Column<ParkRow>; 5] = [
    Column::new("cars", |row| row.cars.into()),
    Column::with_unit("triangles", "million", |row| (row.triangles as f64 * 1e-6).into()),
    Column::with_unit("a view", "s", |row| row.view_s.into()),
    Column::with_unit("the sun's map", "s", |row| row.sun_map_s.into()),
    Column::with_unit("the paper's frames", "1/s", |row| row.paper_frames_per_s.into()),
];

/// A park by one kind of images, against rays.
struct ImagesRow {
    park: String,
    images: &'static str,
    flip: f64,
    shadow_iou: f64,
}

const IMAGES_COLUMNS: [Column<ImagesRow>; 4] = [
    Column::new("scene", |row| row.park.as_str().into()),
    Column::new("images", |row| row.images.into()),
    Column::new("FLIP", |row| row.flip.into()),
    Column::new("shadows in both over those in either", |row| row.shadow_iou.into()),
];

/// Adds the parts of reliefs to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    coverage::measure(stand, is_quick, report)?;
    let size_px = VIEW_PX[usize::from(is_quick)];
    by_cars(stand, size_px, report)?;
    let mut rows = Vec::new();
    for park in [Park::of_cars(MANY), Park::of_barrels(BARRELS)] {
        rows.extend(by_images(stand, &park, size_px, report)?);
    }
    if let Some(row) = rows.iter().find(|row| row.images == SINGLE_POLE) {
        let title = format!("{}: shadows by a single pole against rays", row.park);
        report.checks.push(Check::new(title, row.shadow_iou, "", Bar::AtLeast(0.85)));
    }
    report.tables.push(table("Parks by reliefs of equal texels, against rays", &IMAGES_COLUMNS, &rows)?);
    Ok(())
}

fn by_cars(stand: &Stand, size_px: UVec2, report: &mut Report) -> anyhow::Result<()> {
    let rows = measure_rows("parks", CARS, |(cars, paper_frames_per_s)| {
        // Few cars are seen from where many are: they cover fewer pixels.
        let camera = Park::of_cars(cars.max(MANY)).view(size_px);
        park_row(stand, &Park::of_cars(cars), &camera, paper_frames_per_s)
    })?;
    let ratio = find(&rows, MANY)?.view_s / find(&rows, FEW)?.view_s;
    report.checks.push(Check::new("reliefs: time of 40 cars over 10 (the paper: 3.6)", ratio, "×", Bar::AtMost(4.0)));
    let most = &find(&rows, MOST)?.drawn;
    let check = Check::new("car-park:1200 by reliefs: pixels of cars", most.relief_ratio, "", Bar::AtLeast(0.05));
    report.checks.push(check);
    let pictures = vec![picture("car-park:1200 by reliefs", &most.drawn)?];
    report.pictures.push(PictureRow { title: "car-park:1200: 24 million triangles, as reliefs".into(), pictures });
    report.tables.push(table("Parks by reliefs of one single pole: times of the search", &COLUMNS, &rows)?);
    Ok(())
}

fn find(rows: &[ParkRow], cars: u32) -> anyhow::Result<&ParkRow> {
    rows.iter().find(|row| row.cars == cars).context("a park")
}

fn park_row(
    stand: &Stand,
    park: &Park,
    camera: &PinholeCamera,
    paper_frames_per_s: Option<f64>,
) -> anyhow::Result<ParkRow> {
    let reliefs = ReliefPark::new(stand, park, ReliefImages::SinglePole(DISTORTION))?;
    // The first use of a shader builds it.
    let drawn = reliefs.draw(camera)?;
    let mut views_s = Vec::new();
    let mut maps_s = Vec::new();
    for _ in 0..REPEATS {
        let repeated = reliefs.draw(camera)?;
        views_s.push(repeated.view_s);
        maps_s.push(repeated.sun_map_s);
    }
    Ok(ParkRow {
        cars: park.count(),
        triangles: park.triangles(),
        drawn,
        view_s: median(views_s),
        sun_map_s: median(maps_s),
        paper_frames_per_s,
    })
}

fn by_images(stand: &Stand, park: &Park, size_px: UVec2, report: &mut Report) -> anyhow::Result<Vec<ImagesRow>> {
    let camera = park.view(size_px);
    let truth = park.draw_triangles(stand, &camera)?;
    let name = &park.name;
    let mut pictures = vec![picture(&format!("{name} by rays"), &truth)?];
    let rows = measure_rows("parks by images", IMAGES, |(images, kind)| {
        let drawn = ReliefPark::new(stand, park, kind)?.draw(&camera)?.drawn;
        pictures.push(picture(&format!("{name} by {images}"), &drawn)?);
        let flip = flip_map(&truth.view, &drawn.view)?.mean(None)?.context("pixels")?;
        Ok(ImagesRow { park: name.clone(), images, flip, shadow_iou: shadow_iou(&truth, &drawn) })
    })?;
    report.pictures.push(PictureRow { title: format!("{name} (Fig. 2)"), pictures });
    Ok(rows)
}

fn picture(name: &str, drawn: &ParkPicture) -> anyhow::Result<Picture> {
    let view = &drawn.view;
    let image = pictures::rgb(view).context("a picture")?;
    Ok(Picture::new(name, name, image))
}
