//! A scene as bytes that are named by their hash, for the transfer between nodes.

mod layout;

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use tempfile::NamedTempFile;

use crate::error::Fault;
use crate::{Limits, Scene, SceneError};

/// A packed scene. Equal scenes give equal bytes, and equal bytes an equal hash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Hash of `bytes`.
    pub hash: SceneHash,
    /// See [`unpack`].
    pub bytes: Vec<u8>,
}

/// Packs a scene.
#[must_use]
pub fn pack(scene: &Scene) -> Package {
    let bytes = layout::bytes_from_scene(scene);
    Package { hash: SceneHash::of(&bytes), bytes }
}

/// Unpacks a scene and validates it, since the bytes are untrusted. It does not check their hash.
///
/// # Errors
/// The part of the package at fault. Memory is bounded by a few times the bytes' length.
pub fn unpack(bytes: &[u8], limits: &Limits) -> Result<Scene, SceneError> {
    let scene = layout::scene_from_bytes(bytes, limits);
    let checked = scene.and_then(|scene| scene.check(limits).map(|()| scene));
    checked.map_err(|fault| fault.in_file("package"))
}

/// BLAKE3 of a package's bytes. Displayed and parsed as 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SceneHash(pub [u8; 32]);

/// A text that is not 64 hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a scene hash is 64 hexadecimal digits")]
pub struct SceneHashError;

impl SceneHash {
    /// The hash of a package's bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&blake3::Hash::from_bytes(self.0).to_hex())
    }
}

impl fmt::Debug for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SceneHash({self})")
    }
}

impl FromStr for SceneHash {
    type Err = SceneHashError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        blake3::Hash::from_hex(text).map(|hash| Self(*hash.as_bytes())).map_err(|_| SceneHashError)
    }
}

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
