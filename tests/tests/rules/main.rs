//! The rules of ARCHITECTURE.md, checked on the crate graph, on the sources and on every variant of every shader.

// Apart from the clusters of `suite`, whose deadlines need the cores that these checks keep busy.
mod architecture;
mod habits;
mod methods;
mod shaders;
mod structure;

use std::path::{Path, PathBuf};

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace around this crate").to_owned()
}
