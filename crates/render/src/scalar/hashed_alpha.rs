//! The twin of `hashed_alpha.wgsl`.

use glam::{IVec3, UVec3, Vec3};

/// The hash of a cell, 0 to 1.
fn hash_of_cell(cell: IVec3) -> f32 {
    let v = cell.as_uvec3().to_array().map(|c| c.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let v = mixed(v.into());
    (mixed(v ^ (v >> 16)).z >> 8) as f32 * 5.960_464_5e-8
}

fn mixed(mut v: UVec3) -> UVec3 {
    for [to, a, b] in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
        v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
    }
    v
}

/// The alpha below which a place in the mesh's space, in metres of the world, is not there; for pixels of this side on
/// the surface.
#[must_use]
pub fn hashed_cutoff(place_m: Vec3, side_m: f32) -> f32 {
    let cells_per_m = 1.0 / side_m.clamp(1e-20, 1e20);
    let coarse = f32::from_bits(cells_per_m.to_bits() & 0x7f80_0000);
    let share = cells_per_m / coarse - 1.0;
    let [low, high] = [coarse, 2.0 * coarse].map(|scale| hash_of_cell((place_m * scale).floor().as_ivec3()));
    let x = low * (1.0 - share) + high * share;
    let a = share.min(1.0 - share).max(1e-6);
    let sides = 2.0 * a * (1.0 - a);
    let cutoff = if x < a {
        x * x / sides
    } else if x > 1.0 - a {
        1.0 - (1.0 - x) * (1.0 - x) / sides
    } else {
        (x - 0.5 * a) / (1.0 - a)
    };
    cutoff.clamp(1e-6, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutoffs_are_equally_spread_at_every_distance() {
        for side_m in [0.01, 0.0123, 0.015, 0.0199, 0.7] {
            let place = |i: u32| Vec3::new((i % 100) as f32, (i / 100) as f32, 0.37) * (4.0 * side_m);
            let cutoffs: Vec<f32> = (0..10_000).map(|i| hashed_cutoff(place(i), side_m)).collect();
            for share in [0.1f32, 0.25, 0.5, 0.75, 0.9] {
                let below = cutoffs.iter().filter(|&&cutoff| cutoff <= share).count() as f32 / 10_000.0;
                // Three standard deviations of ten thousand independent draws are 0.015 at most.
                assert!((below - share).abs() < 0.015, "{side_m} {share}: {below}");
            }
        }
    }

    #[test]
    fn a_place_keeps_its_cutoff_where_the_distance_changes_a_little() {
        let place = |i: u32| Vec3::new(i as f32 * 0.137, 0.2, -0.4);
        let change = |side_m: f32| {
            let changes = (0..1000).map(|i| (hashed_cutoff(place(i), 0.01) - hashed_cutoff(place(i), side_m)).abs());
            changes.sum::<f32>() / 1000.0
        };
        // Independent cutoffs differ by a third in the mean.
        assert!(change(0.01) == 0.0 && change(0.0101) < 0.02 && change(0.08) > 0.25, "{}", change(0.0101));
    }
}
