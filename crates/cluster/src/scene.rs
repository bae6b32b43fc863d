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

/// Why the parts of a scene make no package.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum SceneAssemblyError {
    #[error("offset_bytes is {offset_bytes}, must be {expected}: where the part before ended")]
    Offset { offset_bytes: u64, expected: u64 },
    #[error("data has {count}, at most {limit} are allowed")]
    TooLong { count: u64, limit: u64 },
    #[error("scene is truncated: {count} of {expected} bytes were received")]
    Truncated { count: u64, expected: u64 },
    #[error("scene is corrupt: the bytes do not have the hash")]
    Hash,
}

/// Puts a package together and checks it against its hash.
#[derive(Debug)]
pub struct SceneAssembly {
    scene: SceneRef,
    package: Vec<u8>,
}

impl SceneAssembly {
    /// An empty package. No more is allocated than has been received.
    #[must_use]
    pub fn new(scene: SceneRef) -> Self {
        Self { scene, package: Vec::new() }
    }

    /// Adds the next part.
    ///
    /// # Errors
    /// For a part out of order or beyond the announced size.
    pub fn push(&mut self, part: &ScenePart) -> Result<(), SceneAssemblyError> {
        let have = self.package.len() as u64;
        if part.offset_bytes != have {
            return Err(SceneAssemblyError::Offset { offset_bytes: part.offset_bytes, expected: have });
        }
        let count = have + part.data.len() as u64;
        if count > self.scene.package_bytes {
            return Err(SceneAssemblyError::TooLong { count, limit: self.scene.package_bytes });
        }
        self.package.extend_from_slice(&part.data);
        Ok(())
    }

    /// The whole package.
    ///
    /// # Errors
    /// Where it is truncated or is not what its hash says.
    pub fn finish(self) -> Result<Vec<u8>, SceneAssemblyError> {
        let have = self.package.len() as u64;
        let want = self.scene.package_bytes;
        if have != want {
            return Err(SceneAssemblyError::Truncated { count: have, expected: want });
        }
        if SceneHash::of(&self.package) != self.scene.hash {
            return Err(SceneAssemblyError::Hash);
        }
        Ok(self.package)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(offset_bytes: u64, data: &'static [u8]) -> ScenePart {
        ScenePart { offset_bytes, data: Bytes::from_static(data) }
    }

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

    #[test]
    fn packages_are_whole_and_in_order() {
        let scene = SceneRef { hash: SceneHash::of(b"abcdef"), package_bytes: 6 };
        let mut whole = SceneAssembly::new(scene.clone());
        whole.push(&part(0, b"abc")).unwrap();
        assert!(whole.push(&part(0, b"abc")).is_err(), "twice");
        assert!(whole.push(&part(3, b"defg")).is_err(), "too long");
        whole.push(&part(3, b"def")).unwrap();
        assert_eq!(whole.finish().unwrap(), b"abcdef");
        let mut truncated = SceneAssembly::new(scene.clone());
        truncated.push(&part(0, b"abc")).unwrap();
        assert!(truncated.finish().is_err());
        let mut corrupt = SceneAssembly::new(scene);
        corrupt.push(&part(0, b"abcdeg")).unwrap();
        assert!(corrupt.finish().unwrap_err().to_string().contains("hash"));
    }
}
