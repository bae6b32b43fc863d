//! Random numbers from a seed: SplitMix64 (Steele, Lea, Flood 2014), the same on every platform.
//!
//! A number is a function of a seed and a place in its sequence. No state is kept, and numbers come in any order.

/// The number at a place of the sequence of a seed.
pub(crate) fn mixed(seed: u64, place: u64) -> u64 {
    let z = seed.wrapping_add(place.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The number as a fraction from 0 to below 1.
pub(crate) fn unit(seed: u64, place: u64) -> f64 {
    (mixed(seed, place) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_published_generator() {
        let first: Vec<u64> = (0..3).map(|place| mixed(1_234_567, place)).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn unit_numbers_fill_their_range_evenly() {
        let mean = (0..10_000).map(|place| unit(7, place)).sum::<f64>() / 10_000.0;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!((0..10_000).all(|place| (0.0..1.0).contains(&unit(7, place))));
    }
}
