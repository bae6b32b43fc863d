//! Transforms of nodes and bind matrices as files have them.

use glam::{DAffine3, DMat3, DMat4, DVec3, Mat4, Quat, Vec3};
use gltf::json::Node;

use crate::animation::TransformParts;
use crate::error::Fault;

/// A node's transform to its parent. It need not have an inverse.
pub(super) fn parent_from_node(node: &Node, element: &str) -> Result<DAffine3, Fault> {
    let transform = match node.matrix {
        Some(matrix) => affine_from(Mat4::from_cols_array(&matrix).as_dmat4()),
        None => {
            let parts = parts_of(node);
            let length = parts.rotation.as_dquat().length();
            (length > 1e-6 && length.is_finite()).then(|| parts.parent_from_node())
        }
    };
    let transform = transform.filter(DAffine3::is_finite);
    transform.ok_or_else(|| Fault::malformed(element, "its transform is not finite, not affine, or has no rotation"))
}

/// `None` for a matrix that is not affine. Exporters write zeros alone to hide something.
pub(super) fn affine_from(matrix: DMat4) -> Option<DAffine3> {
    if matrix == DMat4::ZERO {
        return Some(DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO });
    }
    let is_affine = (matrix.row(3) - glam::DVec4::W).abs().max_element() < 1e-6;
    is_affine.then(|| DAffine3::from_mat4(matrix))
}

/// The parts of a node's transform as in the file; a rotation may have any length.
pub(super) fn parts_of(node: &Node) -> TransformParts {
    TransformParts {
        translation: node.translation.map_or(Vec3::ZERO, Vec3::from),
        rotation: node.rotation.map_or(Quat::IDENTITY, |r| Quat::from_array(r.0)),
        scale: node.scale.map_or(Vec3::ONE, Vec3::from),
    }
}
