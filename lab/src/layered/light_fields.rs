//! Mirrors by what is gathered in a layered light field: at once or after one ray, by the number of directions.

use codec::encode_light_field;
use depth_image::{LightDirections, View};
use reconstruction::{Mirrors, ReconstructionMethod};
use render::LayerSelection;
use report::{Bar, Check, PictureRow, Report};

use super::figures;
use super::mirrors::{self, SCENE, TimedViews, cameras, errors};
use super::subject::{Cube, Subject};
use super::views::LAYERED;
use crate::failures::stand::Stand;
use crate::impostors::{changed, reflecting};
use crate::study::{Column, table};

const LIGHT: &str = "shadows";
const SIDE: u32 = 512;
/// Mirrors on a ray's way.
const MOST: u32 = 7;
const MIRRORS: Mirrors<'_> = Mirrors { cells: &[], reflections: MOST, glossy_rays: 0 };
/// What is gained over gathering alone, by one ray before it and by all rays.
const LEAST_GAIN_DB: f64 = 5.0;
/// The number of directions that bounds are about.
const MIDDLE: LightDirections = LightDirections::D258;

/// A way to show mirrors.
struct MirrorRow {
    /// `None` where nothing is gathered.
    gathered: Option<Gathered>,
    /// Mirrors that are followed by rays.
    rays: u32,
    psnr_db: f64,
    flip: f64,
    view_s: f64,
    view: View,
}

/// The light field of a row.
#[derive(Debug, Clone, Copy)]
struct Gathered {
    directions: LightDirections,
    samples: usize,
    sent_bytes: usize,
    sample_s: f64,
}

const COLUMNS: [Column<MirrorRow>; 8] = [
    Column::new("directions", |row| row.gathered.map(|gathered| gathered.directions.count()).into()),
    Column::new("rays before", |row| row.rays.into()),
    Column::with_unit("mirrored pixels: PSNR", "dB", |row| row.psnr_db.into()),
    Column::new("mirrored pixels: FLIP", |row| row.flip.into()),
    Column::with_unit("a view", "ms", |row| (row.view_s * 1e3).into()),
    Column::new("samples", |row| row.gathered.map(|gathered| gathered.samples).into()),
    Column::with_unit("sent", "MB", |row| row.gathered.map(|gathered| gathered.sent_bytes as f64 / 1e6).into()),
    Column::with_unit("sampled", "s", |row| row.gathered.map(|gathered| gathered.sample_s).into()),
];

/// Adds the table of all numbers of directions, its checks, and pictures; quick runs leave the most directions out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let cube = subject.cube(SIDE, LayerSelection::Dominant, subject.lighting, 1)?;
    let truths = TimedViews::drawn(&subject, reflecting(subject.lighting, MOST)?)?.views;
    let mirrored = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let box_of_mirrors = MirrorBox { subject, cube, truths, mirrored };
    let mut rows = Vec::new();
    for &directions in &LightDirections::ALL[..if is_quick { 2 } else { 3 }] {
        rows.extend(box_of_mirrors.gathered(directions)?);
    }
    rows.push(box_of_mirrors.by_rays()?);
    let title = format!("Mirrors of {SCENE}, gathered in light fields beside a cube of {SIDE}²");
    report.tables.push(table(title, &COLUMNS, &rows)?);
    report.checks.extend(checks(&rows));
    report.pictures.extend(pictures(&rows, mirrors::middle(&box_of_mirrors.truths)?)?);
    Ok(())
}

struct MirrorBox<'s> {
    subject: Subject<'s>,
    cube: Cube,
    truths: Vec<View>,
    mirrored: Vec<Vec<bool>>,
}

impl MirrorBox<'_> {
    /// Gathering alone, and after one ray.
    fn gathered(&self, directions: LightDirections) -> anyhow::Result<[MirrorRow; 2]> {
        let (field, sample_s) = self.subject.light_field(directions, reflecting(self.subject.lighting, MOST)?)?;
        let sent_bytes = encode_light_field(&field)?.payload.len();
        let gathered = Gathered { directions, samples: field.sample_count(), sent_bytes, sample_s };
        let set = self.subject.upload(&self.cube, Some(field))?.0;
        let [alone, after_one] = [0, 1].map(|rays| {
            let method = ReconstructionMethod::Layered { followed: Some(rays) };
            self.row(Some(gathered), rays, &TimedViews::of_cube(&self.subject, &set, method, MIRRORS)?)
        });
        Ok([alone?, after_one?])
    }

    /// All mirrors are followed, and nothing is gathered.
    fn by_rays(&self) -> anyhow::Result<MirrorRow> {
        let set = self.subject.upload(&self.cube, None)?.0;
        self.row(None, MOST, &TimedViews::of_cube(&self.subject, &set, LAYERED, MIRRORS)?)
    }

    fn row(&self, gathered: Option<Gathered>, rays: u32, timed: &TimedViews) -> anyhow::Result<MirrorRow> {
        let [psnr_db, flip] = errors(&self.truths, &timed.views, &self.mirrored)?;
        Ok(MirrorRow {
            gathered,
            rays,
            psnr_db,
            flip,
            view_s: timed.view_s,
            view: mirrors::middle(&timed.views)?.clone(),
        })
    }
}

impl MirrorRow {
    fn is_gathered_in(&self, directions: LightDirections) -> bool {
        self.gathered.is_some_and(|gathered| gathered.directions == directions)
    }

    fn caption(&self) -> String {
        match self.gathered {
            None => format!("{} rays", self.rays),
            Some(Gathered { directions, .. }) => {
                let before = if self.rays == 0 { "" } else { "one ray, then " };
                format!("{before}gathered in {} directions", directions.count())
            }
        }
    }
}

fn checks(rows: &[MirrorRow]) -> Vec<Check> {
    let Some(alone) = rows.iter().find(|row| row.is_gathered_in(MIDDLE) && row.rays == 0) else { return Vec::new() };
    let better = rows.iter().filter(|row| row.rays > 0 && (row.gathered.is_none() || row.is_gathered_in(MIDDLE)));
    let gains = better.map(|row| {
        let name = format!("{SCENE}: mirrored pixels, {} over gathering alone in 258 directions", row.caption());
        Check::new(name, row.psnr_db - alone.psnr_db, "dB", Bar::AtLeast(LEAST_GAIN_DB))
    });
    let gathered: Vec<&MirrorRow> = rows.iter().filter(|row| row.gathered.is_some() && row.rays == 0).collect();
    let sharper = gathered.windows(2).map(|pair| {
        let name = format!("{SCENE}: FLIP, {} over {}", pair[1].caption(), pair[0].caption());
        Check::new(name, pair[1].flip / pair[0].flip, "", Bar::AtMost(1.0))
    });
    gains.chain(sharper).collect()
}

fn pictures(rows: &[MirrorRow], truth: &View) -> anyhow::Result<[PictureRow; 2]> {
    let middle = rows.iter().filter(|row| row.gathered.is_none() || row.is_gathered_in(MIDDLE));
    let middle = middle.map(|row| (row.caption(), &row.view));
    let gathered = rows.iter().filter(|row| row.gathered.is_some()).map(|row| (row.caption(), &row.view));
    Ok([
        figures::row(3, "Mirrors gathered, and by rays", middle.chain([("drawn directly".to_owned(), truth)]))?,
        figures::row(4, "Mirrors by the number of directions", gathered)?,
    ])
}
