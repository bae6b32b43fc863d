//! The paper's Table 1, row by row: its figures beside those of the scenes after its own.

use depth_image::PinholeCamera;
use render::{LayerSelection, Lighting};
use study::{Cell, Table};

use super::baselines::Cubes;
use super::paper::{Column, MB, TABLE_1};
use super::subject::Subject;
use super::{glossy, mirrors, storage};
use crate::failures::stand::Stand;

const SIDE: u32 = 512;
/// The light of the views with highlights and mirrors.
const LIGHT: &str = "shadows";

/// A scene, its views, and the mirrors on a ray's way. `teapot-floor` has no mirror.
struct Views {
    scene: &'static str,
    cameras: fn() -> Vec<PinholeCamera>,
    reflections: &'static [u32],
}

const SCENES: [Views; 3] = [
    Views { scene: mirrors::SCENE, cameras: mirrors::cameras, reflections: &[0, 1, 7] },
    Views { scene: glossy::SCENE, cameras: glossy::cameras, reflections: &[0] },
    Views { scene: "teapot-spheres", cameras: glossy::cameras, reflections: &[0, 1, 7] },
];

/// Table 1, and the table of storage.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, lighting: Lighting) -> anyhow::Result<[Table; 2]> {
    let mut storage = storage::table();
    let mut columns = TABLE_1.to_vec();
    for views in &SCENES {
        columns.push(of_scene(stand, views, lighting, &mut storage)?);
    }
    let names: Vec<String> = columns.iter().map(|column| column.name.to_owned()).collect();
    let heads: Vec<(&str, &str)> = [("", "")].into_iter().chain(names.iter().map(|name| (name.as_str(), ""))).collect();
    let title = format!("Table 1 of the paper, without its light field, beside views of 256×256 from cubes of {SIDE}²");
    let mut table = Table::new(title, &heads);
    for (name, value) in ROWS {
        table.push([Cell::from(name)].into_iter().chain(columns.iter().map(value)))?;
    }
    Ok([table, storage])
}

fn of_scene(stand: &Stand, views: &Views, lighting: Lighting, storage: &mut Table) -> anyhow::Result<Column> {
    let plain = Subject::of_views(stand, views.scene, lighting, |_| (views.cameras)())?;
    let cubes = Cubes::new(&plain, SIDE)?;
    let (warped, holes) = cubes.warped()?;
    let (_, walk_s) = mirrors::walked(&plain, &plain.upload(&cubes.dominant)?.0, 0)?;
    let subject = Subject::of_views(stand, views.scene, LIGHT.parse()?, |_| (views.cameras)())?;
    // The first use of a light builds shaders.
    let cube = subject.cube((SIDE, LayerSelection::Dominant), subject.lighting, 2)?;
    let cube_mb = storage::device_mb(&subject, &cube)?;
    storage.push(storage::row(views.scene, &cubes.all, &cube, cube_mb)?)?;
    let (set, load_s) = subject.upload(&cube)?;
    let (mut view_s, mut direct_s) = ([None; 3], f64::NAN);
    for (view_s, &reflections) in view_s.iter_mut().zip(views.reflections) {
        *view_s = Some(mirrors::walked(&subject, &set, reflections)?.1);
        direct_s = mirrors::direct(&subject, reflections)?.1;
    }
    Ok(Column {
        name: views.scene,
        primitives: subject.scene.triangle_count() as usize,
        cube_mb: cube_mb.unwrap_or(f64::NAN),
        sent_mb: Some(cube.encoded_bytes()? as f64 / MB),
        layers: storage::six_images(&cubes.all.images),
        construction_s: cube.sample_s + load_s,
        warp_s: warped.view_s,
        holes_percent: holes * 100.0,
        walk_s: Some(walk_s),
        pass_s: view_s.map(|view_s| view_s.map(|view_s| view_s - walk_s)),
        view_s,
        direct_s,
    })
}

/// A row's name and its value in a column.
type Row = (&'static str, fn(&Column) -> Cell);

const ROWS: [Row; 18] = [
    ("primitives", |column| column.primitives.into()),
    ("cube, on the device (MB)", |column| column.cube_mb.into()),
    ("cube, sent (MB)", |column| column.sent_mb.into()),
    ("mean layers of six images", |column| column.layers.mean.into()),
    ("most layers of six images", |column| column.layers.most.into()),
    ("construction (s)", |column| column.construction_s.into()),
    ("warp (s)", |column| column.warp_s.into()),
    ("holes of the warp, in the paper less than (%)", |column| column.holes_percent.into()),
    ("walk (s)", |column| column.walk_s.into()),
    ("view-dependent pass, no reflection (s)", |column| column.pass_s[0].into()),
    ("view-dependent pass, 1 reflection (s)", |column| column.pass_s[1].into()),
    ("view-dependent pass, 7 reflections (s)", |column| column.pass_s[2].into()),
    ("view, no reflection (s)", |column| column.view_s[0].into()),
    ("view, 1 reflection (s)", |column| column.view_s[1].into()),
    ("view, 7 reflections (s)", |column| column.view_s[2].into()),
    ("Rayshade, or direct drawing (s)", |column| column.direct_s.into()),
    ("view over it, most reflections", |column| column.over_direct().into()),
    ("construction repaid after (views)", |column| column.repaid().into()),
];
