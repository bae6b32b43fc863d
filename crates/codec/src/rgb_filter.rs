//! 8-bit RGB made easier for LZ4, without loss: differences from the left, red and blue less green's.
//!
//! Against LZ4 alone: 3 % fewer bytes on two rendered bunnies, 6 % on leather; 4 % more where leaves of
//! one colour each leave nothing to predict. Prediction by the median of left, above and their plane,
//! packed by class, runs at half the speed. It takes 4 and 8 % fewer bytes on the bunnies, a quarter fewer on the
//! leather, and more on the leaves.

/// Differences of each pixel from the one before.
pub(crate) fn filter(rgb: &[[u8; 3]]) -> Vec<u8> {
    let mut filtered = vec![0; rgb.len() * 3];
    let mut last = [0u8; 3];
    for (out, &pixel) in filtered.as_chunks_mut::<3>().0.iter_mut().zip(rgb) {
        let [red, green, blue] = [0, 1, 2].map(|channel| pixel[channel].wrapping_sub(last[channel]));
        *out = [red.wrapping_sub(green), green, blue.wrapping_sub(green)];
        last = pixel;
    }
    filtered
}

/// The inverse of [`filter`], in place.
pub(crate) fn unfilter(filtered: &mut [u8]) {
    let mut last = [0u8; 3];
    for pixel in filtered.as_chunks_mut::<3>().0 {
        let [red, green, blue] = *pixel;
        let difference = [red.wrapping_add(green), green, blue.wrapping_add(green)];
        last = [0, 1, 2].map(|channel| last[channel].wrapping_add(difference[channel]));
        *pixel = last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_planes::Random;

    #[test]
    fn unfiltering_inverts_filtering() {
        let mut random = Random::new(20);
        let rgb: Vec<[u8; 3]> = (0..1000).map(|_| [0; 3].map(|_: u8| random.next_u32() as u8)).collect();
        let mut filtered = filter(&rgb);
        unfilter(&mut filtered);
        assert_eq!(filtered, rgb.into_flattened());
    }

    #[test]
    fn gradients_repeat() {
        let rgb: Vec<[u8; 3]> = (0..200).map(|x| [x, x, x]).collect();
        assert!(filter(&rgb)[3..].as_chunks::<3>().0.iter().all(|pixel| *pixel == [0, 1, 0]));
    }
}
