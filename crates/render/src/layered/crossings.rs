//! Where the lines of a parallel camera meet surfaces: `append.wgsl`.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use depth_image::{MAX_LAYERS, ParallelCamera, ViewPart};
use glam::UVec2;
use gpu::{Binding, DrawPass, Frame, GpuError, PooledBuffer};
use rayon::prelude::*;
use wgpu::{BufferUsages, TextureUsages};

use crate::{LayerSelection, RenderError, stages::Stages, work::DrawWork};

/// Crossings of a line for which there is room at first.
const EXPECTED_LAYERS: u64 = 4;
/// Crossings that are drawn together take no more bytes than this.
const MOST_BYTES: u64 = 128 << 20;

/// Lines that are drawn together: their crossings are counted in 32 bits.
const MOST_LINES: u32 = 1 << 20;
/// Crossings of an image; a set has bits for as many.
const MOST_CROSSINGS: u64 = 1 << 28;
/// A double-sided surface writes two at once.
const SIDES: u64 = 2;

/// `Crossing` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Crossing {
    pub line: u32,
    pub planar_depth_m: f32,
    pub plane_normal_oct16: u32,
    pub padding: u32,
    pub surface: [u32; 4],
}

/// `Lines` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLines {
    pub forward_in_world: [f32; 3],
    pub spacing_m: f32,
    pub range_m: f32,
    pub columns: u32,
    pub least_share: f32,
    pub capacity: u32,
}

/// The lines whose crossings are wanted.
struct LayerWork<'a> {
    stages: &'a Stages,
    work: &'a DrawWork<'a>,
    camera: &'a ParallelCamera,
    selection: LayerSelection,
}

/// The number of the first crossing of each line, and of all; the crossings, line after line by rising depth; and whether some
/// line has met more than [`MAX_LAYERS`].
pub(super) fn met(
    stages: &Stages,
    work: &DrawWork<'_>,
    camera: &ParallelCamera,
    selection: LayerSelection,
) -> Result<(Vec<u32>, Vec<Crossing>, bool), RenderError> {
    let layers = LayerWork { stages, work, camera, selection };
    let mut crossings = Vec::new();
    let rows = camera.size_px.y;
    let a_band = (MOST_LINES / camera.size_px.x).max(1);
    for first in (0..rows).step_by(a_band as usize) {
        layers.draw_rows(first..(first + a_band).min(rows), &mut crossings)?;
    }
    Ok(by_line(camera.pixel_count(), &crossings))
}

impl LayerWork<'_> {
    /// Draws some rows, in halves where there is no room for all that they meet.
    fn draw_rows(&self, rows: Range<u32>, crossings: &mut Vec<Crossing>) -> Result<(), RenderError> {
        let most_bytes = self.stages.gpu.most_storage_bytes().min(MOST_BYTES);
        let most = most_bytes / size_of::<Crossing>() as u64 - SIDES;
        let size_px = UVec2::new(self.camera.size_px.x, rows.len() as u32);
        let part = self.camera.part(&ViewPart { first_px: UVec2::new(0, rows.start), size_px });
        let expected = (part.pixel_count() as u64 * EXPECTED_LAYERS).clamp(1024, most);
        let mut drawn = self.draw(&part, expected)?;
        let count = u64::from(drawn.count);
        if count > expected && count <= most {
            drawn = self.draw(&part, count)?;
        }
        if count <= most {
            return self.read(&drawn, rows.start, crossings);
        }
        if rows.len() == 1 {
            GpuError::check_limit("the surfaces on one row of lines", count, most)?;
        }
        let middle = rows.start + rows.len() as u32 / 2;
        self.draw_rows(rows.start..middle, crossings)?;
        self.draw_rows(middle..rows.end, crossings)
    }

    /// Draws a part with room for `capacity` crossings; the count is that of all.
    fn draw(&self, part: &ParallelCamera, capacity: u64) -> Result<Drawn, RenderError> {
        let Stages { gpu, pool, raster, .. } = self.stages;
        let lines = GpuLines {
            forward_in_world: part.axes_in_world()[2].to_array(),
            spacing_m: part.spacing_m,
            range_m: part.range_m,
            columns: part.size_px.x,
            least_share: self.selection.least_share(),
            capacity: capacity as u32,
        };
        let lines = gpu.buffer_with("lines", &[lines], BufferUsages::UNIFORM);
        let crossings = pool.lend_storage("crossings", (capacity + SIDES) * size_of::<Crossing>() as u64);
        let counter = pool.lend_storage("number of crossings", 4);
        let memory = [
            Binding::buffer("lines", &lines),
            Binding::buffer("crossings", &crossings),
            Binding::buffer("crossing_count", &counter),
        ];
        // A pass needs a target, though nothing is drawn into it.
        let size = [part.size_px.x, part.size_px.y, 1];
        let depth = gpu.texture("lines", size, DrawPass::DEPTH_FORMAT, TextureUsages::RENDER_ATTACHMENT);
        let mut frame = Frame::begin(gpu, "layers", self.work.turn);
        frame.encoder.clear_buffer(&counter, 0, None);
        raster.record_lines(&mut frame, self.work, part, &memory, &depth.create_view(&Default::default()))?;
        let count = frame.read_back(&counter, 0..4, pool.lend_host("number of crossings", 4));
        let result = frame.submit()?.wait()?;
        Ok(Drawn { count: result.with(count, |words: &[u32]| words[0])?, crossings })
    }

    fn read(&self, drawn: &Drawn, first_row: u32, crossings: &mut Vec<Crossing>) -> Result<(), RenderError> {
        let all = crossings.len() as u64 + u64::from(drawn.count);
        GpuError::check_limit("the surfaces of a layered image", all, MOST_CROSSINGS)?;
        let bytes = u64::from(drawn.count) * size_of::<Crossing>() as u64;
        if bytes == 0 {
            return Ok(());
        }
        let mut frame = Frame::begin(&self.stages.gpu, "read layers", self.work.turn);
        let read = frame.read_back(&drawn.crossings, 0..bytes, self.stages.pool.lend_host("crossings", bytes));
        let first_line = first_row * self.camera.size_px.x;
        let result = frame.submit()?.wait()?;
        result.with(read, |all: &[Crossing]| {
            let drawn = all[..drawn.count as usize].iter();
            crossings.extend(drawn.map(|crossing| Crossing { line: crossing.line + first_line, ..*crossing }));
        })?;
        Ok(())
    }
}

/// Crossings on the device.
struct Drawn {
    crossings: PooledBuffer,
    count: u32,
}

/// Sorted by line and depth; of equal depths by their words, so that the order in which the device met them is no matter.
fn by_line(lines: usize, crossings: &[Crossing]) -> (Vec<u32>, Vec<Crossing>, bool) {
    let mut first = vec![0u32; lines + 1];
    crossings.iter().for_each(|crossing| first[crossing.line as usize + 1] += 1);
    let truncated = first.iter().any(|&layers| layers > MAX_LAYERS);
    (0..lines).for_each(|line| first[line + 1] += first[line]);
    let mut next = first.clone();
    let mut sorted = vec![Crossing::zeroed(); crossings.len()];
    for crossing in crossings {
        let place = &mut next[crossing.line as usize];
        sorted[*place as usize] = *crossing;
        *place += 1;
    }
    sorted.par_chunk_by_mut(|a, b| a.line == b.line).for_each(|own| {
        own.sort_unstable_by_key(|c| (c.planar_depth_m.max(0.0).to_bits(), c.plane_normal_oct16, c.surface));
    });
    if !truncated {
        return (first, sorted, false);
    }
    let mut shortened = Vec::new();
    let mut first_shortened = vec![0];
    for ends in first.windows(2) {
        let own = &sorted[ends[0] as usize..ends[1] as usize];
        shortened.extend(own.iter().take(MAX_LAYERS as usize));
        first_shortened.push(shortened.len() as u32);
    }
    (first_shortened, shortened, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_are_sorted_by_line_and_depth_in_whatever_order_they_came() {
        let crossing =
            |line, planar_depth_m, word| Crossing { line, planar_depth_m, surface: [word; 4], ..Crossing::zeroed() };
        let mut all = vec![crossing(2, 1.0, 3), crossing(0, 2.0, 1), crossing(0, 0.5, 2), crossing(2, 1.0, 1)];
        let (first, sorted, truncated) = by_line(4, &all);
        assert_eq!((first, truncated), (vec![0, 2, 2, 4, 4], false));
        assert_eq!(sorted.iter().map(|c| c.surface[0]).collect::<Vec<_>>(), [2, 1, 1, 3]);
        all.reverse();
        assert_eq!(by_line(4, &all).1, sorted);
    }

    #[test]
    fn lines_keep_their_nearest_layers() {
        let crossing = |line, depth: u32| Crossing { line, planar_depth_m: depth as f32, ..Crossing::zeroed() };
        let all: Vec<Crossing> = (0..300).rev().map(|depth| crossing(1, depth)).chain([crossing(2, 7)]).collect();
        let (first, sorted, truncated) = by_line(3, &all);
        assert_eq!((first, truncated), (vec![0, 0, 255, 256], true));
        assert_eq!((sorted[254].planar_depth_m, sorted[255].planar_depth_m), (254.0, 7.0));
    }
}
