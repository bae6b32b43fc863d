//! The plan: which node does what.

use std::fmt;
use std::num::NonZeroU32;

use depth_image::{Camera, PinholeCamera};
use prost::Message as _;
use tonic::metadata::{MetadataMap, MetadataValue};
use tonic::{Code, Status};

use crate::codec::SampleSetId;
use crate::error::{WireError, at_most, required};
use crate::limits::{MAX_CELLS, MAX_NODES, MAX_SAMPLE_CAMERAS, MAX_TILES, nonempty};
use crate::{Workload, proto};

/// Of a refusal: the plan in force.
const PLAN_KEY: &str = "myriorama-plan-bin";
/// In base64 it must fit the 16 KiB of headers that peers take.
const MAX_PLAN_IN_METADATA_BYTES: usize = 8 << 10;

/// How views come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// Samplers sample, compositors reconstruct.
    Pipeline,
    /// Every node draws its views from the scene.
    Direct,
    /// Every node samples its share of the images and reconstructs its share of the views.
    TimeShare,
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pipeline => "pipeline",
            Self::Direct => "direct",
            Self::TimeShare => "time-share",
        })
    }
}

impl Policy {
    pub(crate) fn from_wire(value: i32) -> Result<Self, WireError> {
        match proto::Policy::try_from(value) {
            Ok(proto::Policy::Pipeline) => Ok(Self::Pipeline),
            Ok(proto::Policy::Direct) => Ok(Self::Direct),
            Ok(proto::Policy::TimeShare) => Ok(Self::TimeShare),
            _ => Err(WireError::UnknownEnum { field: "policy", value }),
        }
    }

    pub(crate) fn to_wire(self) -> i32 {
        match self {
            Self::Pipeline => proto::Policy::Pipeline.into(),
            Self::Direct => proto::Policy::Direct.into(),
            Self::TimeShare => proto::Policy::TimeShare.into(),
        }
    }
}

/// The images, or tiles of images, that one node samples: of every set, or, where every sampler has all of them, of every set whose turn
/// it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplerShare {
    /// The node.
    pub node_name: String,
    /// Where it is reached.
    pub address: String,
    /// Into [`Assignment::sampled_cameras`].
    pub image_indices: Vec<u32>,
}

/// A node that makes views.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompositorShare {
    /// The node.
    pub node_name: String,
    /// Where it is reached.
    pub address: String,
    /// Its share of the views of a set, in proportion, to begin with: whoever is done helps others.
    pub view_weight: u32,
}

/// What a sample set shows, of one view cell: equal for equal scene, time, cameras, sampling, lighting, step of refinement, lights
/// and volume, whatever the plan. What has not changed is known by it and not sampled again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SetContent([u8; 32]);

/// One plan for the whole cluster. Every node gets the same and finds its own roles in it: one, both
/// or none.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Fences: a node refuses a lower one than it has.
    pub plan_epoch: u64,
    /// How views come about.
    pub policy: Policy,
    /// What is sampled.
    pub workload: Workload,
    /// None in the direct policy.
    pub samplers: Vec<SamplerShare>,
    /// At least one.
    pub compositors: Vec<CompositorShare>,
    /// Each sample image is cut into so many tiles, one above the other, and every tile is an image of its own to
    /// samplers: of image i they are i · T to (i + 1) · T - 1, top to bottom. At least 1.
    pub tile_count: u32,
    /// So many compositors, the first, ask samplers for images; each passes them on to so many others, those to as
    /// many again. `None`: all ask samplers.
    pub relay_fanout: Option<NonZeroU32>,
}

impl Assignment {
    /// The cameras of all that is sampled: of the set's images, or of their tiles.
    #[must_use]
    pub fn sampled_cameras(&self) -> Vec<Camera> {
        let tiles = |camera: &Camera| (0..self.tile_count).map(|tile| camera.tile(tile, self.tile_count)).collect();
        self.workload.sample_cameras.iter().flat_map(|camera| -> Vec<Camera> { tiles(camera) }).collect()
    }

    /// Whom a compositor asks for images: another compositor, or `None` for the samplers.
    #[must_use]
    pub fn relay_of(&self, node_name: &str) -> Option<&CompositorShare> {
        let fanout = self.relay_fanout?.get() as usize;
        let place = self.compositors.iter().position(|share| share.node_name == node_name)?;
        (place / fanout).checked_sub(1).map(|relay| &self.compositors[relay])
    }

    /// Whether other compositors ask this node for images.
    #[must_use]
    pub fn relays(&self, node_name: &str) -> bool {
        let asks = |share: &CompositorShare| self.relay_of(&share.node_name).is_some_and(|r| r.node_name == node_name);
        self.compositors.iter().any(asks)
    }

    /// Who samples a set: all samplers its images, or in turn one sampler the whole set.
    #[must_use]
    pub fn samplers_of(&self, set_index: u32) -> &[SamplerShare] {
        match self.sets_in_turn() {
            true => std::slice::from_ref(&self.samplers[set_index as usize % self.samplers.len()]),
            false => &self.samplers,
        }
    }

    /// Sets that are sampled at the same time, if sets are wanted fast enough.
    #[must_use]
    pub fn sets_at_once(&self) -> u32 {
        if self.sets_in_turn() { self.samplers.len() as u32 } else { 1 }
    }

    /// The view cell from whose images a view is made; views that are drawn directly need none.
    #[must_use]
    pub fn cell_of(&self, view: &PinholeCamera) -> u32 {
        if self.policy == Policy::Direct { 0 } else { self.workload.cell_of(view) }
    }

    /// The same plan for one view cell alone: its cameras, and of their images who samples them; `None` beyond the last
    /// cell.
    #[must_use]
    pub fn of_cell(&self, cell: u32) -> Option<Self> {
        let cameras = self.workload.cameras_of_cell(cell as usize)?;
        let images = [cameras.start, cameras.end].map(|camera| camera as u32 * self.tile_count);
        let own = |share: &SamplerShare| {
            let of_cell = share.image_indices.iter().filter(|image| (images[0]..images[1]).contains(image));
            SamplerShare { image_indices: of_cell.map(|image| image - images[0]).collect(), ..share.clone() }
        };
        let samplers = self.samplers.iter().map(own).filter(|share| !share.image_indices.is_empty()).collect();
        Some(Self { workload: self.workload.of_cell(cell as usize)?, samplers, ..self.clone() })
    }

    /// Images, or tiles of images, of a set.
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

    /// What a set shows, of a plan [of one cell](Self::of_cell); `None` beyond the timeline.
    #[must_use]
    pub fn set_content(&self, set_index: u32) -> Option<SetContent> {
        let workload = &self.workload;
        let time_s = workload.timeline.time_s(set_index)?;
        let mut hash = blake3::Hasher::new();
        hash.update(workload.scene.hash.as_str().as_bytes());
        hash.update(&time_s.to_bits().to_le_bytes());
        let settled_at_s = workload.timeline.settled_at_s(set_index).unwrap_or(time_s);
        hash.update(&settled_at_s.to_bits().to_le_bytes());
        // Length-prefixed, so that no two settings run together into the same bytes.
        // The method says which planes images have.
        for text in [&workload.sampling, &workload.lighting, &workload.method] {
            hash.update(&(text.len() as u64).to_le_bytes()).update(text.as_bytes());
        }
        for v in [workload.volume.min, workload.volume.max, workload.background_linear] {
            hash.update(&v.to_array().map(f32::to_le_bytes).concat());
        }
        let refinement = workload.refinement(set_index);
        hash.update(&refinement.step.to_le_bytes()).update(&refinement.steps.to_le_bytes());
        let illumination: proto::Illumination = workload.illumination.clone().into();
        hash.update(&illumination.encode_length_delimited_to_vec());
        for camera in &workload.sample_cameras {
            hash.update(&crate::geometry::camera_to(camera).encode_to_vec());
        }
        Some(SetContent(hash.finalize().into()))
    }

    /// Refuses what is asked under another plan, and says which is in force: whoever asks may not hear the coordinator.
    #[must_use]
    pub fn refusal(&self, message: String) -> Status {
        let bytes = proto::Assignment::from(self.clone()).encode_to_vec();
        let mut metadata = MetadataMap::new();
        // What is larger than a peer takes as metadata is left to the coordinator to say.
        if bytes.len() <= MAX_PLAN_IN_METADATA_BYTES {
            metadata.insert_bin(PLAN_KEY, MetadataValue::from_bytes(&bytes));
        }
        Status::with_metadata(Code::FailedPrecondition, message, metadata)
    }

    /// The plan in force, of a refusal that says so.
    #[must_use]
    pub fn told_by(refusal: &Status) -> Option<Self> {
        let bytes = refusal.metadata().get_bin(PLAN_KEY)?.to_bytes().ok()?;
        proto::Assignment::decode(bytes).ok()?.try_into().ok()
    }

    fn check(self) -> Result<Self, WireError> {
        let image_count = self.image_count();
        let mut sampled = vec![0u32; image_count];
        for &index in self.samplers.iter().flat_map(|share| &share.image_indices) {
            *sampled
                .get_mut(index as usize)
                .ok_or_else(|| WireError::out_of_range("image_indices", index, "of an image or a tile"))? += 1;
        }
        let each = self.sets_at_once();
        if self.policy != Policy::Direct && (image_count == 0 || sampled.iter().any(|&times| times != each)) {
            return Err(WireError::out_of_range(
                "image_indices",
                format!("{sampled:?} times"),
                "each image once a set",
            ));
        }
        if self.compositors.is_empty() { Err(WireError::Missing { field: "compositors" }) } else { Ok(self) }
    }
}

impl TryFrom<proto::Assignment> for Assignment {
    type Error = WireError;

    fn try_from(a: proto::Assignment) -> Result<Self, WireError> {
        at_most(a.samplers.len(), MAX_NODES, "samplers")?;
        at_most(a.compositors.len(), MAX_NODES, "compositors")?;
        let assignment = Self {
            plan_epoch: a.plan_epoch,
            policy: Policy::from_wire(a.policy)?,
            workload: required(a.workload, "assignment.workload")?.try_into()?,
            samplers: a.samplers.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            compositors: a.compositors.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            tile_count: tile_count_from(a.tile_count)?,
            relay_fanout: NonZeroU32::new(a.relay_fanout_count),
        };
        assignment.check()
    }
}

impl From<Assignment> for proto::Assignment {
    fn from(a: Assignment) -> Self {
        Self {
            plan_epoch: a.plan_epoch,
            policy: a.policy.to_wire(),
            workload: Some(a.workload.into()),
            samplers: a.samplers.into_iter().map(Into::into).collect(),
            compositors: a.compositors.into_iter().map(Into::into).collect(),
            tile_count: a.tile_count,
            relay_fanout_count: a.relay_fanout.map_or(0, NonZeroU32::get),
        }
    }
}

/// From 1 to the limit; 0 counts as 1.
pub(crate) fn tile_count_from(count: u32) -> Result<u32, WireError> {
    if count <= MAX_TILES { Ok(count.max(1)) } else { Err(WireError::out_of_range("tile_count", count, "at most 16")) }
}

impl TryFrom<proto::SamplerShare> for SamplerShare {
    type Error = WireError;

    fn try_from(s: proto::SamplerShare) -> Result<Self, WireError> {
        at_most(s.image_indices.len(), MAX_CELLS * MAX_SAMPLE_CAMERAS * MAX_TILES as usize, "image_indices")?;
        Ok(Self {
            node_name: nonempty(s.node_name, "node_name")?,
            address: nonempty(s.node_address, "node_address")?,
            image_indices: s.image_indices,
        })
    }
}

impl From<SamplerShare> for proto::SamplerShare {
    fn from(s: SamplerShare) -> Self {
        Self { node_name: s.node_name, node_address: s.address, image_indices: s.image_indices }
    }
}

impl TryFrom<proto::CompositorShare> for CompositorShare {
    type Error = WireError;

    fn try_from(s: proto::CompositorShare) -> Result<Self, WireError> {
        let (node_name, address) = (nonempty(s.node_name, "node_name")?, nonempty(s.node_address, "node_address")?);
        Ok(Self { node_name, address, view_weight: s.dealt_view_count })
    }
}

impl From<CompositorShare> for proto::CompositorShare {
    fn from(s: CompositorShare) -> Self {
        Self { node_name: s.node_name, node_address: s.address, dealt_view_count: s.view_weight }
    }
}
