//! Sample images as quads: cut, merged, listed, drawn into views, and resolved.

mod build;
mod corner_planes;
mod count;
mod cut;
mod draw;
mod indices;
mod merge;
mod mesh;
mod passes;
mod resolve;
mod scan;

pub(crate) use build::{build, read};
pub(crate) use corner_planes::CornerPlanes;
#[cfg(test)]
pub(crate) use cut::GpuCutWork;
pub(crate) use cut::context;
#[cfg(test)]
pub(crate) use draw::GpuQuadWork;
#[cfg(feature = "scalar")]
pub(crate) use merge::GREATEST_EXTENT;
pub(crate) use merge::{Merge, record as merge};
pub(crate) use mesh::{Cut, Mesh, QuadVertices, SetMeshes};
pub use mesh::{MeshStatistics, Quad};
pub(crate) use passes::QuadPasses;

use gpu::{ShaderError, ShaderSource, Templates, sources as of};

pub(crate) const SHADERS: [(&str, &str); 7] = [
    ("cut.wgsl", include_str!("cut.wgsl")),
    count::SHADER,
    scan::SHADER,
    indices::SHADER,
    merge::SHADER,
    draw::SHADER,
    resolve::SHADER,
];

/// The texts of all variants of all passes over quads.
pub(crate) fn sources(templates: &Templates) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    let list =
        of::<count::Count>(templates).chain(of::<scan::Scan>(templates)).chain(of::<indices::Indices>(templates));
    let draw = of::<draw::DrawQuads>(templates).chain(of::<resolve::Resolve>(templates));
    list.chain(of::<Merge>(templates)).chain(draw)
}
