//! A cube's samples in voxels, for rays: cells of 8 spacings, bricks of 4 × 4 × 4 voxels in those that have samples, and entries.

use depth_image::oct8_from_unit;
use glam::UVec3;
use gpu::cube_walk::{ENTRY_DEPTH_BELOW, ENTRY_DEPTH_STEP, MORE_ENTRIES, MOST_REACH, SQUARE_REACH, VOXEL};

use super::reaches::reaches;
use super::samples::CubeSamples;

/// Steeper planes are no entries: another axis holds them. A sample is met where its normal has this share along the line at least.
pub(crate) const LEAST_NORMAL_ALONG_LINE: f32 = 0.5;

/// The tables of `cube_walk.wgsl`.
pub(super) struct Bricks {
    pub cells: Vec<u32>,
    pub bricks: Vec<[u32; 4]>,
    /// Two entries; or the first entry of more, and the places of the first pair of the others and of the one after their last.
    pub leaves: Vec<[u32; 4]>,
    /// Two a texel, of the leaves with more than two.
    pub entries: Vec<[u32; 4]>,
}

/// A sample, or the two of a surface that is seen from both sides, whose plane passes through a voxel.
#[derive(Clone, Copy, Default)]
struct Passage {
    /// Within its brick.
    voxel: u32,
    words: [u32; 2],
}

impl Bricks {
    pub fn of(samples: &CubeSamples) -> Self {
        let size = samples.size.map(|side| side.div_ceil(8));
        let (first, passages) = by_cell(samples, size);
        let occupied: Vec<bool> = first.windows(2).map(|ends| ends[1] > ends[0]).collect();
        let cells = reaches(size, &occupied);
        let mut all = Self { cells, bricks: Vec::new(), leaves: Vec::new(), entries: Vec::new() };
        for (cell, ends) in first.windows(2).enumerate().filter(|(_, ends)| ends[1] > ends[0]) {
            all.cells[cell] = all.bricks.len() as u32;
            all.add_brick(&passages[ends[0] as usize..ends[1] as usize]);
        }
        all
    }

    /// A brick of passages that are sorted by voxel.
    fn add_brick(&mut self, passages: &[Passage]) {
        let mut mask = [0; 2];
        let first_leaf = self.leaves.len() as u32;
        for leaf in passages.chunk_by(|a, b| a.voxel == b.voxel) {
            mask[leaf[0].voxel as usize / 32] |= 1 << (leaf[0].voxel % 32);
            let leaf = self.leaf(leaf);
            self.leaves.push(leaf);
        }
        self.bricks.push([mask[0], mask[1], first_leaf, 0]);
    }

    fn leaf(&mut self, passages: &[Passage]) -> [u32; 4] {
        if passages.len() <= 2 {
            return pair_of(passages);
        }
        let [sample, place] = passages[0].words;
        let first = self.entries.len() as u32;
        self.entries.extend(passages[1..].chunks(2).map(pair_of));
        [sample | MORE_ENTRIES, place, first, self.entries.len() as u32]
    }
}

/// The words of one or two passages: the last of an odd number is there twice, which changes nothing.
fn pair_of(passages: &[Passage]) -> [u32; 4] {
    bytemuck::cast([passages[0].words, passages[passages.len() - 1].words])
}

/// The first passage of each cell, and the passages, sorted by cell and voxel.
fn by_cell(samples: &CubeSamples, size: UVec3) -> (Vec<u32>, Vec<Passage>) {
    let mut first = vec![0u32; size.element_product() as usize + 1];
    each_passage(samples, size, |cell, _| first[cell + 1] += 1);
    (1..first.len()).for_each(|cell| first[cell] += first[cell - 1]);
    let mut next = first.clone();
    let mut passages = vec![Passage::default(); first.last().copied().unwrap_or(0) as usize];
    each_passage(samples, size, |cell, passage| {
        passages[next[cell] as usize] = passage;
        next[cell] += 1;
    });
    for ends in first.windows(2) {
        passages[ends[0] as usize..ends[1] as usize].sort_by_key(|passage| passage.voxel);
    }
    (first, passages)
}

/// Calls `take` for each voxel that a surface's plane passes through, with the voxel's cell.
fn each_passage(samples: &CubeSamples, size: UVec3, mut take: impl FnMut(usize, Passage)) {
    let mut next = 0;
    while next < samples.len() {
        let sample = next;
        // The next sample may be the same surface's other side.
        let is_two_sided = samples.has_other_side(sample);
        next += 1 + usize::from(is_two_sided);
        let line = samples.line[sample];
        let axis = samples.axis_of(line);
        if samples.normal[sample][axis].abs() < LEAST_NORMAL_ALONG_LINE {
            continue;
        }
        let place = samples.place_of(axis, line);
        let depth = samples.depth[sample];
        let reach =
            samples.slopes(sample, axis).iter().map(|slope| slope.abs() * SQUARE_REACH).sum::<f32>().min(MOST_REACH);
        let last = (samples.size[axis] - 1) / 2;
        let [from, to] = [depth - reach, depth + reach].map(|end| ((end / VOXEL).floor().max(0.0) as u32).min(last));
        let mut voxel = UVec3::ZERO;
        (voxel[(axis + 1) % 3], voxel[(axis + 2) % 3]) = (place.x / 2, place.y / 2);
        let flags = [u32::from(is_two_sided), place.x & 1, place.y & 1].into_iter().enumerate();
        let bits = flags.fold(0, |bits, (offset, is_set)| bits | is_set << (28 + (axis + offset) % 3));
        let normal = u32::from(oct8_from_unit(samples.normal[sample])) | (axis as u32) << 30;
        for along in from..=to {
            voxel[axis] = along;
            let below = (depth - along as f32 * VOXEL + ENTRY_DEPTH_BELOW) / ENTRY_DEPTH_STEP;
            let words = [sample as u32 | bits, normal | (below.round().clamp(0.0, 16383.0) as u32) << 16];
            let cell = voxel / 4;
            let within = voxel % 4;
            let number = within.x + 4 * within.y + 16 * within.z;
            take((cell.x + size.x * (cell.y + size.y * cell.z)) as usize, Passage { voxel: number, words });
        }
    }
}
