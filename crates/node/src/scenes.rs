//! Scenes by hash: from the mounted folder, or else from the coordinator.

use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{fs, io};

use cluster::{FetchScene, SceneHash, ScenePart, SceneRef};
use tonic::Status;
use wire::rpc::{CoordinatorClient, connect};

use crate::blocking::blocking;
use crate::engine::{Engine, EngineError};
use crate::parts::NodeParts;
use crate::streams::next_within;

impl NodeParts {
    /// Makes sure that the device has a scene; gives the seconds that this took, 0 where it was loaded already.
    ///
    /// # Errors
    /// Where it cannot be found, does not have its hash, or cannot be loaded.
    pub async fn ensure_scene(&self, scene: &SceneRef) -> Result<f64, Status> {
        // A plan whose scene is there does not wait for the scene of another.
        if self.engine.has_scene(scene.hash.as_str()) {
            return Ok(0.0);
        }
        let _one = self.loading.lock().await;
        if self.engine.has_scene(scene.hash.as_str()) {
            return Ok(0.0);
        }
        let start = Instant::now();
        let folder = self.config.scene_folder.clone();
        let hash = scene.hash.clone();
        let stored = blocking(move || folder.map_or(Ok(None), |folder| read_verified(&folder, &hash)));
        let package = match stored.await? {
            Some(package) => package,
            None => self.fetch_scene(scene).await?,
        };
        let engine = self.engine.clone();
        let hash = scene.hash.clone();
        blocking(move || engine.load_scene(hash.as_str(), &package)).await?;
        let seconds = start.elapsed().as_secs_f64();
        tracing::info!(scene = %scene.hash, seconds, "scene loaded");
        Ok(seconds)
    }

    /// Does work on the device, on a blocking thread. Where a scene that it needs has left the device since the plan was
    /// applied, the scene is loaded and the work done again.
    ///
    /// # Errors
    /// The work's own, and those of [`NodeParts::ensure_scene`].
    pub async fn on_device<T: Send + 'static>(
        &self,
        scene: &SceneRef,
        work: impl Fn(&dyn Engine) -> Result<T, EngineError> + Clone + Send + 'static,
    ) -> Result<T, Status> {
        let attempt = || {
            let engine = self.engine.clone();
            let work = work.clone();
            blocking(move || Ok::<_, Status>(work(engine.as_ref())))
        };
        match attempt().await? {
            Err(EngineError::UnknownScene { .. }) => {
                self.ensure_scene(scene).await?;
                Ok(attempt().await??)
            }
            done => Ok(done?),
        }
    }

    async fn fetch_scene(&self, scene: &SceneRef) -> Result<Vec<u8>, Status> {
        // A channel of its own: bulk must not hold up membership.
        let client = CoordinatorClient::new(connect(&self.config.coordinator).await?);
        let mut parts = client.fetch_scene(FetchScene { hash: scene.hash.clone(), offset_bytes: 0 }).await?;
        // No more is allocated than has been received.
        let mut package = Vec::new();
        while let Some(part) = next_within(&mut parts, self.config.deadlines.chunk, "scene").await? {
            append(&mut package, &part, scene.package_bytes)?;
        }
        let folder = self.config.scene_folder.clone();
        let scene = scene.clone();
        blocking(move || {
            check_package(&package, &scene)?;
            store(folder.as_deref(), &scene.hash, &package);
            Ok::<_, Status>(package)
        })
        .await
    }
}

/// Adds the next part of a package, unless it is out of order or beyond the announced size.
fn append(package: &mut Vec<u8>, part: &ScenePart, package_bytes: u64) -> Result<(), Status> {
    let have = package.len() as u64;
    if part.offset_bytes != have {
        let offset = part.offset_bytes;
        return Err(Status::data_loss(format!(
            "offset_bytes is {offset}, must be {have}: where the part before ended"
        )));
    }
    let count = have + part.data.len() as u64;
    if count > package_bytes {
        return Err(Status::data_loss(format!("data has {count}, at most {package_bytes} are allowed")));
    }
    package.extend_from_slice(&part.data);
    Ok(())
}

/// Checks that a package is whole and has its hash.
fn check_package(package: &[u8], scene: &SceneRef) -> Result<(), Status> {
    if package.len() as u64 != scene.package_bytes {
        let count = package.len();
        let expected = scene.package_bytes;
        return Err(Status::data_loss(format!("scene is truncated: {count} of {expected} bytes were received")));
    }
    if SceneHash::of(package) != scene.hash {
        return Err(Status::data_loss("scene is corrupt: the bytes do not have the hash"));
    }
    Ok(())
}

fn file_of(folder: &Path, hash: &SceneHash) -> PathBuf {
    folder.join(format!("{hash}.scene"))
}

/// A file without the hash in its name counts as absent: it may be half written.
fn read_verified(folder: &Path, hash: &SceneHash) -> Result<Option<Vec<u8>>, Status> {
    let package = match fs::read(file_of(folder, hash)) {
        Ok(package) => package,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Status::internal(format!("scene {hash}: {error}"))),
    };
    let right = SceneHash::of(&package) == *hash;
    if !right {
        tracing::warn!(scene = %hash, "the file in the scene folder does not have its hash");
    }
    Ok(right.then_some(package))
}

/// Stores a package for the next start; a folder that cannot be written to is no failure.
fn store(folder: Option<&Path>, hash: &SceneHash, package: &[u8]) {
    let Some(folder) = folder else { return };
    let partial = folder.join(format!("{hash}.{}.partial", std::process::id()));
    let stored = fs::write(&partial, package).and_then(|()| fs::rename(&partial, file_of(folder, hash)));
    if let Err(error) = stored {
        tracing::debug!(scene = %hash, %error, "the scene folder is not writable");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_whole_and_in_order() {
        let part = |offset_bytes, data: &'static [u8]| ScenePart { offset_bytes, data: data.into() };
        let scene = SceneRef { hash: SceneHash::of(b"abcdef"), package_bytes: 6 };
        let mut package = Vec::new();
        append(&mut package, &part(0, b"abc"), 6).unwrap();
        assert!(append(&mut package, &part(0, b"abc"), 6).is_err(), "twice");
        assert!(append(&mut package, &part(3, b"defg"), 6).is_err(), "too long");
        assert!(check_package(&package, &scene).is_err(), "truncated");
        append(&mut package, &part(3, b"def"), 6).unwrap();
        assert_eq!((&*package, check_package(&package, &scene).is_ok()), (&b"abcdef"[..], true));
        assert!(check_package(b"abcdeg", &scene).unwrap_err().message().contains("hash"));
    }

    #[test]
    fn a_file_without_its_hash_counts_as_absent() {
        let folder = tempfile::tempdir().unwrap();
        let hash = SceneHash::of(b"scene");
        assert_eq!(read_verified(folder.path(), &hash).unwrap(), None);
        store(Some(folder.path()), &hash, b"scene");
        assert_eq!(read_verified(folder.path(), &hash).unwrap().as_deref(), Some(&b"scene"[..]));
        fs::write(file_of(folder.path(), &hash), b"scenery").unwrap();
        assert_eq!(read_verified(folder.path(), &hash).unwrap(), None);
    }
}
