//! A scene as bytes that are named by their hash, for the transfer between nodes.

mod hash;
mod layout;
mod store;

pub use hash::{SceneHash, SceneHashError};
pub use store::PackageStore;

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
