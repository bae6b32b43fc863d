//! The folder of a browser's profile.

use std::path::Path;
use std::time::Duration;

use tempfile::TempDir;

/// Attempts to remove the folder, and the pause between them: processes that were killed may write for another moment.
const ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// An empty folder of its own, removed when it is dropped.
#[derive(Debug)]
pub(crate) struct Profile(TempDir);

impl Profile {
    pub(crate) fn new() -> std::io::Result<Self> {
        tempfile::Builder::new().prefix("browser-").tempdir().map(Self)
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Profile {
    fn drop(&mut self) {
        for _ in 0..ATTEMPTS {
            if std::fs::remove_dir_all(self.path()).is_ok() {
                return;
            }
            std::thread::sleep(PAUSE);
        }
    }
}
