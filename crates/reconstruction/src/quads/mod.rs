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
pub(crate) use cut::CHUNK;
#[cfg(test)]
pub(crate) use cut::GpuCutWork;
#[cfg(test)]
pub(crate) use draw::GpuQuadWork;
pub(crate) use draw::{DrawQuads, QuadDrawing};
pub(crate) use list::{Count, Indices, Scan};
pub(crate) use merge::{GREATEST_EXTENT, Merge};
pub(crate) use mesh::{Cut, INDICES_A_QUAD, Mesh, QuadVertices, SetMeshes};
pub use mesh::{ErrorBound, MeshStatistics, Quad};
pub(crate) use resolve::{Resolve, record};
pub(crate) use targets::QuadTargets;

pub(crate) const SHADERS: [(&str, &str); 7] = gpu::wgsl_files! {
    "cut.wgsl", "count.wgsl", "scan.wgsl", "indices.wgsl", "merge.wgsl", "draw.wgsl", "resolve.wgsl"
};
