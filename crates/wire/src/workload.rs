//! What a session samples, and what operations cost.

use std::ops::Range;

use depth_image::{Aabb, Camera, Illumination, PinholeCamera, nearest_set};
use glam::Vec3;
use prost::Message as _;

use crate::error::{WireError, at_most, required};
use crate::geometry::{bounds_from, bounds_to, camera_to, sample_cameras_from, vec3_from, vec3_to};
use crate::limits::{MAX_CELLS, MAX_REFINEMENT_STEPS, MAX_SAMPLE_CAMERAS, MAX_SETS, nonempty, seconds};
use crate::{SceneRef, proto};

/// Sets that keep on to what the first of them holds: the node that samples one of them samples that first one, too.
const SETTLED_SETS: u32 = 16;

/// Scene times of the sample sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timeline {
    /// Of set 0.
    pub start_s: f64,
    /// From set to set; 0 for a static scene.
    pub step_s: f64,
    /// How many sets.
    pub set_count: u32,
}

impl Timeline {
    /// One set.
    #[must_use]
    pub fn still(at_s: f64) -> Self {
        Self { start_s: at_s, step_s: 0.0, set_count: 1 }
    }

    /// Whether sets differ in scene time: one set never does.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.step_s != 0.0 && self.set_count > 1
    }

    /// Scene time of the set whose kept samples this one keeps on to, so that they do not flicker: the first of its run.
    /// `None` for that one itself, and where nothing moves.
    #[must_use]
    pub fn settled_at_s(&self, set_index: u32) -> Option<f32> {
        let first = set_index - set_index % SETTLED_SETS;
        (self.moves() && first != set_index).then(|| self.time_s(first)).flatten()
    }

    /// Scene time of a set; `None` beyond the last.
    #[must_use]
    pub fn time_s(&self, set_index: u32) -> Option<f32> {
        (set_index < self.set_count).then(|| (self.start_s + f64::from(set_index) * self.step_s) as f32)
    }
}

/// Of scene time, to either side of 0: eleven days. Views of a set grow with the time that it is shown.
const MOST_SCENE_S: f64 = 1e6;

impl TryFrom<proto::Timeline> for Timeline {
    type Error = WireError;

    fn try_from(t: proto::Timeline) -> Result<Self, WireError> {
        if !(1..=MAX_SETS).contains(&t.set_count) {
            return Err(WireError::out_of_range("timeline.set_count", t.set_count, "from 1 to 1048576"));
        }
        let within = |value: f64, field| match value.abs() <= MOST_SCENE_S {
            true => Ok(value),
            false => Err(WireError::out_of_range(field, value, "from -1e6 to 1e6")),
        };
        Ok(Self {
            start_s: within(t.start_s, "timeline.start_s")?,
            step_s: within(t.step_s, "timeline.step_s")?,
            set_count: t.set_count,
        })
    }
}

impl From<Timeline> for proto::Timeline {
    fn from(t: Timeline) -> Self {
        Self { start_s: t.start_s, step_s: t.step_s, set_count: t.set_count }
    }
}

/// How far the light of a set has come: with every step it is sampled with more rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Refinement {
    /// From 0 to `steps - 1`, which is full quality.
    pub step: u32,
    /// At least 1.
    pub steps: u32,
}

impl Default for Refinement {
    /// Full quality at once.
    fn default() -> Self {
        Self { step: 0, steps: 1 }
    }
}

impl Refinement {
    /// The last of so many steps; 0 counts as 1.
    #[must_use]
    pub const fn last_of(steps: u32) -> Self {
        let step = steps.saturating_sub(1);
        Self { step, steps: step + 1 }
    }

    /// Whether this is full quality.
    #[must_use]
    pub const fn is_last(&self) -> bool {
        self.step + 1 >= self.steps
    }
}

/// What is sampled, when and how. Methods are text, as on the command line: nodes parse them, so that
/// a new method changes nothing here.
#[derive(Debug, Clone, PartialEq)]
pub struct Workload {
    /// The scene.
    pub scene: SceneRef,
    /// One image of each set for each; those of a view cell next to each other.
    pub sample_cameras: Vec<Camera>,
    /// Where each view cell's cameras begin, the first's at 0; empty: one cell has all.
    pub cell_first_indices: Vec<u32>,
    /// How images are sampled.
    pub sampling: String,
    /// How samples are lit.
    pub lighting: String,
    /// How views are reconstructed, unless they ask for another method.
    pub method: String,
    /// How frames are encoded, unless views ask for another codec.
    pub codec: String,
    /// What reconstruction looks at.
    pub volume: Aabb,
    /// What rays meet that leave the scene.
    pub background_linear: Vec3,
    /// Scene times.
    pub timeline: Timeline,
    /// The scene's: compositors add what depends on the viewer.
    pub illumination: Illumination,
    /// Steps in which a still picture is refined: from 1, finished at once, to [`MAX_REFINEMENT_STEPS`].
    pub refinement_steps: u32,
}

impl Workload {
    /// What step a set shows. Where nothing moves, one step more from set to set up to the last, at which it
    /// stays; sets beyond it are equal and are not sampled again. A timeline that ends before shows no finished
    /// set. A scene that moves has no time for steps: each set shows the last. So do views drawn directly.
    #[must_use]
    pub fn refinement(&self, set_index: u32) -> Refinement {
        let last = Refinement::last_of(self.refinement_steps);
        if self.timeline.moves() { last } else { Refinement { step: set_index.min(last.step), ..last } }
    }
}

/// From 1 to the limit.
pub(crate) fn refinement_steps_from(count: u32) -> Result<u32, WireError> {
    if (1..=MAX_REFINEMENT_STEPS).contains(&count) {
        Ok(count)
    } else {
        Err(WireError::out_of_range("refinement_step_count", count, "from 1 to 64"))
    }
}

impl Workload {
    /// View cells: each view is made from the images of one.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        self.cell_first_indices.len().max(1)
    }

    /// Which of the sample cameras a view cell has; `None` beyond the last cell.
    #[must_use]
    pub fn cameras_of_cell(&self, cell: usize) -> Option<Range<usize>> {
        let firsts = if self.cell_first_indices.is_empty() { &[0][..] } else { &self.cell_first_indices };
        let first = |cell: usize| firsts.get(cell).map(|&first| first as usize);
        Some(first(cell)?..first(cell + 1).unwrap_or(self.sample_cameras.len()))
    }

    /// The same for one view cell alone; `None` beyond the last.
    #[must_use]
    pub fn of_cell(&self, cell: usize) -> Option<Self> {
        let sample_cameras = self.sample_cameras.get(self.cameras_of_cell(cell)?)?.to_vec();
        Some(Self { sample_cameras, cell_first_indices: Vec::new(), ..self.clone() })
    }

    /// The view cell that a view is in, or else nearest to.
    #[must_use]
    pub fn cell_of(&self, view: &PinholeCamera) -> u32 {
        if self.cell_count() == 1 {
            return 0;
        }
        let cameras = |cell: usize| {
            let range = self.cameras_of_cell(cell).unwrap_or_default();
            self.sample_cameras[range].iter().map(|Camera::Pinhole(camera)| *camera).collect()
        };
        nearest_set(view, (0..self.cell_count()).map(cameras), &self.volume).unwrap_or(0) as u32
    }

    fn check(self) -> Result<Self, WireError> {
        let firsts = &self.cell_first_indices;
        at_most(firsts.len(), MAX_CELLS, "cell_first_indices")?;
        let ends = firsts.iter().skip(1).copied().chain([self.sample_cameras.len() as u32]);
        let is_cell = |(&first, end): (&u32, u32)| first < end && end - first <= MAX_SAMPLE_CAMERAS as u32;
        if firsts.first().is_some_and(|&first| first > 0) || !firsts.iter().zip(ends).all(is_cell) {
            let given = format!("{firsts:?} of {} sample_cameras", self.sample_cameras.len());
            return Err(WireError::out_of_range("cell_first_indices", given, "rising from 0, by 1 to 16 cameras each"));
        }
        Ok(self)
    }

    /// As a message, for whoever keeps it.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        proto::Workload::from(self.clone()).encode_to_vec()
    }

    /// What [`Workload::to_bytes`] made.
    ///
    /// # Errors
    /// For bytes that are no such message, and for a message that any peer would be refused for.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WireError> {
        let message = proto::Workload::decode(bytes).map_err(|error| WireError::corrupt("workload", error))?;
        message.try_into()
    }
}

impl TryFrom<proto::Workload> for Workload {
    type Error = WireError;

    fn try_from(w: proto::Workload) -> Result<Self, WireError> {
        let workload = Self {
            scene: required(w.scene, "workload.scene")?.try_into()?,
            sample_cameras: sample_cameras_from(w.sample_cameras, w.cell_first_indices.len().clamp(1, MAX_CELLS))?,
            cell_first_indices: w.cell_first_indices,
            sampling: nonempty(w.sampling_method, "sampling_method")?,
            lighting: nonempty(w.lighting, "lighting")?,
            method: nonempty(w.reconstruction_method, "reconstruction_method")?,
            codec: nonempty(w.frame_codec, "frame_codec")?,
            volume: bounds_from(required(w.volume, "workload.volume")?)?,
            background_linear: vec3_from(w.background_linear_rgb, "background_linear_rgb")?,
            timeline: required(w.timeline, "workload.timeline")?.try_into()?,
            illumination: required(w.illumination, "workload.illumination")?.try_into()?,
            refinement_steps: refinement_steps_from(w.refinement_step_count)?,
        };
        workload.check()
    }
}

impl From<Workload> for proto::Workload {
    fn from(w: Workload) -> Self {
        Self {
            scene: Some(w.scene.into()),
            sample_cameras: w.sample_cameras.iter().map(camera_to).collect(),
            cell_first_indices: w.cell_first_indices,
            sampling_method: w.sampling,
            lighting: w.lighting,
            reconstruction_method: w.method,
            frame_codec: w.codec,
            volume: Some(bounds_to(&w.volume)),
            background_linear_rgb: vec3_to(w.background_linear),
            timeline: Some(w.timeline.into()),
            illumination: Some(w.illumination.into()),
            refinement_step_count: w.refinement_steps,
        }
    }
}

/// Quarters of a sample image's height, whose costs are told apart.
pub const ROW_PARTS: usize = 4;

/// Seconds of one operation, each alone and warm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Costs {
    /// g_s: one finished sample image, its lighting and its encoding included.
    pub sample_image_s: f64,
    /// g_v: one finished view drawn directly.
    pub direct_view_s: f64,
    /// c: one reconstructed view, to host pixels.
    pub reconstruct_view_s: f64,
    /// d: decode and upload of one sample set on one compositor.
    pub load_set_s: f64,
    /// e: encoding of one view.
    pub encode_view_s: f64,
    /// Whether an image of a set can only be sampled after those before it: then one node samples the whole set,
    /// and several nodes sample sets in turn.
    pub in_order: bool,
    /// Of g_s, what every tile of an image costs anew: work that does not shrink with its rows.
    pub sample_overhead_s: f64,
    /// Of the rest, the shares of the image's quarters, top to bottom: rows that show the sky cost less. They add up to 1;
    /// all 0 where nobody has measured them, which counts as equal.
    pub sample_row_shares: [f64; ROW_PARTS],
}

impl Costs {
    /// One of so many tiles of a sample image, if all were equal.
    #[must_use]
    pub fn sample_tile_s(&self, tile_count: usize) -> f64 {
        let overhead_s = self.sample_overhead_s.min(self.sample_image_s);
        overhead_s + (self.sample_image_s - overhead_s) / tile_count.max(1) as f64
    }

    /// The tile number `tile` of so many, from the top.
    #[must_use]
    pub fn sample_this_tile_s(&self, tile: usize, tile_count: usize) -> f64 {
        let overhead_s = self.sample_overhead_s.min(self.sample_image_s);
        let (top, bottom) = (tile as f64 / tile_count as f64, (tile + 1) as f64 / tile_count as f64);
        overhead_s + (self.sample_image_s - overhead_s) * (self.share_above(bottom) - self.share_above(top))
    }

    /// Of the work on rows, the share above a height; 0 is the top of the image, 1 its bottom.
    fn share_above(&self, height: f64) -> f64 {
        let all: f64 = self.sample_row_shares.iter().sum();
        if all <= 0.0 {
            return height;
        }
        let covered = |part: usize| (height * ROW_PARTS as f64 - part as f64).clamp(0.0, 1.0);
        self.sample_row_shares.iter().enumerate().map(|(part, share)| share * covered(part)).sum::<f64>() / all
    }

    /// The greater of each: what the slowest node needs.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            sample_image_s: self.sample_image_s.max(other.sample_image_s),
            direct_view_s: self.direct_view_s.max(other.direct_view_s),
            reconstruct_view_s: self.reconstruct_view_s.max(other.reconstruct_view_s),
            load_set_s: self.load_set_s.max(other.load_set_s),
            encode_view_s: self.encode_view_s.max(other.encode_view_s),
            in_order: self.in_order || other.in_order,
            sample_overhead_s: self.sample_overhead_s.max(other.sample_overhead_s),
            // Shares are of the scene rather than of the node.
            sample_row_shares: if self.sample_row_shares.iter().any(|&share| share > 0.0) {
                self.sample_row_shares
            } else {
                other.sample_row_shares
            },
        }
    }
}

fn row_shares(shares: Option<proto::RowShares>) -> Result<[f64; ROW_PARTS], WireError> {
    let Some(shares) = shares else { return Ok([0.0; ROW_PARTS]) };
    let share = |value: f64, field| match value {
        0.0..=1.0 => Ok(value),
        _ => Err(WireError::out_of_range(field, value, "from 0 to 1")),
    };
    Ok([
        share(shares.first_ratio, "sample_row_shares.first_ratio")?,
        share(shares.second_ratio, "sample_row_shares.second_ratio")?,
        share(shares.third_ratio, "sample_row_shares.third_ratio")?,
        share(shares.fourth_ratio, "sample_row_shares.fourth_ratio")?,
    ])
}

impl TryFrom<proto::Costs> for Costs {
    type Error = WireError;

    fn try_from(c: proto::Costs) -> Result<Self, WireError> {
        Ok(Self {
            sample_image_s: seconds(c.sample_image_s, "sample_image_s")?,
            direct_view_s: seconds(c.direct_view_s, "direct_view_s")?,
            reconstruct_view_s: seconds(c.reconstruct_view_s, "reconstruct_view_s")?,
            load_set_s: seconds(c.load_set_s, "load_set_s")?,
            encode_view_s: seconds(c.encode_view_s, "encode_view_s")?,
            in_order: c.is_sampled_in_order,
            sample_overhead_s: seconds(c.sample_overhead_s, "sample_overhead_s")?,
            sample_row_shares: row_shares(c.sample_row_shares)?,
        })
    }
}

impl From<Costs> for proto::Costs {
    fn from(c: Costs) -> Self {
        let [first_ratio, second_ratio, third_ratio, fourth_ratio] = c.sample_row_shares;
        Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            is_sampled_in_order: c.in_order,
            sample_overhead_s: c.sample_overhead_s,
            sample_row_shares: Some(proto::RowShares { first_ratio, second_ratio, third_ratio, fourth_ratio }),
        }
    }
}
