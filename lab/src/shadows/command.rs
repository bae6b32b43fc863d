//! `myriorama-lab study shadows`.

use app_core::exit::Outcome;
use engine::GpuEngine;

use super::measure::{Measured, SCENES, Setting, front, measure, times};
use super::report::report;
use crate::study::RunArgs;

/// The size of the study.
#[derive(Debug, Clone, Copy)]
struct Extent {
    quick: bool,
    view_px: u32,
    map_px: u32,
}

impl Extent {
    fn new(quick: bool) -> Self {
        if quick { Self { quick, view_px: 192, map_px: 384 } } else { Self { quick, view_px: 512, map_px: 1024 } }
    }

    fn setting(self, scene: &'static str) -> Setting {
        Setting { scene, lamp_size: 1.0, map_px: self.map_px }
    }

    fn scenes(self) -> Vec<Setting> {
        let scenes = if self.quick { &SCENES[..2] } else { &SCENES };
        scenes.iter().map(|scene| self.setting(scene)).collect()
    }

    fn map_sides(self) -> Vec<Setting> {
        let scenes: &[&'static str] = if self.quick { &["urban"] } else { &["grass", "urban"] };
        let sides = [1, 2, 3].map(|part| part * self.map_px / 2);
        let all = scenes.iter().flat_map(|scene| sides.map(|map_px| Setting { map_px, ..self.setting(scene) }));
        all.collect()
    }

    fn lamp_sizes(self) -> Vec<Setting> {
        let scenes: &[&'static str] = if self.quick { &["urban"] } else { &["grass", "urban"] };
        let sizes: &[f32] = if self.quick { &[1.0, 4.0] } else { &[0.25, 0.5, 1.0, 2.0, 4.0] };
        let all = scenes
            .iter()
            .flat_map(|scene| sizes.iter().map(move |&lamp_size| Setting { lamp_size, ..self.setting(scene) }));
        all.collect()
    }

    /// Meadows of 0.25 to 8 million triangles.
    fn triangles(self) -> Vec<Setting> {
        let scenes: &[&'static str] =
            if self.quick { &["grass:4.5", "grass:36"] } else { &["grass:4.5", "grass:18", "grass:36", "grass:144"] };
        scenes.iter().map(|scene| self.setting(scene)).collect()
    }
}

/// Measures and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &RunArgs) -> anyhow::Result<Outcome> {
    let engine = args.engine()?;
    let extent = Extent::new(args.quick);
    let measured = take(&engine, extent)?;
    let mut study = args.report("shadows", &engine);
    study.parameter("places of the lamp", "16×16");
    study.parameter("views (px)", format!("{0}×{0}", extent.view_px));
    study.parameter("images of the lamp (px)", format!("{0}×{0}", extent.map_px));
    report(&measured, &mut study)?;
    args.finish("out/study/shadows", &study)
}

fn take(engine: &GpuEngine, extent: Extent) -> anyhow::Result<Measured> {
    let scenes = extent.scenes();
    let map_sides = extent.map_sides();
    let lamp_sizes = extent.lamp_sizes();
    let mut settings: Vec<Setting> = Vec::new();
    for setting in [&scenes, &map_sides, &lamp_sizes].into_iter().flatten() {
        if !settings.contains(setting) {
            settings.push(*setting);
        }
    }
    let shadows = measure(engine, &settings, &scenes, extent.view_px)?;
    let most_rays = if extent.quick { 64 } else { 256 };
    let mut fronts = Vec::new();
    for setting in &scenes {
        fronts.push((setting.scene, front(engine, *setting, extent.view_px, most_rays)?));
    }
    let mut all_times = Vec::new();
    for setting in extent.triangles() {
        all_times.extend(times(engine, setting, extent.view_px)?);
    }
    Ok(Measured { scenes, map_sides, lamp_sizes, times: all_times, shadows, fronts })
}
