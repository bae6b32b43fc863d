//! The record of a request: which views are written. It is `cameras.json` on disk, and from it a request is resumed.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use app_core::camera_record::{self, NamedCamera};
use app_core::delivery::requests;
use app_core::exit::BadInput;
use client::ViewRequest;
use cluster::{Promise, PromiseState};
use depth_image::{ExposureEv, PinholeCamera, SourceSpace, ToneMapping, ViewPlanes};
use serde_json::{Map, Value, json};

use super::file_names::{FileNames, number_of};

/// Most views of one request: the record takes 9 bytes of memory for each.
pub(super) const MAX_VIEWS: u64 = 1 << 22;
/// The name of the record.
pub(super) const FILE_NAME: &str = "cameras.json";
/// The field that says how the pictures are shown, and its exposure.
const TONE: &str = "tone_mapping";
const EXPOSURE_EV: &str = "exposure_ev";
/// The field of the promise.
const PROMISE: &str = "promise";
const DEPTH: &str =
    "16-bit: value / 65535 * inverse_depth_max_per_m, per metre or unit of the scene's file; 0 is background";
/// The time between two writings of the record, and its least multiple of the time that writing takes.
const PAUSE: Duration = Duration::from_secs(5);
const PAUSE_RATIO: u32 = 20;

/// The views of a request, and which of them are whole in a folder.
pub(super) struct Record {
    folder: PathBuf,
    source_space: SourceSpace,
    /// Everything that the pictures depend on, by name.
    settings: Map<String, Value>,
    cameras: Arc<[PinholeCamera]>,
    set_count: u32,
    planes: ViewPlanes,
    /// The exposure of all views. `None`: it is the plan's, and not known yet.
    pub(super) exposure: Option<ExposureEv>,
    /// The promise when these pictures came, as the record has it; one that was not kept stays.
    promise: Option<Value>,
    /// The scale of each written view's depth picture, per metre; 0 without that picture. `None`: the view is not written.
    written: Vec<Option<f32>>,
    count: u64,
    next_save: Instant,
}

impl Record {
    /// A record without written views.
    ///
    /// # Errors
    /// There are too many views.
    pub(super) fn new(
        folder: &Path,
        source_space: SourceSpace,
        settings: Map<String, Value>,
        views: (Arc<[PinholeCamera]>, u32),
        planes: ViewPlanes,
    ) -> Result<Self, BadInput> {
        let (cameras, set_count) = views;
        let total = cameras.len() as u64 * u64::from(set_count);
        if total > MAX_VIEWS {
            let sets = format!("{} views of {set_count} moments", cameras.len());
            return Err(BadInput(format!("--frames: {sets} are {total} pictures, at most {MAX_VIEWS} are allowed")));
        }
        Ok(Self {
            folder: folder.to_owned(),
            source_space,
            settings,
            cameras,
            set_count,
            planes,
            exposure: None,
            promise: None,
            written: vec![None; total as usize],
            count: 0,
            next_save: Instant::now() + PAUSE,
        })
    }

    /// All views.
    pub(super) fn total(&self) -> u64 {
        self.written.len() as u64
    }

    /// Written views.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Notes how the views are shown.
    pub(super) fn set_tone(&mut self, tone: ToneMapping) {
        self.exposure = Some(tone.exposure);
        self.planes.tone = tone;
    }

    /// Notes the promise of the next pictures.
    pub(super) fn set_promise(&mut self, promise: Option<&Promise>) {
        if self.unkept_promise().is_none() {
            self.promise = promise.map(described);
        }
    }

    /// The promise, where it is not kept.
    pub(super) fn unkept_promise(&self) -> Option<String> {
        let promise = self.promise.as_ref()?;
        let [state, budget, reason] =
            ["state", "budget", "reason"].map(|name| promise.get(name).and_then(Value::as_str).unwrap_or("?"));
        let unkept = [PromiseState::Broken, PromiseState::Unreachable].map(|state| state.to_string());
        unkept.iter().any(|unkept| unkept == state).then(|| format!("the budget {budget} is not kept: {reason}"))
    }

    /// Requests of the views that are not written.
    pub(super) fn missing(&self) -> impl Iterator<Item = ViewRequest> + Send + 'static {
        let kept: Vec<bool> = self.written.iter().map(Option::is_some).collect();
        requests(self.set_count, self.cameras.clone()).filter(move |view| !kept[view.frame as usize])
    }

    /// Counts a view as written.
    pub(super) fn add(&mut self, number: u64, depth_scale: f32) {
        if let Some(written) = self.written.get_mut(number as usize)
            && written.replace(depth_scale).is_none()
        {
            self.count += 1;
        }
    }

    /// Takes over the views that the record in the folder names, if there is one. A view is taken over if its camera and set
    /// are those of this request and its files exist.
    ///
    /// # Errors
    /// The record cannot be read, or was written with other settings.
    pub(super) fn resume(&mut self) -> anyhow::Result<()> {
        let mut found = Vec::new();
        let path = self.folder.join(FILE_NAME);
        let about = camera_record::read(&path, |line| found.extend(self.view_of(line)))?;
        if let Some(about) = about {
            self.check_settings(&path, about.get("settings").unwrap_or(&Value::Null))?;
            self.exposure = about.get(TONE).and_then(exposure_of);
            self.promise = about.get(PROMISE).cloned();
            found.into_iter().for_each(|(number, depth_scale)| self.add(number, depth_scale));
        }
        Ok(())
    }

    /// Deletes the pictures of the views that the record in the folder names, and returns the number of these views: they are of an
    /// earlier request. Files that no record names stay, as does everything where the record was not written by this program.
    pub(super) fn delete_earlier(&self) -> usize {
        let mut named = Vec::new();
        let record = camera_record::read(&self.folder.join(FILE_NAME), |line| named.extend(files_of_line(line)));
        if record.is_err() {
            return 0;
        }
        let deleted = named.iter().filter(|files| {
            // All files of the view are deleted, whether one of them was there or not.
            files.all().filter(|name| std::fs::remove_file(self.folder.join(name)).is_ok()).count() > 0
        });
        deleted.count()
    }

    /// The view of a line of the record, with the scale of its depth picture.
    fn view_of(&self, line: &str) -> Option<(u64, f32)> {
        let frame: Map<String, Value> = serde_json::from_str(line).ok()?;
        let number = number_of(frame.get("file_path")?.as_str()?)?;
        let depth_scale = frame.get("inverse_depth_max_per_m").and_then(Value::as_f64).unwrap_or(0.0) as f32;
        let depth_scale = depth_scale / self.metres_per_unit();
        // Text is compared: it holds every bit of a number.
        let is_equal = number < self.total() && self.named(number, depth_scale).line(self.source_space) == line;
        let files = FileNames::of(number, self.planes);
        (is_equal && files.all().all(|name| self.folder.join(name).is_file())).then_some((number, depth_scale))
    }

    fn check_settings(&self, path: &Path, found: &Value) -> Result<(), BadInput> {
        match self.settings.iter().find(|(name, value)| found.get(name) != Some(value)) {
            None => Ok(()),
            Some((name, value)) => {
                let found = found.get(name).unwrap_or(&Value::Null);
                let path = path.display();
                Err(BadInput(format!("--resume: {path} is of {name} {found}, this request of {value}")))
            }
        }
    }

    /// Writes the record if it is time to.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn save_if_due(&mut self) -> anyhow::Result<()> {
        if Instant::now() >= self.next_save { self.save() } else { Ok(()) }
    }

    /// Writes the record.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn save(&mut self) -> anyhow::Result<()> {
        let start = Instant::now();
        let mut about = Map::new();
        about.insert("depth".to_owned(), json!(DEPTH));
        about.insert("settings".to_owned(), Value::Object(self.settings.clone()));
        if let Some(exposure) = self.exposure {
            let curve = self.planes.tone.curve.to_string();
            about.insert(TONE.to_owned(), json!({ "curve": curve, EXPOSURE_EV: exposure.ev() }));
        }
        if let Some(promise) = &self.promise {
            about.insert(PROMISE.to_owned(), promise.clone());
        }
        let written = (0..).zip(&self.written);
        let cameras = written.filter_map(|(number, scale)| Some(self.named(number, (*scale)?)));
        camera_record::write(&self.folder.join(FILE_NAME), cameras, self.source_space, about)?;
        // Long records are written less often, so that the views go on.
        self.next_save = Instant::now() + PAUSE.max(PAUSE_RATIO * start.elapsed());
        Ok(())
    }

    /// A power of two: scales of depth stay exact.
    fn metres_per_unit(&self) -> f32 {
        self.source_space.metres_per_unit as f32
    }

    fn named(&self, number: u64, depth_scale: f32) -> NamedCamera {
        let views = self.cameras.len() as u64;
        let files = FileNames::of(number, self.planes);
        let mut more = Map::from_iter([("set_index".to_owned(), json!(number / views))]);
        if let Some(name) = files.depth {
            more.insert("depth_file_path".to_owned(), json!(name));
            more.insert("inverse_depth_max_per_m".to_owned(), json!(depth_scale * self.metres_per_unit()));
        }
        if let Some(name) = files.provenance {
            more.insert("provenance_file_path".to_owned(), json!(name));
        }
        NamedCamera { file_path: files.color, camera: self.cameras[(number % views) as usize], more }
    }
}

/// The files of the view that a line of a record names.
fn files_of_line(line: &str) -> Option<FileNames> {
    let frame: Map<String, Value> = serde_json::from_str(line).ok()?;
    let planes = ViewPlanes {
        inverse_depth: frame.contains_key("depth_file_path"),
        provenance: frame.contains_key("provenance_file_path"),
        ..ViewPlanes::COLOR
    };
    Some(FileNames::of(number_of(frame.get("file_path")?.as_str()?)?, planes))
}

fn described(promise: &Promise) -> Value {
    json!({
        "budget": promise.budget, "state": promise.state.to_string(), "representation": promise.representation,
        "expected_ratio": promise.expected_ratio, "bound_ratio": promise.bound_ratio,
        "probe_view_count": promise.probe_view_count, "reason": promise.reason,
        "audited_view_count": promise.audit.map(|audit| audit.audited_views),
    })
}

/// The exposure that a record names; `None` for one that is out of its limits.
fn exposure_of(tone: &Value) -> Option<ExposureEv> {
    ExposureEv::new(tone.get(EXPOSURE_EV)?.as_f64()? as f32).ok()
}

#[cfg(test)]
#[path = "record_tests.rs"]
mod tests;
