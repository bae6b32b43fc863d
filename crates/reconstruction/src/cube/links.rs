//! Which samples of neighbouring lines are of one surface.

use rayon::prelude::*;

use super::samples::{CubeSamples, Links};

/// Samples of neighbouring lines are of one surface where one lies within this distance of the other's plane, in spacings.
const SAME_PLANE: f32 = 0.75;

/// The links of all samples.
pub(crate) fn links(samples: &CubeSamples) -> Vec<Links> {
    (0..samples.len()).into_par_iter().map(|sample| of_sample(samples, sample)).collect()
}

fn of_sample(samples: &CubeSamples, sample: usize) -> Links {
    let line = samples.line[sample];
    let axis = samples.axis_of(line);
    let place = samples.place_of(axis, line);
    let slopes = samples.slopes(sample, axis);
    let sides = [1, 2].map(|offset| samples.size[(axis + offset) % 3]);
    let steps = [1, sides[0]];
    [0, 1, 2, 3].map(|towards| {
        let along = towards / 2;
        let (is_there, other, rise) = match towards % 2 == 1 {
            true => (place[along] + 1 < sides[along], line.wrapping_add(steps[along]), slopes[along]),
            false => (place[along] > 0, line.wrapping_sub(steps[along]), -slopes[along]),
        };
        let found = if is_there { same_surface(samples, sample, other, samples.depth[sample] + rise) } else { None };
        found.unwrap_or(sample) as u32
    })
}

/// The nearest sample of a line to a depth, on the same side of a surface near enough to the plane.
fn same_surface(samples: &CubeSamples, sample: usize, line: u32, depth: f32) -> Option<usize> {
    let own = samples.normal[sample];
    let on_line = samples.on_line(line);
    let share = own[samples.axis_of(line)].abs();
    // Depths rise along a line.
    let below = samples.depth[on_line.clone()].partition_point(|&d| (d - depth) * share < -SAME_PLANE);
    let near =
        (on_line.start + below..on_line.end).take_while(|&other| (samples.depth[other] - depth) * share <= SAME_PLANE);
    let same = near.filter(|&other| samples.normal[other].dot(own) > 0.0);
    let gaps = same.map(|other| (other, (samples.depth[other] - depth).abs()));
    gaps.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(other, _)| other)
}
