//! One resolved configuration; where its values come from is the program's business.

use std::path::PathBuf;
use std::time::Duration;

/// A node's configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeConfig {
    /// Unique in the cluster.
    pub node_name: String,
    /// The coordinator, as `http://host:port`.
    pub coordinator: String,
    /// Where others reach this node; `None`: the address it listens on.
    pub advertised_address: Option<String>,
    /// Scene packages by hash.
    pub scene_folder: Option<PathBuf>,
    /// Allows another bind address than loopback, without TLS.
    pub insecure_bind: bool,
    /// Says by reflection what services and messages there are.
    pub reflection: bool,
    /// Most bytes of encoded sample images that are kept for compositors that come later.
    pub kept_sample_bytes: usize,
    /// How long to wait.
    pub deadlines: Deadlines,
    /// How much to take on.
    pub quotas: Quotas,
}

impl NodeConfig {
    /// The defaults.
    #[must_use]
    pub fn new(node_name: impl Into<String>, coordinator: impl Into<String>) -> Self {
        Self {
            node_name: node_name.into(),
            coordinator: coordinator.into(),
            advertised_address: None,
            scene_folder: None,
            insecure_bind: false,
            reflection: false,
            kept_sample_bytes: 1 << 30,
            deadlines: Deadlines::default(),
            quotas: Quotas::default(),
        }
    }
}

/// How long a stream may be silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// A client's stream of poses, while none of its frames is due.
    pub idle: Duration,
    /// A sampler's first chunk: the device may be slow.
    pub work: Duration,
    /// Between chunks of what is ready.
    pub chunk: Duration,
    /// A client that takes none of the frames that are ready for it.
    pub stall: Duration,
}

impl Default for Deadlines {
    fn default() -> Self {
        Self {
            idle: Duration::from_secs(60),
            work: Duration::from_secs(300),
            chunk: Duration::from_secs(10),
            stall: Duration::from_secs(30),
        }
    }
}

/// What a node takes on for all its clients together. What is beyond is refused with `RESOURCE_EXHAUSTED`, before memory
/// is taken for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quotas {
    /// Clients' streams that are open.
    pub streams: usize,
    /// Views of batches that wait, or are not sent yet.
    pub views: usize,
    /// Pixels of them; and as many of live streams' views.
    pub pixels: usize,
}

impl Default for Quotas {
    fn default() -> Self {
        Self { streams: 1024, views: 4096, pixels: 256 << 20 }
    }
}
