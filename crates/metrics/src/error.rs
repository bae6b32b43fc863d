//! Errors of comparisons.

/// Data that cannot be compared.
#[allow(missing_docs, reason = "self-naming fields")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// A buffer's length does not follow from its width and height.
    #[error("{what} holds {len} values, its size calls for {expected}")]
    BufferSize { what: &'static str, len: usize, expected: usize },
    /// Two images of different sizes.
    #[error("reference is {reference_px:?} pixels, test is {test_px:?}")]
    SizesDiffer { reference_px: (u32, u32), test_px: (u32, u32) },
    /// A side of length 0.
    #[error("{what} has no pixels")]
    Empty { what: &'static str },
    /// The image is smaller than one window of the metric.
    #[error("image of {size_px:?} pixels is smaller than the window of {window_px}")]
    SmallerThanWindow { size_px: (u32, u32), window_px: u32 },
    /// The planes of a sample image do not fit its camera.
    #[error("sample image {index}: {source}")]
    SampleImage { index: usize, source: depth_image::SampleImageError },
}

/// Fails unless `len` is what is expected.
pub(crate) fn expect_len(what: &'static str, len: usize, expected: usize) -> Result<(), MetricsError> {
    if len == expected { Ok(()) } else { Err(MetricsError::BufferSize { what, len, expected }) }
}

/// Fails if there is a mask without one entry a pixel.
pub(crate) fn expect_mask(mask: Option<&[bool]>, pixels: usize) -> Result<(), MetricsError> {
    mask.map_or(Ok(()), |mask| expect_len("mask", mask.len(), pixels))
}
