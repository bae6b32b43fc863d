//! Packages in a folder, each a file named by its hash.

use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::SceneHash;
use crate::SceneError;
use crate::error::Fault;

/// A folder of packages; several processes may share it.
#[derive(Debug, Clone)]
pub struct PackageStore {
    folder: PathBuf,
}

impl PackageStore {
    /// Opens a folder, and creates it where it does not exist.
    ///
    /// # Errors
    /// The folder can neither be found nor created.
    pub fn open(folder: impl Into<PathBuf>) -> Result<Self, SceneError> {
        let folder = folder.into();
        std::fs::create_dir_all(&folder).map_err(|e| Fault::io("package folder", e).in_path(&folder))?;
        Ok(Self { folder })
    }

    /// The bytes of a package; `None` where it is absent, unreadable, or of another hash.
    #[must_use]
    pub fn get(&self, hash: SceneHash) -> Option<Vec<u8>> {
        let bytes = std::fs::read(self.path(hash)).ok()?;
        (SceneHash::of(&bytes) == hash).then_some(bytes)
    }

    /// Returns whether a package of this name exists; [`PackageStore::get`] checks its contents.
    #[must_use]
    pub fn contains(&self, hash: SceneHash) -> bool {
        self.path(hash).is_file()
    }

    /// Stores a package. It appears whole or not at all, even where the program is stopped.
    ///
    /// # Errors
    /// The bytes have another hash, or cannot be written.
    pub fn put(&self, hash: SceneHash, bytes: &[u8]) -> Result<(), SceneError> {
        let path = self.path(hash);
        let actual = SceneHash::of(bytes);
        if actual != hash {
            return Err(Fault::malformed("package", format!("its hash is {actual}")).in_path(&path));
        }
        self.write(&path, bytes).map_err(|e| Fault::io("package", e).in_path(&path))
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
        let mut temporary = NamedTempFile::new_in(&self.folder)?;
        temporary.write_all(bytes)?;
        temporary.as_file().sync_all()?;
        temporary.persist(path)?;
        Ok(())
    }

    fn path(&self, hash: SceneHash) -> PathBuf {
        self.folder.join(format!("{hash}.scene"))
    }
}
