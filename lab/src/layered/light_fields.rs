//! Mirrors by what is gathered in a layered light field: after as many mirrors as are followed, and by the number of directions.

use codec::encode_light_field;
use depth_image::{LightDirections, View};
use reconstruction::{Mirrors, ReconstructionMethod};
use render::LayerSelection;
use study::{Bar, Cell, Check, Table};

use super::mirrors::{self, SCENE, cameras, errors, shown};
use super::subject::{Cube, Subject};
use super::views::LAYERED;
use crate::failures::stand::Stand;
use crate::impostors::{changed, reflecting};

const LIGHT: &str = "shadows";
const SIDE: u32 = 512;
/// Mirrors on a ray's way.
const MOST: u32 = 7;
/// What is gained over gathering alone, by one ray before it and by all rays.
const LEAST_GAIN_DB: f64 = 5.0;
/// What 1026 directions gain over 66 after one ray, over what they gain without.
const MOST_GAIN_SHARE: f64 = 0.25;

/// The errors of a way to show mirrors.
#[derive(Clone, Copy)]
struct Errors {
    psnr_db: f64,
    flip: f64,
}

/// The table of all numbers of directions, and its checks; quick runs leave the most out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool) -> anyhow::Result<(Table, Vec<Check>)> {
    let columns = [
        ("directions", ""),
        ("rays before", ""),
        ("mirrored pixels: PSNR", "dB"),
        ("mirrored pixels: FLIP", ""),
        ("a view", "ms"),
        ("samples", ""),
        ("sent", "MB"),
        ("sampled", "s"),
    ];
    let mut table =
        Table::new(format!("Mirrors of {SCENE}, gathered in light fields beside a cube of {SIDE}²"), &columns);
    let subject = Subject::of_views(stand, SCENE, LIGHT.parse()?, |_| cameras())?;
    let cube = subject.cube((SIDE, LayerSelection::Dominant), subject.lighting, 1)?;
    let (truths, _) = mirrors::direct(&subject, MOST)?;
    let mirrored = subject.truths.iter().zip(&truths).map(|(none, all)| changed(none, all)).collect();
    let work = Work { subject, cube, truths, mirrored };
    let all = &LightDirections::ALL[..if is_quick { 2 } else { 3 }];
    let rows = all.iter().map(|&directions| work.rows(directions, &mut table)).collect::<anyhow::Result<Vec<_>>>()?;
    let rays = work.rays(&mut table)?;
    Ok((table, checks(&rows, rays)))
}

struct Work<'s> {
    subject: Subject<'s>,
    cube: Cube,
    truths: Vec<View>,
    mirrored: Vec<Vec<bool>>,
}

impl Work<'_> {
    /// Gathering alone, and after one ray.
    fn rows(&self, directions: LightDirections, table: &mut Table) -> anyhow::Result<[Errors; 2]> {
        let (field, sample_s) = self.subject.light_field(directions, reflecting(self.subject.lighting, MOST)?)?;
        let sent_mb = encode_light_field(&field)?.payload.len() as f64 / 1e6;
        let numbers = [field.sample_count() as f64, sent_mb, sample_s].map(Cell::from);
        let set = self.subject.upload_with(&self.cube, field)?;
        let row = |rays: u32, table: &mut Table| {
            let method = ReconstructionMethod::Layered { followed: Some(rays) };
            let (views, view_s) =
                shown(&self.subject, &set, method, Mirrors { reflections: MOST, ..Mirrors::default() })?;
            let errors = self.errors(&views)?;
            let own = [errors.psnr_db, errors.flip, view_s * 1e3].map(Cell::from);
            let first = [directions.count(), rays].map(Cell::from);
            table.push(first.into_iter().chain(own).chain(numbers.clone()))?;
            anyhow::Ok(errors)
        };
        Ok([row(0, table)?, row(1, table)?])
    }

    /// All rays, and nothing gathered.
    fn rays(&self, table: &mut Table) -> anyhow::Result<Errors> {
        let (set, _) = self.subject.upload(&self.cube)?;
        let mirrors = Mirrors { reflections: MOST, ..Mirrors::default() };
        let (views, view_s) = shown(&self.subject, &set, LAYERED, mirrors)?;
        let errors = self.errors(&views)?;
        let own = [errors.psnr_db, errors.flip, view_s * 1e3].map(Cell::from);
        table.push(["-".into(), MOST.into()].into_iter().chain(own).chain(["-", "-", "-"].map(Cell::from)))?;
        Ok(errors)
    }

    fn errors(&self, views: &[View]) -> anyhow::Result<Errors> {
        let [psnr_db, flip] = errors(&self.truths, views, &self.mirrored)?;
        Ok(Errors { psnr_db, flip })
    }
}

fn checks(rows: &[[Errors; 2]], rays: Errors) -> Vec<Check> {
    let [gathered, after_one] = rows[1];
    let gain = |name: &str, of: Errors| {
        let name = format!("{SCENE}: mirrored pixels, {name} over gathering alone in 258 directions");
        Check::new(name, of.psnr_db - gathered.psnr_db, "dB", Bar::AtLeast(LEAST_GAIN_DB))
    };
    let sharper = rows.windows(2).map(|pair| {
        let name = format!("{SCENE}: FLIP of gathered mirrors over that with a quarter of the directions");
        Check::new(name, pair[1][0].flip / pair[0][0].flip, "", Bar::AtMost(1.0))
    });
    let gained = |way: usize| rows[0][way].flip - rows[2][way].flip;
    let share = (rows.len() > 2).then(|| {
        let name = format!("{SCENE}: FLIP that 1026 directions gain after one ray, over what they gain without");
        Check::new(name, gained(1) / gained(0), "", Bar::AtMost(MOST_GAIN_SHARE))
    });
    let rays = [gain("seven rays", rays), gain("one ray and gathering", after_one)];
    rays.into_iter().chain(sharper).chain(share).collect()
}
