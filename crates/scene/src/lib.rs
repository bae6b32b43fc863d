//! Scenes: triangles, materials, lights, wind and animation; import of glTF, OBJ and PLY; procedural scenes;
//! packages for the transfer between nodes.
//!
//! World space is right-handed, in metres, +Y up (glTF). Positions are `f32` around
//! [`Scene::source_space`], so that geometry in national-grid coordinates loses no precision.
//!
//! Every scene from a file ([`load_file`]) or from a peer ([`unpack`]) has passed [`Scene::validate`]. Sizes are
//! checked against [`Limits`] before memory is allocated for them. A refusal is a [`SceneError`] that names the file,
//! the element and the reason.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod animation;
mod bounds;
mod error;
mod import;
mod light_rig;
mod light_spec;
mod limits;
mod model;
mod package;
mod pose;
pub mod procedural;
mod spec;
mod up_axis;
mod validate;

use animation::is_invertible;
pub use animation::{
    Animation, Channel, Clip, Influence, Interpolation, Joint, MovingInstance, Node, NodeTransform, Property,
    TransformParts, UnknownClip,
};
pub use depth_image::{Environment, EnvironmentMap, Illumination, Light, LightError, SourceSpace};
use error::{Fault, at_most, shortened};
pub use error::{SceneError, SceneErrorKind};
pub use import::{ImportOptions, MissingTextures, MissingTexturesError, load_environment, load_file};
pub use light_spec::{EnvironmentSpec, LightSpec, LightSpecError};
pub use limits::{Limits, MAX_COORDINATE_M};
pub use model::*;
pub use package::{pack, unpack};
pub use spec::{BUILT_IN_NAMES, ProceduralScene, SceneSpec, SceneSpecError};
pub use up_axis::{UpAxis, UpAxisError};
