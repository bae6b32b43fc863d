//! The rules of ARCHITECTURE.md, checked on the crate graph, on the sources and on every variant of every shader.

// Apart from the clusters of `suite`, whose deadlines need the cores that these checks keep busy.
mod architecture;
mod methods;
mod shaders;
mod structure;
