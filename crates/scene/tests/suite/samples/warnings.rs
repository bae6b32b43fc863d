//! The warnings that are logged while something is done.

use std::io::Write;
use std::sync::{Arc, LazyLock, Mutex};

use scene::Scene;
use tracing::Dispatch;

use super::Sample;

#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A span or a warning that is first reached while another thread makes its subscriber may stay silent for ever. While this
/// subscriber is there, none does.
static ALL_CALLSITES: LazyLock<Dispatch> =
    LazyLock::new(|| Dispatch::new(tracing_subscriber::fmt().with_writer(std::io::sink).finish()));

pub fn keep_all_callsites() {
    LazyLock::force(&ALL_CALLSITES);
}

/// Does `work`, and returns its result with the lines that this thread has logged.
pub fn with_warnings<T>(work: impl FnOnce() -> T) -> (T, Vec<String>) {
    let log = Log::default();
    let writer = log.clone();
    let subscriber =
        tracing_subscriber::fmt().with_ansi(false).without_time().with_writer(move || writer.clone()).finish();
    let result = tracing::subscriber::with_default(subscriber, work);
    let text = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
    (result, text.lines().map(str::to_owned).collect())
}

/// Does `work`, and returns its result with the only line that this thread has logged.
pub fn with_one_warning<T>(work: impl FnOnce() -> T) -> (T, String) {
    let (result, mut lines) = with_warnings(work);
    assert_eq!(lines.len(), 1, "{lines:?}");
    (result, lines.remove(0))
}

/// Loads a sample that can be used; the text has a line for each warning.
pub fn loaded_with_warnings(sample: &Sample) -> (Scene, String) {
    let (scene, lines) = with_warnings(|| sample.load());
    (scene.unwrap(), lines.join("\n"))
}
