//! A scene as bytes, named by their hash: what travels between nodes.

mod hash;
mod layout;
mod store;

pub use hash::{SceneHash, SceneHashError};
pub use store::PackageStore;

use crate::{Limits, Scene, SceneError};

/// A packed scene. The same scene always gives the same bytes, and the same bytes the same hash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Of `bytes`.
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

/// Unpacks a scene and validates it: the bytes may come from anyone. Does not check their hash.
///
/// # Errors
/// Names the part of the package at fault. Takes no more memory than a few times the bytes' length.
pub fn unpack(bytes: &[u8], limits: &Limits) -> Result<Scene, SceneError> {
    let scene = layout::scene_from_bytes(bytes, limits);
    let checked = scene.and_then(|scene| scene.check(limits).map(|()| scene));
    checked.map_err(|fault| fault.in_file("package"))
}
