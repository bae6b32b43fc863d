//! Scenes by content hash.

use cluster::{FetchScene, SceneHash, ScenePart, SceneRef, at_most};

use crate::error::WireError;
use crate::proto;
use crate::rpc::MAX_MESSAGE_BYTES;

impl TryFrom<proto::SceneRef> for SceneRef {
    type Error = WireError;

    fn try_from(s: proto::SceneRef) -> Result<Self, WireError> {
        let scene = Self { hash: SceneHash::parse(&s.scene_hash)?, package_bytes: s.package_bytes };
        scene.validate()?;
        Ok(scene)
    }
}

impl From<SceneRef> for proto::SceneRef {
    fn from(scene: SceneRef) -> Self {
        Self { scene_hash: scene.hash.into(), package_bytes: scene.package_bytes }
    }
}

impl TryFrom<proto::FetchSceneRequest> for FetchScene {
    type Error = WireError;

    fn try_from(request: proto::FetchSceneRequest) -> Result<Self, WireError> {
        Ok(Self { hash: SceneHash::parse(&request.scene_hash)?, offset_bytes: request.offset_bytes })
    }
}

impl From<FetchScene> for proto::FetchSceneRequest {
    fn from(request: FetchScene) -> Self {
        Self { scene_hash: request.hash.into(), offset_bytes: request.offset_bytes }
    }
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
