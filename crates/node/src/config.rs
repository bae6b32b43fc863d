//! The resolved configuration of a node; its sources are the program's.

use std::path::PathBuf;
use std::time::Duration;

use depth_image::{PinholeCamera, ViewPlanes};
use tonic::Status;

/// A node's configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeConfig {
    /// Unique in the cluster.
    pub node_name: String,
    /// The coordinator, as `http://host:port`.
    pub coordinator: String,
    /// The address at which others reach this node; `None`: the one it listens on.
    pub advertised_address: Option<String>,
    /// Scene packages by hash.
    pub scene_folder: Option<PathBuf>,
    /// Allows another bind address than loopback, without TLS.
    pub insecure_bind: bool,
    /// Most bytes of sample sets: half for sets on the device and their relayed images, half for packed images.
    pub set_memory_bytes: usize,
    /// The share of the time that views drawn from the scene by request may take while others are served: above 0, at most 1.
    pub direct_share: f64,
    /// Seconds that one view may take; one that is predicted to take longer is refused. Above 0.
    pub max_view_s: f64,
    /// Deadlines of streams.
    pub deadlines: Deadlines,
    /// Bounds on the work in flight.
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
            set_memory_bytes: 2 << 30,
            direct_share: 0.1,
            max_view_s: 120.0,
            deadlines: Deadlines::default(),
            quotas: Quotas::default(),
        }
    }
}

/// The longest silence of each kind of stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadlines {
    /// A client's stream of poses, while none of its frames is due.
    pub idle: Duration,
    /// A sampler's first chunk: the device may be slow.
    pub work: Duration,
    /// Between chunks of images that are ready.
    pub chunk: Duration,
    /// A client that takes none of the frames that wait for it.
    pub stall: Duration,
    /// A live view's set: after it, a neighbouring view cell's set of the same moment serves.
    pub neighbour: Duration,
    /// A node whose device has no memory left, until it joins again; and the least time between two openings of a device.
    pub away: Duration,
}

impl Default for Deadlines {
    fn default() -> Self {
        Self {
            idle: Duration::from_secs(60),
            work: Duration::from_secs(300),
            chunk: Duration::from_secs(10),
            stall: Duration::from_secs(30),
            neighbour: Duration::from_millis(100),
            away: Duration::from_secs(5),
        }
    }
}

/// Bounds on the work in flight for all clients together. Requests beyond are refused with `RESOURCE_EXHAUSTED`, before
/// memory is taken for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quotas {
    /// Open streams of clients.
    pub streams: usize,
    /// Views of batches that are waiting or not sent yet.
    pub views: usize,
    /// Bytes of these views and of live streams' views together, each with its frame.
    pub view_bytes: usize,
}

/// The most bytes of a view, before it is encoded, and of its frame.
#[must_use]
pub fn view_bytes(camera: &PinholeCamera, planes: ViewPlanes) -> usize {
    2 * camera.pixel_count() * planes.bytes_per_pixel()
}

impl Quotas {
    /// Checks that views that are made at once can ever have room.
    ///
    /// # Errors
    /// `INVALID_ARGUMENT` for views that take more than all views together may; it names the quota.
    pub fn check_views(&self, cameras: &[PinholeCamera], planes: ViewPlanes) -> Result<(), Status> {
        let bytes = cameras.iter().map(|camera| view_bytes(camera, planes)).fold(0, usize::saturating_add);
        let limit = self.view_bytes;
        let Some(camera) = cameras.first().filter(|_| bytes > limit) else { return Ok(()) };
        let [width, height] = camera.size_px.to_array();
        let views = if cameras.len() == 1 { "a view".to_owned() } else { format!("a batch of {}", cameras.len()) };
        Err(Status::invalid_argument(format!(
            "size_px: {views} of {width}×{height} takes {bytes} bytes with its frame, and view-memory of this node is {limit}"
        )))
    }
}

impl Default for Quotas {
    fn default() -> Self {
        Self { streams: 1024, views: 4096, view_bytes: 2 << 30 }
    }
}
