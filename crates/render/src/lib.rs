//! Triangles on the GPU: what sampling and direct rendering share.
