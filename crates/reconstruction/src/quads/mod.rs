//! Sample images as quads: cut, merged, listed, drawn into views, and resolved.

mod build;
mod corner_planes;
mod cut;
mod draw;
mod list;
mod merge;
mod mesh;
mod resolve;
mod targets;

pub(crate) use build::{mesh, read};
#[cfg(test)]
pub(crate) use cut::GpuCutWork;
#[cfg(test)]
pub(crate) use draw::GpuQuadWork;
pub(crate) use draw::QuadDrawing;
pub(crate) use merge::GREATEST_EXTENT;
pub(crate) use merge::record as merge;
pub(crate) use mesh::{Cut, Mesh, QuadVertices, SetMeshes};
pub use mesh::{ErrorBound, MeshStatistics, Quad};
pub(crate) use resolve::record;
pub(crate) use targets::QuadTargets;

use gpu::{ShaderError, ShaderSource, Templates, shader_sources, wgsl_constants, wgsl_files};

use self::list::{Count, Indices, Scan};
use self::{cut::CHUNK, draw::DrawQuads, merge::Merge, mesh::INDICES_A_QUAD, resolve::Resolve};

pub(crate) const SHADERS: [(&str, &str); 7] = wgsl_files! {
    "cut.wgsl", "count.wgsl", "scan.wgsl", "indices.wgsl", "merge.wgsl", "draw.wgsl", "resolve.wgsl"
};

/// The numbers that shaders of quads share with Rust.
pub(crate) fn constants() -> [(&'static str, String); 2] {
    wgsl_constants![CHUNK, INDICES_A_QUAD]
}

/// The texts of all variants of all passes over quads.
pub(crate) fn sources(templates: &Templates) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    shader_sources!(templates, Count, Scan, Indices, Merge, DrawQuads, Resolve)
}
