//! Sampling methods of the study.

use sampling::{Redundancy, SamplingMethod};

/// The number of images of a set, as in the paper.
pub const IMAGES: usize = 3;
/// The methods that are compared, conventional sampling first.
pub const METHODS: [SamplingMethod; 6] = [
    SamplingMethod::CONVENTIONAL,
    SamplingMethod::NonRedundant(Redundancy::Pixel),
    SamplingMethod::NonRedundant(Redundancy::Visibility),
    SamplingMethod::NonRedundant(Redundancy::Tolerance),
    SamplingMethod::DepthPeeling { layers: IMAGES as u32 },
    SamplingMethod::Useful(Redundancy::Pixel),
];
