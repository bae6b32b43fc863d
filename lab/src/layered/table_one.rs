//! The paper's Table 1, row by row: its figures beside those of the scenes after its own.

use codec::encode_light_field;
use depth_image::{LightDirections, PinholeCamera, View};
use reconstruction::{Mirrors, ReconstructionMethod};
use render::{LayerSelection, Lighting};
use report::{Cell, PictureRow, Report, Table};

use super::baselines::Cubes;
use super::mirrors::TimedViews;
use super::paper::{Column, Layers, LightField, MB, TABLE_1};
use super::subject::Subject;
use super::views::LAYERED;
use super::{figures, glossy, mirrors, storage};
use crate::failures::stand::Stand;
use crate::study::measure_rows;

const SIDE: u32 = 512;
/// The light of surfaces.
const LIGHT: &str = "shadows";
/// Reflections that are followed before what the next one shows is gathered; in the end all are followed.
const FOLLOWED: [Option<u32>; 3] = [Some(0), Some(1), None];

/// A scene and its views.
struct Views {
    scene: &'static str,
    cameras: fn() -> Vec<PinholeCamera>,
    /// Of the light field: as many as the paper's.
    directions: LightDirections,
    /// What surfaces show, in direct drawing and in the light field.
    lighting: &'static str,
    /// The same, from a cube. Rays of rough surfaces are gathered, whatever their number.
    mirrors: Mirrors<'static>,
    followed: &'static [Option<u32>],
}

const ALL_MIRRORS: Mirrors<'_> = Mirrors { cells: &[], reflections: 7, glossy_rays: 0 };

/// The floor of `teapot-floor` is gathered at once.
const SCENES: [Views; 3] = [
    Views {
        scene: mirrors::SCENE,
        cameras: mirrors::cameras,
        directions: LightDirections::D258,
        lighting: "shadows, reflections 7",
        mirrors: ALL_MIRRORS,
        followed: &FOLLOWED,
    },
    Views {
        scene: glossy::SCENE,
        cameras: glossy::cameras,
        directions: LightDirections::D1026,
        lighting: "shadows, glossy 16",
        mirrors: Mirrors { cells: &[], reflections: 0, glossy_rays: 16 },
        followed: &[None],
    },
    Views {
        scene: PICTURED,
        cameras: glossy::cameras,
        directions: LightDirections::D66,
        lighting: "shadows, reflections 7",
        mirrors: ALL_MIRRORS,
        followed: &FOLLOWED,
    },
];
/// The scene of the paper's figure 6.
const PICTURED: &str = "teapot-spheres";

/// Adds Table 1, and pictures.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, report: &mut Report) -> anyhow::Result<()> {
    let measured = measure_rows("Table 1", &SCENES, |views| views.measure(stand, report))?;
    let columns = [TABLE_1.to_vec(), measured].concat();
    let heads: Vec<(&str, &str)> = [("", "")].into_iter().chain(columns.iter().map(|of| (of.name, ""))).collect();
    let lines = LightField::LINES;
    let title =
        format!("Table 1 of the paper, beside views of 256×256 from cubes of {SIDE}² and light fields of {lines}²");
    let mut table = Table::new(title, &heads);
    for (name, value) in ROWS {
        table.push([Cell::from(name)].into_iter().chain(columns.iter().map(value)))?;
    }
    report.tables.push(table);
    Ok(())
}

/// The warp and the walk of a cube in plain light.
struct Plain {
    layers: Layers,
    warp_s: f64,
    holes: f64,
    walk_s: f64,
}

impl Views {
    fn measure_plain(&self, stand: &Stand) -> anyhow::Result<Plain> {
        let subject = Subject::of_views(stand, self.scene, Lighting::default(), |_| (self.cameras)())?;
        let cubes = Cubes::new(&subject, SIDE)?;
        let (warped, holes) = cubes.warped()?;
        let set = subject.upload(&cubes.dominant, None)?.0;
        let walk = TimedViews::of_cube(&subject, &set, LAYERED, Mirrors::default())?;
        let layers = storage::six_images(&cubes.all.images);
        Ok(Plain { layers, warp_s: warped.view_s, holes, walk_s: walk.view_s })
    }

    fn measure(&self, stand: &Stand, report: &mut Report) -> anyhow::Result<Column> {
        let plain = self.measure_plain(stand)?;
        let subject = Subject::of_views(stand, self.scene, LIGHT.parse()?, |_| (self.cameras)())?;
        // The first use of a light builds shaders.
        let cube = subject.cube(SIDE, LayerSelection::Dominant, subject.lighting, 2)?;
        let (field, field_s) = subject.light_field(self.directions, self.lighting.parse()?)?;
        let [cube_mb, field_mb] = storage::device_mb(&subject, &cube, &field)?;
        let light_field = LightField {
            directions: self.directions.count(),
            mb: field_mb,
            samples: Some(field.sample_count()),
            sent_mb: Some(encode_light_field(&field)?.payload.len() as f64 / MB),
            construction_s: Some(field_s),
        };
        let (set, load_s) = subject.upload(&cube, Some(field))?;
        let mut view_s = [None; 3];
        let mut shown = Vec::new();
        for (view_s, &followed) in view_s.iter_mut().zip(self.followed) {
            let method = ReconstructionMethod::Layered { followed };
            let timed = TimedViews::of_cube(&subject, &set, method, self.mirrors)?;
            *view_s = Some(timed.view_s);
            shown.push(mirrors::middle(&timed.views)?.clone());
        }
        let direct = TimedViews::drawn(&subject, self.lighting.parse()?)?;
        if self.scene == PICTURED {
            report.pictures.push(picture_row(self, &shown, mirrors::middle(&direct.views)?)?);
        }
        Ok(Column {
            name: self.scene,
            primitives: subject.scene.triangle_count() as usize,
            cube_mb,
            sent_mb: Some(cube.encoded_bytes()? as f64 / MB),
            layers: plain.layers,
            light_field,
            construction_s: cube.sample_s + field_s + load_s,
            warp_s: plain.warp_s,
            holes_percent: plain.holes * 100.0,
            walk_s: Some(plain.walk_s),
            pass_s: view_s.map(|view_s| view_s.map(|view_s| view_s - plain.walk_s)),
            view_s,
            direct_s: direct.view_s,
        })
    }
}

fn picture_row(views: &Views, shown: &[View], drawn: &View) -> anyhow::Result<PictureRow> {
    let directions = views.directions.count();
    let captions = [
        format!("gathered in {directions} directions"),
        format!("one ray, then gathered in {directions} directions"),
        "seven rays".to_owned(),
    ];
    let drawn = ("drawn directly".to_owned(), drawn);
    figures::row(6, "A teapot and spheres", captions.into_iter().zip(shown).chain([drawn]))
}

/// A row's name and its value in a column.
type Row = (&'static str, fn(&Column) -> Cell);

const ROWS: [Row; 24] = [
    ("primitives", |column| column.primitives.into()),
    ("cube, on the device (MB)", |column| column.cube_mb.into()),
    ("cube, sent (MB)", |column| column.sent_mb.into()),
    ("mean layers of six images", |column| column.layers.mean.into()),
    ("most layers of six images", |column| column.layers.most.into()),
    ("light field: directions", |column| column.light_field.directions.into()),
    ("light field: samples", |column| column.light_field.samples.into()),
    ("light field, on the device (MB)", |column| column.light_field.mb.into()),
    ("light field, on the device, a line (B)", |column| column.light_field.bytes_a_line().into()),
    ("light field, sent (MB)", |column| column.light_field.sent_mb.into()),
    ("construction of both (s)", |column| column.construction_s.into()),
    ("of it sampling the light field (s)", |column| column.light_field.construction_s.into()),
    ("warp (s)", |column| column.warp_s.into()),
    ("holes of the warp, in the paper less than (%)", |column| column.holes_percent.into()),
    ("walk (s)", |column| column.walk_s.into()),
    ("view-dependent pass, gathering (s)", |column| column.pass_s[0].into()),
    ("view-dependent pass, 1 reflection, then gathering (s)", |column| column.pass_s[1].into()),
    ("view-dependent pass, 7 reflections (s)", |column| column.pass_s[2].into()),
    ("view, gathering (s)", |column| column.view_s[0].into()),
    ("view, 1 reflection, then gathering (s)", |column| column.view_s[1].into()),
    ("view, 7 reflections (s)", |column| column.view_s[2].into()),
    ("Rayshade, or direct drawing (s)", |column| column.direct_s.into()),
    ("view over it, most reflections", |column| column.over_direct().into()),
    ("construction repaid after (views)", |column| column.repaid().into()),
];
