//! The axis of a file that points upwards.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use glam::{Affine3A, DMat3, DVec3, Mat3A, Vec3, Vec3A};

use crate::Scene;

/// The axis of a scene file that points upwards; in the world it is +Y.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// The file's x; its y points to the left in the world.
    X,
    /// The file's y, as glTF has it.
    #[default]
    Y,
    /// The file's z; its y points backwards in the world.
    Z,
}

/// A text that names no axis, or an axis that a scene cannot have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UpAxisError {
    /// The text is no axis.
    #[error("{0:?} is none of x, y and z")]
    Unknown(String),
    /// The format defines its axes, or the scene is not from a file.
    #[error("up {up}: {scene} is +Y up; only .obj and .ply files have another axis")]
    #[allow(missing_docs, reason = "self-naming fields")]
    Fixed { up: UpAxis, scene: String },
}

impl UpAxis {
    /// Whether a file's format leaves its axes open.
    ///
    /// # Errors
    /// For another axis than y where the format defines it.
    pub fn check(self, file: &Path) -> Result<(), UpAxisError> {
        let ending = file.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
        if self == Self::Y || ["obj", "ply"].contains(&ending.as_str()) {
            return Ok(());
        }
        Err(UpAxisError::Fixed { up: self, scene: file.display().to_string() })
    }

    /// A rotation by quarter turns: it changes no bit of a number but its sign.
    fn world_from_file(self) -> [Vec3; 3] {
        match self {
            Self::X => [Vec3::Y, Vec3::NEG_X, Vec3::Z],
            Self::Y => [Vec3::X, Vec3::Y, Vec3::Z],
            Self::Z => [Vec3::X, Vec3::NEG_Z, Vec3::Y],
        }
    }
}

impl Scene {
    /// Turns the geometry and the cameras of a scene whose file has this axis upwards, so that it is +Y up. Lights stay:
    /// OBJ and PLY files have none, and default lights are the world's. [`Scene::source_space`] is turned too: the
    /// source's space is that of the turned file.
    #[must_use]
    pub fn turned_upright(mut self, up: UpAxis) -> Self {
        if up == UpAxis::Y {
            return self;
        }
        let [x, y, z] = up.world_from_file();
        let turn = Affine3A::from_mat3(Mat3A::from_cols(Vec3A::from(x), Vec3A::from(y), Vec3A::from(z)).into());
        self.instances.iter_mut().for_each(|i| i.world_from_mesh = turn * i.world_from_mesh);
        self.cameras.iter_mut().for_each(|camera| camera.world_from_camera = turn * camera.world_from_camera);
        let turn = DMat3::from_cols(x.as_dvec3(), y.as_dvec3(), z.as_dvec3());
        self.source_space.origin_in_source = turn * self.source_space.origin_in_source + DVec3::ZERO;
        self
    }
}

impl FromStr for UpAxis {
    type Err = UpAxisError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let named = [Self::X, Self::Y, Self::Z].into_iter().find(|axis| axis.to_string() == text);
        named.ok_or_else(|| UpAxisError::Unknown(text.to_owned()))
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, SourceSpace};

    #[test]
    fn the_axis_of_a_file_points_up_in_the_world() {
        for (up, axis) in [(UpAxis::X, Vec3::X), (UpAxis::Y, Vec3::Y), (UpAxis::Z, Vec3::Z)] {
            let scene = Scene {
                instances: vec![Instance { mesh: 0, world_from_mesh: Affine3A::IDENTITY }],
                source_space: SourceSpace::moved(axis.as_dvec3() * 7.0),
                ..Scene::default()
            };
            let turned = scene.turned_upright(up);
            let world_from_mesh = turned.instances[0].world_from_mesh;
            assert_eq!(world_from_mesh.transform_point3(axis * 0.1), Vec3::Y * 0.1, "{up}");
            assert_eq!(world_from_mesh.matrix3.determinant(), 1.0, "{up} is no mirror");
            assert_eq!(turned.source_space.origin_in_source, DVec3::Y * 7.0, "{up}");
            assert_eq!(up.to_string().parse(), Ok(up));
        }
    }

    #[test]
    fn another_axis_is_refused_where_the_format_defines_it() {
        assert_eq!(UpAxis::Z.check(Path::new("a/b.OBJ")), Ok(()));
        assert_eq!(UpAxis::Y.check(Path::new("b.glb")), Ok(()));
        let error = UpAxis::Z.check(Path::new("b.glb")).unwrap_err();
        assert!(error.to_string().contains("b.glb is +Y up"), "{error}");
        assert_eq!("w".parse::<UpAxis>(), Err(UpAxisError::Unknown("w".into())));
    }
}
