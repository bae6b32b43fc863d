//! A base beside depth images: what it tells of the pixels that these leave unknown, and what it costs.

use std::time::Instant;

use anyhow::Context as _;
use app_core::setup::SceneArgs;
use depth_image::{PinholeCamera, ProvenanceKind, View, ViewCell, ViewPlanes};
use glam::UVec2;
use reconstruction::{CommonSets, SampleSet};
use render::{LayerSelection, Lighting};
use report::{Bar, Cell, Check, Report, Table};

use super::subject::Subject;
use super::views;
use crate::failures::stage::CARVE;
use crate::failures::stand::{Stand, pinholes};
use crate::statistics::median;

/// Scenes, and by how many dB views gain at least. A quick run has the first alone.
const SCENES: [(&str, f64); 2] = [("tree", 2.0), ("tree-terrain-500k", 0.3)];
const SIDE: u32 = 512;
const VIEWS: usize = 8;
const VIEW_PX: UVec2 = UVec2::new(200, 150);
const REPEATS: usize = 9;
/// Percent of the pixels that may stay unknown where a line has met more surfaces than it holds.
const MOST_UNKNOWN: f64 = 0.2;
/// The bounds of a view's time over that without a base, and of the seconds that a million samples take to load.
const MOST_OVER: f64 = 1.25;
const MOST_LOAD_S: f64 = 0.5;

/// Adds the table of all scenes, and its checks.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, lighting: Lighting, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let more = [("unknown", "%"), ("from the base", "%"), ("loaded, a million samples", "s")];
    let title = format!("A base of {SIDE}² beside the four images of each scene's sample cameras");
    let mut table = Table::new(title, &[&views::COLUMNS[..], &more].concat());
    for &(name, gain_db) in &SCENES[..if is_quick { 1 } else { SCENES.len() }] {
        report.checks.extend(of_scene(stand, (name, gain_db), lighting, &mut table)?);
    }
    report.tables.push(table);
    Ok(())
}

/// Views, and the seconds of one.
struct Made {
    views: Vec<View>,
    view_s: f64,
}

impl Made {
    fn share(&self, kind: ProvenanceKind) -> f64 {
        let kinds = self.views.iter().flat_map(|view| view.provenance.iter().flatten()).map(|pixel| pixel.kind());
        let pixels: usize = self.views.iter().map(|view| view.size_px.element_product() as usize).sum();
        kinds.filter(|&of| of == kind).count() as f64 / pixels as f64
    }
}

fn of_scene(
    stand: &Stand,
    (name, gain_db): (&'static str, f64),
    lighting: Lighting,
    table: &mut Table,
) -> anyhow::Result<Vec<Check>> {
    let around = SceneArgs::new(fixtures::spec(name)?).load()?.around;
    let cell = ViewCell::between(&around).context("sample cameras")?;
    let subject = Subject::of_views(stand, name, lighting, |_| cell.spread(VIEWS, VIEW_PX))?;
    let images = stand.images(&subject.on_device, lighting, &pinholes(&around), views::PLAIN)?;
    let set = stand.reconstructor().upload(&images, &subject.description())?;
    let cube = subject.cube((SIDE, LayerSelection::Dominant), lighting, 1)?;
    drop(subject.upload(&cube)?);
    let (base, load_s) = subject.upload(&cube)?;
    let is_truncated = cube.images.iter().any(|image| image.truncated);
    let million_s = load_s * 1e6 / cube.samples() as f64;
    let [without, with] = both(stand, &set, &base, &subject.views)?;
    let mut psnr_db = Vec::new();
    for (by, made, load_s) in [("joint_carve", &without, None), ("joint_carve and a base", &with, Some(million_s))] {
        let figures = views::figures(&subject.truths, &made.views, (f64::NAN, made.view_s))?;
        let shares = [ProvenanceKind::Filled, ProvenanceKind::Base].map(|kind| Cell::from(made.share(kind) * 100.0));
        table.push([figures.row(name, by), shares.to_vec(), vec![Cell::from(load_s)]].concat())?;
        psnr_db.push(figures.psnr_db);
    }
    let unknown = Check::new(
        format!("{name}: pixels that a base leaves unknown"),
        with.share(ProvenanceKind::Filled) * 100.0,
        "%",
        Bar::AtMost(if is_truncated { MOST_UNKNOWN } else { 0.0 }),
    );
    let of = |what: &str| format!("{name}: {what} of views with a base");
    Ok(vec![
        unknown,
        Check::new(of("PSNR gained"), psnr_db[1] - psnr_db[0], "dB", Bar::AtLeast(gain_db)),
        Check::new(of("time over that without one,"), with.view_s / without.view_s, "", Bar::AtMost(MOST_OVER)),
        Check::new(format!("{name}: a base loads a million samples"), million_s, "s", Bar::AtMost(MOST_LOAD_S)),
    ])
}

/// Views without a base and with it, made in turn: other load of the machine slows both.
fn both(stand: &Stand, set: &SampleSet, base: &SampleSet, cameras: &[PinholeCamera]) -> anyhow::Result<[Made; 2]> {
    let make = |base, planes| {
        let common = CommonSets { base, ..CommonSets::default() };
        stand.reconstructor().reconstruct_with(set, common, cameras, CARVE, planes, Default::default())
    };
    let bases = [None, Some(base)];
    let views = [make(bases[0], ViewPlanes::ALL)?, make(bases[1], ViewPlanes::ALL)?];
    let mut seconds = [Vec::new(), Vec::new()];
    // The first run makes shaders.
    for run in 0..=REPEATS {
        for (seconds, base) in seconds.iter_mut().zip(bases) {
            let start = Instant::now();
            make(base, ViewPlanes::COLOR)?;
            seconds.extend((run > 0).then(|| start.elapsed().as_secs_f64() / cameras.len() as f64));
        }
    }
    let [without, with] = views;
    let [without_s, with_s] = seconds.map(median);
    Ok([Made { views: without, view_s: without_s }, Made { views: with, view_s: with_s }])
}
