//! The twin of `sequence.wgsl`: Owen-scrambled Sobol points in two dimensions.

use glam::Vec2;

/// A number that has no more to do with `value` than chance has.
#[must_use]
pub fn hashed(value: u32) -> u32 {
    let h = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let h = ((h >> ((h >> 28) + 4)) ^ h).wrapping_mul(277_803_737);
    (h >> 22) ^ h
}

/// The `number`-th point in the unit square of the sequence of `seed`.
#[must_use]
pub fn point_of(number: u32, seed: u32) -> Vec2 {
    let index = scrambled(number.reverse_bits(), seed).reverse_bits();
    let first = scrambled(index, hashed(seed ^ 0x9e37_79b9));
    let second = scrambled(second_digits(index), hashed(seed ^ 0x7f4a_7c15));
    Vec2::new(unit_fraction(first), unit_fraction(second))
}

/// Owen's scramble of a number whose digits stand the other way round.
fn scrambled(digits: u32, seed: u32) -> u32 {
    let mut x = digits ^ digits.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

fn second_digits(index: u32) -> u32 {
    let halves = [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0x0000_ffff)];
    halves.into_iter().fold(index, |x, (by, mask)| x ^ ((x >> by) & mask))
}

fn unit_fraction(digits: u32) -> f32 {
    (digits.reverse_bits() >> 8) as f32 * 5.960_464_5e-8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a sequence in each of the boxes of `columns` × `rows`.
    fn counts(seed: u32, first: u32, count: u32, columns: u32, rows: u32) -> Vec<u32> {
        let mut counts = vec![0; (columns * rows) as usize];
        for number in first..first + count {
            let place = point_of(number, seed) * Vec2::new(columns as f32, rows as f32);
            counts[(place.y as u32 * columns + place.x as u32) as usize] += 1;
        }
        counts
    }

    #[test]
    fn every_box_of_equal_area_has_one_point() {
        for seed in (0..50).map(hashed) {
            for power in 0..9 {
                for across in 0..=power {
                    let columns = 1 << across;
                    let rows = 1 << (power - across);
                    let counts = counts(seed, 0, 1 << power, columns, rows);
                    assert!(counts.iter().all(|&n| n == 1), "{columns} × {rows}, seed {seed}: {counts:?}");
                }
            }
        }
    }

    #[test]
    fn later_points_are_stratified_too() {
        for seed in (100..120).map(hashed) {
            for part in 0..8 {
                assert!(counts(seed, part * 32, 32, 4, 8).iter().all(|&n| n == 1), "{seed} {part}");
            }
        }
    }

    #[test]
    fn points_lie_in_the_square_and_differ_between_seeds() {
        let mean = |number: u32| {
            (0..20_000)
                .map(|i| point_of(number, hashed(i)))
                .inspect(|p| assert!(p.min_element() >= 0.0 && p.max_element() < 1.0))
                .sum::<Vec2>()
                / 20_000.0
        };
        // One point of many sequences is spread evenly: 4 of its standard deviations.
        for number in [0, 1, 5, 255] {
            let off = (mean(number) - 0.5).abs().max_element();
            assert!(off < 4.0 / (12.0f32 * 20_000.0).sqrt(), "{number}: {off}");
        }
    }
}
