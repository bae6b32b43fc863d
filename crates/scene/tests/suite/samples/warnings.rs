//! The warnings of an import.

use std::io::Write;
use std::sync::{Arc, Mutex};

use scene::Scene;
use tracing_subscriber::fmt::MakeWriter;

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

impl<'a> MakeWriter<'a> for Log {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

/// Loads a sample that can be used; the text has a line for each warning.
pub fn loaded_with_warnings(sample: &Sample) -> (Scene, String) {
    let log = Log::default();
    let subscriber = tracing_subscriber::fmt()
        .with_writer(log.clone())
        .with_ansi(false)
        .with_max_level(tracing_subscriber::filter::LevelFilter::WARN)
        .finish();
    let scene = tracing::subscriber::with_default(subscriber, || sample.load()).unwrap();
    let text = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
    (scene, text)
}
