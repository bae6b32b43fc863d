//! Sampling methods of the study.

use sampling::{Redundancy, SamplingMethod};

/// The number of images of a set, as in the paper.
pub const IMAGES: usize = 3;
/// The methods that are compared, conventional sampling first.
pub const METHODS: [SamplingMethod; 5] = [
    SamplingMethod::CONVENTIONAL,
    SamplingMethod::NonRedundant(Redundancy::Pixel),
    SamplingMethod::NonRedundant(Redundancy::Visibility),
    SamplingMethod::NonRedundant(Redundancy::Coverage),
    SamplingMethod::DepthPeeling { layers: IMAGES as u32 },
];
