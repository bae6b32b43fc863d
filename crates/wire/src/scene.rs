//! Scenes by content hash.

use std::fmt;

use bytes::Bytes;

use crate::error::{WireError, at_most};
use crate::limits::{MAX_MESSAGE_BYTES, MAX_SCENE_BYTES};
use crate::proto;

/// BLAKE3 of a scene package: 64 lower-case hex digits, so that it is safe as a file name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SceneHash(String);

impl SceneHash {
    /// The hash of a package.
    #[must_use]
    pub fn of(package: &[u8]) -> Self {
        Self(blake3::hash(package).to_hex().to_string())
    }

    /// Reads 64 lower-case hex digits.
    ///
    /// # Errors
    /// For anything else.
    pub fn parse(hex: &str) -> Result<Self, WireError> {
        let ok = hex.len() == 64 && hex.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        if ok {
            Ok(Self(hex.to_owned()))
        } else {
            Err(WireError::out_of_range(
                "scene_hash",
                hex.escape_debug().take(80).collect::<String>(),
                "64 lower-case hex digits",
            ))
        }
    }

    /// The digits.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A scene's name and size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneRef {
    /// Of the package's bytes.
    pub hash: SceneHash,
    /// The package's length.
    pub package_bytes: u64,
}

impl TryFrom<proto::SceneRef> for SceneRef {
    type Error = WireError;

    fn try_from(scene: proto::SceneRef) -> Result<Self, WireError> {
        if scene.package_bytes > MAX_SCENE_BYTES {
            return Err(WireError::TooMany {
                field: "package_bytes",
                count: scene.package_bytes,
                limit: MAX_SCENE_BYTES,
            });
        }
        Ok(Self { hash: SceneHash::parse(&scene.scene_hash)?, package_bytes: scene.package_bytes })
    }
}

impl From<SceneRef> for proto::SceneRef {
    fn from(scene: SceneRef) -> Self {
        Self { scene_hash: scene.hash.0, package_bytes: scene.package_bytes }
    }
}

/// Asks for a scene's package from an offset on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchScene {
    /// Which.
    pub hash: SceneHash,
    /// What the asker already has.
    pub offset_bytes: u64,
}

impl TryFrom<proto::FetchSceneRequest> for FetchScene {
    type Error = WireError;

    fn try_from(request: proto::FetchSceneRequest) -> Result<Self, WireError> {
        Ok(Self { hash: SceneHash::parse(&request.scene_hash)?, offset_bytes: request.offset_bytes })
    }
}

impl From<FetchScene> for proto::FetchSceneRequest {
    fn from(request: FetchScene) -> Self {
        Self { scene_hash: request.hash.0, offset_bytes: request.offset_bytes }
    }
}

/// A piece of a scene's package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenePart {
    /// Where it starts.
    pub offset_bytes: u64,
    /// What it holds.
    pub data: Bytes,
}

impl TryFrom<proto::FetchSceneResponse> for ScenePart {
    type Error = WireError;

    fn try_from(part: proto::FetchSceneResponse) -> Result<Self, WireError> {
        at_most(part.data.len(), MAX_MESSAGE_BYTES, "data")?;
        Ok(Self { offset_bytes: part.offset_bytes, data: part.data })
    }
}

impl From<ScenePart> for proto::FetchSceneResponse {
    fn from(part: ScenePart) -> Self {
        Self { offset_bytes: part.offset_bytes, data: part.data }
    }
}

/// Puts a package together and checks it against its hash.
#[derive(Debug)]
pub struct SceneAssembly {
    scene: SceneRef,
    package: Vec<u8>,
}

impl SceneAssembly {
    /// Nothing yet. No more is allocated than has come.
    #[must_use]
    pub fn new(scene: SceneRef) -> Self {
        Self { scene, package: Vec::new() }
    }

    /// Adds the next part.
    ///
    /// # Errors
    /// For a part out of order or beyond the announced size.
    pub fn push(&mut self, part: &ScenePart) -> Result<(), WireError> {
        let have = self.package.len() as u64;
        if part.offset_bytes != have {
            return Err(WireError::out_of_range("offset_bytes", part.offset_bytes, "where the part before ended"));
        }
        let count = have + part.data.len() as u64;
        if count > self.scene.package_bytes {
            return Err(WireError::TooMany { field: "data", count, limit: self.scene.package_bytes });
        }
        self.package.extend_from_slice(&part.data);
        Ok(())
    }

    /// The whole package.
    ///
    /// # Errors
    /// Where it is truncated or is not what its hash says.
    pub fn finish(self) -> Result<Vec<u8>, WireError> {
        let (have, want) = (self.package.len() as u64, self.scene.package_bytes);
        if have != want {
            return Err(WireError::corrupt("scene", format!("{have} bytes came of {want}")));
        }
        if SceneHash::of(&self.package) != self.scene.hash {
            return Err(WireError::corrupt("scene", "the bytes do not have the hash"));
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
        assert_eq!(SceneHash::parse(good.as_str()), Ok(good.clone()));
        for bad in
            ["", "../../etc/passwd", &good.as_str().to_uppercase(), &good.as_str()[1..], &"%2e".repeat(22)[..64], "\0"]
        {
            assert!(SceneHash::parse(bad).expect_err(bad).to_string().contains("scene_hash"));
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
