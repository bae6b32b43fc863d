//! Images that a compositor asks a sampler or a relay for.

use crate::check::at_most;
use crate::error::InvalidField;
use crate::limits::{MAX_SAMPLE_CAMERAS, MAX_TILES};

/// Asks for encoded images of one set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchImages {
    /// The epoch of the asker's plan.
    pub plan_epoch: u64,
    /// Index into the timeline.
    pub set_index: u32,
    /// Index into the workload's view cells.
    pub cell: u32,
    /// Indices into [`Assignment::sampled_cameras`](crate::Assignment::sampled_cameras) of the cell: images that the
    /// sampler samples, or that a relay relays.
    pub image_indices: Vec<u32>,
}

impl FetchImages {
    /// # Errors
    /// For no images, and for more than a set may have.
    pub fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.image_indices.len(), MAX_SAMPLE_CAMERAS * MAX_TILES as usize, "image_indices")?;
        if self.image_indices.is_empty() { Err(InvalidField::Missing { field: "image_indices" }) } else { Ok(()) }
    }
}
