//! Mirrors by what is gathered in a layered light field: after as many mirrors as are followed, and by the number of directions.

use codec::encode_light_field;
use depth_image::{LightDirections, View};
use reconstruction::{Mirrors, ReconstructionMethod};
use render::LayerSelection;
use report::{Bar, Cell, Check, PictureRow, Report, Table};

use super::mirrors::{self, SCENE, cameras, errors, shown};
use super::subject::{Cube, Subject};
use super::views::LAYERED;
use super::{baked, figures};
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
/// Of [`LightDirections::ALL`], the number that bounds are about.
const MIDDLE: usize = 1;

/// The errors of a way to show mirrors, and a view.
struct Mirrored {
    psnr_db: f64,
    flip: f64,
    view: View,
}

/// Adds the table of all numbers of directions, its checks, and pictures; quick runs leave the most directions out.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
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
    report.tables.push(table);
    report.checks.extend(checks(&rows, &rays));
    report.pictures.extend([work.baked()?, work.by_rays(&rows[MIDDLE], &rays)?]);
    report.pictures.push(by_directions("4, above", "gathered", all.iter().zip(rows.iter().map(|row| &row[0])))?);
    let after_one = all.iter().zip(rows.iter().map(|row| &row[1]));
    report.pictures.push(by_directions("4, below", "one ray, then gathered", after_one)?);
    Ok(())
}

struct Work<'s> {
    subject: Subject<'s>,
    cube: Cube,
    truths: Vec<View>,
    mirrored: Vec<Vec<bool>>,
}

impl Work<'_> {
    /// Gathering alone, and after one ray.
    fn rows(&self, directions: LightDirections, table: &mut Table) -> anyhow::Result<[Mirrored; 2]> {
        let (field, sample_s) = self.subject.light_field(directions, reflecting(self.subject.lighting, MOST)?)?;
        let sent_mb = encode_light_field(&field)?.payload.len() as f64 / 1e6;
        let numbers = [field.sample_count() as f64, sent_mb, sample_s].map(Cell::from);
        let (set, _) = self.subject.upload_with(&self.cube, field)?;
        let row = |rays: u32, table: &mut Table| {
            let method = ReconstructionMethod::Layered { followed: Some(rays) };
            let (views, view_s) =
                shown(&self.subject, &set, method, Mirrors { reflections: MOST, ..Mirrors::default() })?;
            let shown = self.mirrored(&views)?;
            let own = [shown.psnr_db, shown.flip, view_s * 1e3].map(Cell::from);
            let first = [directions.count(), rays].map(Cell::from);
            table.push(first.into_iter().chain(own).chain(numbers.clone()))?;
            anyhow::Ok(shown)
        };
        Ok([row(0, table)?, row(1, table)?])
    }

    /// All rays, and nothing gathered.
    fn rays(&self, table: &mut Table) -> anyhow::Result<Mirrored> {
        let (set, _) = self.subject.upload(&self.cube)?;
        let mirrors = Mirrors { reflections: MOST, ..Mirrors::default() };
        let (views, view_s) = shown(&self.subject, &set, LAYERED, mirrors)?;
        let shown = self.mirrored(&views)?;
        let own = [shown.psnr_db, shown.flip, view_s * 1e3].map(Cell::from);
        table.push(["-".into(), MOST.into()].into_iter().chain(own).chain(["-", "-", "-"].map(Cell::from)))?;
        Ok(shown)
    }

    fn mirrored(&self, views: &[View]) -> anyhow::Result<Mirrored> {
        let [psnr_db, flip] = errors(&self.truths, views, &self.mirrored)?;
        Ok(Mirrored { psnr_db, flip, view: figures::middle(views)?.clone() })
    }

    /// What the images of two cameras show to the one between them.
    fn baked(&self) -> anyhow::Result<PictureRow> {
        let middle = self.truths.len() / 2;
        let seen =
            |number: usize| baked::seen_from(&self.subject, number, &self.truths[number], self.subject.views[middle]);
        let (left, right) = (seen(middle - 1)?, seen(middle + 1)?);
        let views = [
            ("warped from the camera on the left", &left),
            ("warped from the camera on the right", &right),
            ("drawn directly", figures::middle(&self.truths)?),
        ];
        let views = views.map(|(caption, view)| (caption.to_owned(), view));
        figures::row(("1", "Mirrors as part of samples, which show what another camera saw"), views)
    }

    fn by_rays(&self, [gathered, after_one]: &[Mirrored; 2], rays: &Mirrored) -> anyhow::Result<PictureRow> {
        let count = LightDirections::ALL[MIDDLE].count();
        let views = [
            (format!("a, gathered in {count} directions"), &gathered.view),
            (format!("b, one ray, then gathered in {count} directions"), &after_one.view),
            ("c, seven rays".to_owned(), &rays.view),
            ("d, drawn directly".to_owned(), figures::middle(&self.truths)?),
        ];
        figures::row(("3", "Mirrors gathered, and by rays"), views)
    }
}

fn by_directions<'m>(
    figure: &str,
    way: &str,
    mirrored: impl Iterator<Item = (&'m LightDirections, &'m Mirrored)>,
) -> anyhow::Result<PictureRow> {
    let views =
        mirrored.map(|(directions, shown)| (format!("{way} in {} directions", directions.count()), &shown.view));
    figures::row((figure, "Mirrors by the number of directions"), views)
}

fn checks(rows: &[[Mirrored; 2]], rays: &Mirrored) -> Vec<Check> {
    let [gathered, after_one] = &rows[MIDDLE];
    let gain = |name: &str, of: &Mirrored| {
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
