//! Discontinuities of depth.
//!
//! Inverse depth is linear in the image on a plane of any slope, so a slope alone is no step. The jump between
//! neighbours *a* and *b* is predicted from the jumps before *a* and after *b*. On a plane all three are equal, and at
//! a crease the middle one lies between the others. There is a **step** where the jump lies outside their range by more
//! than [`STEP_RELATIVE`] of the larger inverse depth. There is also one where only one of the two is a surface. The
//! measure is a ratio: scenes have no scale here.

/// The least step, as a share of the larger inverse depth; also the least depth error that counts.
pub const STEP_RELATIVE: f32 = 0.01;

/// The number of pixels on either side of a step that are near it: centres 0.5 and 1.5 px away.
const NEAR_PX: usize = 2;

/// Marks pixels within 2 px of a step. `inverse_depth_per_m` has whole rows of `width_px`.
#[must_use]
pub fn step_pixels(inverse_depth_per_m: &[f32], width_px: u32) -> Vec<bool> {
    let width = width_px as usize;
    let height = inverse_depth_per_m.len().checked_div(width).unwrap_or(0);
    let mut beside = vec![false; inverse_depth_per_m.len()];
    for y in 0..height {
        mark_line(&mut beside, inverse_depth_per_m, Line { start: y * width, stride: 1, len: width });
    }
    for x in 0..width {
        mark_line(&mut beside, inverse_depth_per_m, Line { start: x, stride: width, len: height });
    }
    dilated(&beside, width, NEAR_PX - 1)
}

/// A row or a column.
#[derive(Clone, Copy)]
struct Line {
    start: usize,
    stride: usize,
    len: usize,
}

impl Line {
    /// The surface at a position; `None` outside the image and without a surface.
    fn surface(self, inverse_depth: &[f32], at: isize) -> Option<f32> {
        let at = usize::try_from(at).ok().filter(|&at| at < self.len)?;
        Some(inverse_depth[self.start + at * self.stride]).filter(|&depth| depth > 0.0)
    }

    /// True if there is a step between positions `at` and `at + 1`.
    fn steps_after(self, inverse_depth: &[f32], at: isize) -> bool {
        let [before, a, b, after] = [-1, 0, 1, 2].map(|offset| self.surface(inverse_depth, at + offset));
        let (Some(a), Some(b)) = (a, b) else { return a.is_some() != b.is_some() };
        jump_is_step(b - a, before.map(|before| a - before), after.map(|after| after - b), a.max(b))
    }
}

/// True if a jump lies outside the range that its neighbours predict. Without one neighbour, the other predicts alone;
/// without both, there is no prediction.
fn jump_is_step(jump: f32, before: Option<f32>, after: Option<f32>, larger: f32) -> bool {
    let first = before.or(after).unwrap_or(0.0);
    let second = after.or(before).unwrap_or(0.0);
    let least = first.min(second);
    let greatest = first.max(second);
    (least - jump).max(jump - greatest) > STEP_RELATIVE * larger
}

fn mark_line(beside: &mut [bool], inverse_depth: &[f32], line: Line) {
    for at in 0..line.len.saturating_sub(1) {
        if line.steps_after(inverse_depth, at as isize) {
            beside[line.start + at * line.stride] = true;
            beside[line.start + (at + 1) * line.stride] = true;
        }
    }
}

/// Grows the marked pixels by `radius` in all eight directions.
fn dilated(marked: &[bool], width: usize, radius: usize) -> Vec<bool> {
    let mut grown = vec![false; marked.len()];
    let height = marked.len().checked_div(width).unwrap_or(0);
    for index in (0..marked.len()).filter(|&index| marked[index]) {
        let x = index % width;
        let y = index / width;
        for row in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            grown[row * width + x.saturating_sub(radius)..row * width + (x + radius + 1).min(width)].fill(true);
        }
    }
    grown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row_mask(inverse_depth: &[f32]) -> Vec<bool> {
        step_pixels(inverse_depth, inverse_depth.len() as u32)
    }

    fn expect_marked(inverse_depth: &[f32], marked: std::ops::Range<usize>) {
        let expected: Vec<bool> = (0..inverse_depth.len()).map(|x| marked.contains(&x)).collect();
        assert_eq!(row_mask(inverse_depth), expected, "{inverse_depth:?}");
    }

    #[test]
    fn no_plane_is_a_step_however_steep() {
        let steep: Vec<f32> = (1..40).map(|x| 0.05 * x as f32).collect();
        assert!(row_mask(&steep).iter().all(|&step| !step));
    }

    #[test]
    fn a_crease_is_no_step() {
        let crease: Vec<f32> = (0..40_i16).map(|x| 2.0 - 0.04 * f32::from((x - 20).abs())).collect();
        assert!(row_mask(&crease).iter().all(|&step| !step));
    }

    #[test]
    fn a_step_marks_two_pixels_on_each_side() {
        expect_marked(&[0.5, 0.5, 0.5, 0.5, 0.4, 0.4, 0.4, 0.4], 2..6);
    }

    #[test]
    fn the_background_is_a_step() {
        expect_marked(&[0.5, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0], 2..6);
    }

    #[test]
    fn thin_poles_are_steps() {
        expect_marked(&[0.1, 0.1, 0.1, 0.1, 0.5, 0.1, 0.1, 0.1, 0.1], 2..7);
        expect_marked(&[0.1, 0.1, 0.1, 0.1, 0.5, 0.5, 0.1, 0.1, 0.1, 0.1], 2..8);
    }

    #[test]
    fn scale_does_not_matter() {
        let metres = [0.5, 0.5, 0.5, 0.4, 0.4, 0.4, 0.398, 0.396];
        for scale in [1e-4, 1.0, 1e4] {
            assert_eq!(row_mask(&metres.map(|depth| depth * scale)), row_mask(&metres));
        }
    }

    #[test]
    fn columns_are_seen_too() {
        let mask = step_pixels(&[0.5, 0.5, 0.5, 0.4, 0.4, 0.4], 1);
        assert_eq!(mask, [false, true, true, true, true, false]);
        assert!(step_pixels(&[], 0).is_empty());
    }
}
