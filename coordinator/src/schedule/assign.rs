//! Whole images to samplers, whole views to compositors.

use std::ops::Range;

/// Images of each of `samplers` nodes, dealt in turn. Where there are more nodes than images, the last
/// ones have none.
#[must_use]
pub fn share_images(image_count: usize, samplers: usize) -> Vec<Vec<u32>> {
    (0..samplers)
        .map(|sampler| (sampler..image_count).step_by(samplers.max(1)).map(|image| image as u32).collect())
        .collect()
}

/// All images to each of `samplers` nodes, which then sample sets in turn.
#[must_use]
pub fn share_sets(image_count: usize, samplers: usize) -> Vec<Vec<u32>> {
    vec![(0..image_count as u32).collect(); samplers]
}

/// Contiguous views of each of `compositors` nodes; no two differ by more than one view.
#[must_use]
pub fn share_views(view_count: usize, compositors: usize) -> Vec<Range<usize>> {
    let start = |i: usize| i * view_count / compositors.max(1);
    (0..compositors).map(|i| start(i)..start(i + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_and_view_is_dealt_once_and_evenly() {
        for nodes in 1..12 {
            for count in 0..40 {
                let mut images: Vec<u32> = share_images(count, nodes).concat();
                images.sort_unstable();
                assert_eq!(images, (0..count as u32).collect::<Vec<_>>());
                let ranges = share_views(count, nodes);
                let views: Vec<usize> = ranges.iter().cloned().flatten().collect();
                assert_eq!(views, (0..count).collect::<Vec<_>>());
                assert!(ranges.iter().all(|range| range.len() <= count.div_ceil(nodes)));
                assert!(share_images(count, nodes).iter().all(|share| share.len() <= count.div_ceil(nodes)));
            }
        }
    }
}
