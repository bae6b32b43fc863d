//! Loaded files: the contents of each, the time to load it, and how much of the first picture it covers.

use std::io::Write;
use std::iter::repeat_n;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use anyhow::Context as _;
use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{View, ViewCell, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec2};
use render::{DrawWork, Lighting, Visibility};
use report::{Bar, Cell, Check, Report, Table};
use scene::SceneSpec;

use super::args::BenchArgs;
use crate::failures::stand::work;
use crate::models::models_of;

/// The size of the pictures whose covered share counts.
const PICTURE_PX: UVec2 = UVec2::new(480, 360);
const REFUSED: &str = "model files: refused";

const COLUMNS: [(&str, &str); 9] = [
    ("file", ""),
    ("format", ""),
    ("triangles", ""),
    ("textures", ""),
    ("clips", ""),
    ("lamps", ""),
    ("time to load", "s"),
    ("covers of the first picture", "%"),
    ("warnings, or why it is refused", ""),
];

/// A model as it was loaded.
#[derive(Debug, Clone, PartialEq)]
struct Loaded {
    triangles: u64,
    textures: usize,
    clips: usize,
    /// With those that a file without light gets.
    lamps: usize,
    seconds: f64,
    /// Pixels that show a surface, of 1.
    share: f64,
    /// What was left out or replaced.
    warnings: String,
}

/// Collects what is logged.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Does `work`, and returns its result with the warnings that this thread has logged, without the spans around them.
fn with_warnings<T>(work: impl FnOnce() -> T) -> (T, String) {
    let log = Log::default();
    let writer = log.clone();
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(tracing::Level::WARN)
        .with_ansi(false)
        .with_level(false)
        .with_target(false)
        .without_time()
        .with_writer(move || writer.clone());
    let result = tracing::subscriber::with_default(subscriber.finish(), work);
    let bytes = std::mem::take(&mut *log.0.lock().unwrap_or_else(PoisonError::into_inner));
    let text = String::from_utf8_lossy(&bytes);
    let warnings = text.lines().map(|line| line.rsplit_once("}: ").map_or(line, |(_, warning)| warning).trim());
    (result, warnings.collect::<Vec<_>>().join("; "))
}

/// Loads all models of the folder, if one is given; adds a table and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.models else {
        report.checks.push(Check::not_run(REFUSED, "", Bar::Equal(0.0), "--models is not given"));
        return Ok(());
    };
    let mut paths = models_of(folder, usize::MAX)?;
    paths.sort();
    let progress = bar("model files", paths.len());
    let mut models = Vec::with_capacity(paths.len());
    for path in paths {
        progress.set_message(name_of(folder, &path));
        let model = load(engine, path.clone()).map_err(|error| format!("{error:#}"));
        models.push((name_of(folder, &path), model));
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.push(table(&models)?);
    report.checks.push(refused(&models));
    Ok(())
}

/// The path of a model inside the folder.
fn name_of(folder: &Path, path: &Path) -> String {
    path.strip_prefix(folder).unwrap_or(path).display().to_string()
}

fn load(engine: &Arc<GpuEngine>, path: PathBuf) -> anyhow::Result<Loaded> {
    let start = Instant::now();
    let (setup, warnings) = with_warnings(|| SceneArgs::new(SceneSpec::File(path)).load());
    let setup = setup?;
    let seconds = start.elapsed().as_secs_f64();
    Ok(Loaded {
        triangles: setup.scene.triangle_count(),
        textures: setup.scene.textures.len(),
        clips: setup.scene.animation.as_ref().map_or(0, |animation| animation.clips.len()),
        lamps: setup.scene.illumination.lights.len(),
        seconds,
        share: share(&first_picture(engine, &setup)?),
        warnings,
    })
}

/// The picture from the middle of the sample cameras, where a viewer begins.
fn first_picture(engine: &Arc<GpuEngine>, setup: &Setup) -> anyhow::Result<View> {
    engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
    let work = DrawWork { visibility: Visibility::Measured, ..work(&scene, Lighting::UNLIT) };
    let camera = cell.camera_at(Vec2::ZERO, PICTURE_PX);
    engine.renderer.draw_views(work, &[camera], ViewPlanes::WITH_DEPTH)?.pop().context("no view")
}

/// The share of pixels that show a surface; NaN without any pixel.
fn share(view: &View) -> f64 {
    let depths = view.inverse_depth_per_m.as_deref().unwrap_or_default();
    depths.iter().filter(|&&inverse| inverse > 0.0).count() as f64 / depths.len() as f64
}

fn table(models: &[(String, Result<Loaded, String>)]) -> anyhow::Result<Table> {
    let mut table = Table::new("Model files", &COLUMNS);
    for (name, model) in models {
        let format =
            Path::new(name).extension().map_or_else(String::new, |ending| ending.to_string_lossy().to_lowercase());
        let cells: Vec<Cell> = match model {
            Ok(model) => vec![
                (model.triangles as usize).into(),
                model.textures.into(),
                model.clips.into(),
                model.lamps.into(),
                model.seconds.into(),
                (100.0 * model.share).into(),
                model.warnings.as_str().into(),
            ],
            Err(error) => repeat_n(Cell::Missing, COLUMNS.len() - 3).chain([error.as_str().into()]).collect(),
        };
        table.push([name.as_str().into(), format.into()].into_iter().chain(cells))?;
    }
    Ok(table)
}

fn refused(models: &[(String, Result<Loaded, String>)]) -> Check {
    let count = models.iter().filter(|(_, model)| model.is_err()).count();
    Check::new(REFUSED, count as f64, "", Bar::Equal(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gpu::DevicePreference;

    fn loaded(share: f64) -> (String, Result<Loaded, String>) {
        let model = Loaded {
            triangles: 1,
            textures: 2,
            clips: 3,
            lamps: 4,
            seconds: 0.5,
            share,
            warnings: "a part".to_owned(),
        };
        ("folder/a.GLB".to_owned(), Ok(model))
    }

    #[test]
    fn a_refused_file_has_a_row_with_its_error_and_fails_its_check() {
        let models = [loaded(0.5), loaded(0.3), ("b.ply".to_owned(), Err("no faces".to_owned()))];
        let table = table(&models).unwrap();
        let text = |row: usize, column: usize| table.rows[row][column].display();
        assert_eq!([text(0, 0), text(0, 1), text(0, 2), text(0, 7)], ["folder/a.GLB", "glb", "1", "50"]);
        assert_eq!(text(0, 8), "a part");
        assert_eq!([text(2, 1), text(2, 8)], ["ply", "no faces"]);
        let check = refused(&models);
        assert_eq!((check.outcome(), check.value), (report::Outcome::FallsShort, Some(1.0)));
        assert_eq!(refused(&models[..2]).outcome(), report::Outcome::Holds);
    }

    #[test]
    fn a_file_is_loaded_and_covers_some_of_its_first_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("square.obj");
        std::fs::write(&path, "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\nf 1 2\n").unwrap();
        let engine = GpuEngine::shared(DevicePreference::Any).unwrap();
        let model = load(&engine, path).unwrap();
        assert_eq!((model.triangles, model.textures, model.clips), (2, 0, 0));
        assert!(model.lamps > 0 && model.share > 0.2 && model.share < 0.95, "{model:?}");
        assert_eq!(model.warnings, "faces of fewer than three corners are left out: line 6 (f)");
        assert!(load(&engine, folder.path().join("none.obj")).is_err());
    }
}
