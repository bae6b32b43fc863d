//! The plan: which node does what.

use std::num::NonZeroU32;

use codec::SampleSetId;
use depth_image::{PinholeCamera, SampleCamera};

use crate::audit::AuditOrder;
use crate::check::{InvalidField, text, tile_count};
use crate::policy::Policy;
use crate::workload::{SetContent, Workload};

/// The images, or tiles of images, that one node samples. It samples them of every set, or, where every sampler has all of
/// them, of every set whose turn it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplerShare {
    /// The node's unique name.
    pub node_name: String,
    /// Where the node is reached, as `http://host:port`.
    pub address: String,
    /// Indices into [`Assignment::sampled_cameras`].
    pub image_indices: Vec<u32>,
}

/// A node that makes views.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompositorShare {
    /// The node's unique name.
    pub node_name: String,
    /// Where the node is reached, as `http://host:port`.
    pub address: String,
    /// Its initial share of the views of a set, in proportion; compositors that finish first take views from others.
    pub view_weight: u32,
}

/// The plan of one workload. Every node of it gets the same and finds its own roles in it: one, both or none.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Fences: a node refuses a lower one than it has of this workload. No two plans of a coordinator have the same.
    pub plan_epoch: u64,
    /// The workload's number at the coordinator, which stays the same from plan to plan.
    pub workload_number: u64,
    /// How views come about.
    pub policy: Policy,
    /// The images to sample, when and how.
    pub workload: Workload,
    /// None in the direct policy.
    pub samplers: Vec<SamplerShare>,
    /// At least one.
    pub compositors: Vec<CompositorShare>,
    /// T: each sample image is cut into this many tiles, one above the other, and samplers treat every tile as an image. The
    /// tiles of image i are i · T to (i + 1) · T - 1, top to bottom. At least 1.
    pub tile_count: u32,
    /// F: the first F compositors ask samplers for images and relay them to F others each, which relay them in turn.
    /// `None`: all ask samplers.
    pub relay_fanout: Option<NonZeroU32>,
    /// How the views of all sessions are reconstructed: under a fallback, and in a representation that a budget chose. `None`: as
    /// each session asks.
    pub method: Option<String>,
    /// `None`: no promise is audited.
    pub audit: Option<AuditOrder>,
}

/// A plan on its way to a node, and the workloads that are open when it is sent.
#[derive(Debug, Clone, PartialEq)]
pub struct ApplyPlan {
    /// The plan.
    pub assignment: Assignment,
    /// Numbers of all open workloads. Empty: a coordinator that has just started does not know them yet.
    pub open_workloads: Vec<u64>,
}

impl ApplyPlan {
    /// Whether a workload has ended. Numbers are above all epochs before them: one above this plan's is of a workload that
    /// may have begun since.
    #[must_use]
    pub fn has_ended(&self, workload_number: u64) -> bool {
        !self.open_workloads.is_empty()
            && workload_number <= self.assignment.plan_epoch
            && workload_number != self.assignment.workload_number
            && !self.open_workloads.contains(&workload_number)
    }
}

impl Assignment {
    /// The cameras of all images that are sampled: of the set's images, or of their tiles.
    #[must_use]
    pub fn sampled_cameras(&self) -> Vec<SampleCamera> {
        let cameras = self.workload.sample_cameras.iter();
        cameras.flat_map(|camera| (0..self.tile_count).map(move |tile| camera.tile(tile, self.tile_count))).collect()
    }

    /// The compositor that relays images to this one; `None` where it asks the samplers.
    #[must_use]
    pub fn relay_of(&self, node_name: &str) -> Option<&CompositorShare> {
        let fanout = self.relay_fanout?.get() as usize;
        let place = self.compositors.iter().position(|share| share.node_name == node_name)?;
        (place / fanout).checked_sub(1).map(|relay| &self.compositors[relay])
    }

    /// Whether other compositors ask this node for images.
    #[must_use]
    pub fn relays(&self, node_name: &str) -> bool {
        let mut relays = self.compositors.iter().filter_map(|share| self.relay_of(&share.node_name));
        relays.any(|relay| relay.node_name == node_name)
    }

    /// The samplers of a set: all of them, or, where they take turns, the one whose turn it is.
    #[must_use]
    pub fn samplers_of(&self, set_index: u32) -> &[SamplerShare] {
        match self.sets_in_turn() {
            true => std::slice::from_ref(&self.samplers[set_index as usize % self.samplers.len()]),
            false => &self.samplers,
        }
    }

    /// The number of sets that can be sampled at the same time.
    #[must_use]
    pub fn sets_at_once(&self) -> u32 {
        if self.sets_in_turn() { self.samplers.len() as u32 } else { 1 }
    }

    /// The view cell from whose images a view is made; 0 for views that are drawn directly.
    #[must_use]
    pub fn cell_of(&self, view: &PinholeCamera) -> u32 {
        if self.policy == Policy::Direct { 0 } else { self.workload.cell_of(view) }
    }

    /// The same plan for one cell alone, its cameras and their samplers; `None` beyond the last cell.
    #[must_use]
    pub fn of_cell(&self, cell: u32) -> Option<Self> {
        let cameras = self.workload.cameras_of_cell(cell as usize)?;
        let images = cameras.start as u32 * self.tile_count..cameras.end as u32 * self.tile_count;
        let samplers = self.samplers.iter().map(|share| {
            let of_cell = share.image_indices.iter().filter(|image| images.contains(image));
            SamplerShare { image_indices: of_cell.map(|image| image - images.start).collect(), ..share.clone() }
        });
        Some(Self {
            workload: self.workload.of_cell(cell as usize)?,
            samplers: samplers.filter(|share| !share.image_indices.is_empty()).collect(),
            compositors: self.compositors.clone(),
            method: self.method.clone(),
            audit: self.audit.clone(),
            ..*self
        })
    }

    /// The number of images, or tiles of images, of a set.
    #[must_use]
    pub fn image_count(&self) -> usize {
        self.workload.sample_cameras.len() * self.tile_count as usize
    }

    fn sets_in_turn(&self) -> bool {
        let all = self.image_count();
        self.samplers.len() > 1 && self.samplers.iter().all(|share| share.image_indices.len() == all)
    }

    /// The images that a node samples of a set.
    #[must_use]
    pub fn images_of(&self, node_name: &str, set_index: u32) -> &[u32] {
        let share = self.samplers_of(set_index).iter().find(|share| share.node_name == node_name);
        share.map_or(&[], |share| &share.image_indices)
    }

    /// Whether a node makes views.
    #[must_use]
    pub fn composites(&self, node_name: &str) -> bool {
        self.compositors.iter().any(|share| share.node_name == node_name)
    }

    /// A set's name in this plan; `None` beyond the timeline.
    #[must_use]
    pub fn sample_set_id(&self, set_index: u32) -> Option<SampleSetId> {
        (set_index < self.workload.timeline.set_count)
            .then(|| SampleSetId { plan_epoch: self.plan_epoch, index: set_index.into() })
    }

    /// The content of a set, in a plan [of one cell](Self::of_cell); `None` beyond the timeline.
    #[must_use]
    pub fn set_content(&self, set_index: u32) -> Option<SetContent> {
        SetContent::of(&self.workload, set_index)
    }

    /// # Errors
    /// For values that no peer may send: every image has one sampler a set, and there is a compositor.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.workload.validate()?;
        self.audit.as_ref().map_or(Ok(()), AuditOrder::validate)?;
        text(self.method.as_deref().unwrap_or_default(), "assignment.reconstruction_method")?;
        tile_count(self.tile_count)?;
        let image_count = self.image_count();
        let mut sampled = vec![0u32; image_count];
        for &index in self.samplers.iter().flat_map(|share| &share.image_indices) {
            match sampled.get_mut(index as usize) {
                Some(times) => *times += 1,
                None => return Err(InvalidField::out_of_range("image_indices", index, "of an image or a tile")),
            }
        }
        let each = self.sets_at_once();
        if self.policy != Policy::Direct && (image_count == 0 || sampled.iter().any(|&times| times != each)) {
            let given = format!("{sampled:?} times");
            return Err(InvalidField::out_of_range("image_indices", given, "each image once a set"));
        }
        if self.compositors.is_empty() { Err(InvalidField::Missing { field: "compositors" }) } else { Ok(()) }
    }
}
