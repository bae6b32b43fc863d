//! Scenes by content hash.

use std::fmt;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::check::InvalidField;
use crate::limits::MAX_SCENE_BYTES;

/// BLAKE3 of a scene package: 64 lower-case hex digits, so that it is safe as a file name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SceneHash(String);

impl SceneHash {
    /// The hash of a package.
    #[must_use]
    pub fn of(package: &[u8]) -> Self {
        Self(blake3::hash(package).to_hex().to_string())
    }

    /// The digits.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for SceneHash {
    type Error = InvalidField;

    fn try_from(hex: String) -> Result<Self, InvalidField> {
        if hex.len() == 64 && hex.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f')) {
            return Ok(Self(hex));
        }
        let start: String = hex.escape_debug().take(80).collect();
        Err(InvalidField::out_of_range("scene_hash", start, "64 lower-case hex digits"))
    }
}

impl From<SceneHash> for String {
    fn from(hash: SceneHash) -> Self {
        hash.0
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A scene's name and size.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneRef {
    /// The hash of the package's bytes.
    pub hash: SceneHash,
    /// The package's length.
    pub package_bytes: u64,
}

impl SceneRef {
    /// # Errors
    /// For a package over the limit.
    pub fn validate(&self) -> Result<(), InvalidField> {
        match self.package_bytes {
            0..=MAX_SCENE_BYTES => Ok(()),
            count => Err(InvalidField::TooMany { field: "package_bytes", count, limit: MAX_SCENE_BYTES }),
        }
    }
}

/// Asks for a scene's package from an offset on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchScene {
    /// The scene.
    pub hash: SceneHash,
    /// Bytes that the asker already has.
    pub offset_bytes: u64,
}

/// A piece of a scene's package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenePart {
    /// Where the piece starts in the package.
    pub offset_bytes: u64,
    /// The piece.
    pub data: Bytes,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_no_hash_are_refused() {
        let good = SceneHash::of(b"scene");
        assert_eq!(SceneHash::try_from(good.to_string()), Ok(good.clone()));
        for bad in
            ["", "../../etc/passwd", &good.as_str().to_uppercase(), &good.as_str()[1..], &"%2e".repeat(22)[..64], "\0"]
        {
            assert!(SceneHash::try_from(bad.to_owned()).expect_err(bad).to_string().contains("scene_hash"));
        }
    }
}
