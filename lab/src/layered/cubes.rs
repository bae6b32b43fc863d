//! What cubes hold and cost: samples, layers and seconds, with all surfaces of each line and with those of the dominant axis.

use depth_image::LayeredDepthImage;
use render::{LayerSelection, Lighting};
use report::{Bar, Cell, Check, Table};

use super::subject::{Cube, Subject};
use super::views;
use crate::failures::measures::not_held;

/// The greatest share of the samples of all surfaces that those of the dominant axis may be.
const MOST_SHARE: [(&str, f64); 4] = [("tree", 0.75), ("grass", 0.75), ("tree-terrain-500k", 0.75), ("bird-nest", 0.8)];
/// For other scenes.
const MOST_SHARE_ELSEWHERE: f64 = 1.0;
/// The scene whose layers are timed, and the bound of their seconds without light.
const TIMED: (&str, f64) = ("tree-terrain-500k", 1.0);
/// What a ray meets farther than this behind a surface is another one, in spacings.
const BEHIND: f32 = 4.0;
/// Percent points by which the pixels that samples of the dominant axis do not hold may exceed those of all surfaces.
const MORE_NOT_HELD: f64 = 0.05;
/// Times that a cube is sampled; the fastest counts.
const TIMES: usize = 3;

pub fn table() -> Table {
    let columns = [
        ("scene", ""),
        ("triangles", ""),
        ("samples of all surfaces", ""),
        ("samples", ""),
        ("share", ""),
        ("mean layers", ""),
        ("most layers", ""),
        ("not held by all surfaces", "%"),
        ("not held", "%"),
        ("layers", "s"),
        ("with light", "s"),
        ("load", "s"),
        ("sent a sample", "B"),
    ];
    Table::new("Cubes: samples on the lines along three axes, and seconds", &columns)
}

/// A row of the table, one of views with all surfaces, and the checks. Gives the cube with the light of the study.
///
/// # Errors
/// The device fails.
pub fn measure(
    subject: &Subject<'_>,
    side: u32,
    (table, seen): (&mut Table, &mut Table),
) -> anyhow::Result<(Cube, Vec<Check>)> {
    let all = subject.cube((side, LayerSelection::All), subject.lighting, 1)?;
    let by_all = views::of_cube(subject, &subject.upload(&all)?.0)?;
    seen.push(by_all.row(subject.name, &format!("layered, {side}², all surfaces")))?;
    let layers = subject.cube((side, LayerSelection::Dominant), Lighting::UNLIT, TIMES)?;
    // The first use of a light builds shaders.
    let cube = subject.cube((side, LayerSelection::Dominant), subject.lighting, 2)?;
    drop(subject.upload(&cube)?);
    let load_s = subject.upload(&cube)?.1;
    let [not_held_by_all, not_held] = [not_held_percent(subject, &all)?, not_held_percent(subject, &cube)?];
    let share = cube.samples() as f64 / all.samples() as f64;
    let lines: usize = cube.images.iter().map(|image| image.camera.pixel_count()).sum();
    let most_layers = all.images.iter().map(LayeredDepthImage::layer_count).max().unwrap_or(0);
    table.push([
        Cell::from(subject.name),
        Cell::from(subject.scene.triangle_count() as usize),
        Cell::from(all.samples()),
        Cell::from(cube.samples()),
        Cell::from(share),
        Cell::from(all.samples() as f64 / lines as f64),
        Cell::from(most_layers),
        Cell::from(not_held_by_all),
        Cell::from(not_held),
        Cell::from(layers.sample_s),
        Cell::from(cube.sample_s),
        Cell::from(load_s),
        Cell::from(cube.encoded_bytes()? as f64 / cube.samples() as f64),
    ])?;
    let bar = MOST_SHARE.iter().find(|(name, _)| *name == subject.name).map_or(MOST_SHARE_ELSEWHERE, |(_, bar)| *bar);
    let of = |what: &str| format!("{}: {what} those of all surfaces", subject.name);
    let mut checks = vec![
        Check::new(of("samples over"), share, "", Bar::AtMost(bar)),
        Check::new(of("pixels not held beyond"), not_held - not_held_by_all, "%", Bar::AtMost(MORE_NOT_HELD)),
    ];
    if subject.name == TIMED.0 {
        let name = format!("{}: layers of a cube of {side}², without light", subject.name);
        checks.push(Check::new(name, layers.sample_s, "s", Bar::AtMost(TIMED.1)));
    }
    Ok((cube, checks))
}

/// Percent of the pixels with a surface in which the walk meets nothing, or something clearly behind it.
fn not_held_percent(subject: &Subject<'_>, cube: &Cube) -> anyhow::Result<f64> {
    let views = views::made(subject, &subject.upload(cube)?.0, &subject.views, views::LAYERED)?;
    Ok(100.0 * not_held(&subject.truths, &views, BEHIND * cube.grid.spacing_m))
}
