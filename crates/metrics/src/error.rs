//! Errors of the inputs of a comparison.

/// Inputs that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum MetricsError {
    #[error("{what} holds {len} values, its size calls for {expected}")]
    BufferSize { what: &'static str, len: usize, expected: usize },
    /// Two images of different sizes, columns and rows.
    #[error("reference is {reference_px:?} pixels, test is {test_px:?}")]
    SizesDiffer { reference_px: (u32, u32), test_px: (u32, u32) },
    #[error("{what} has no pixels")]
    Empty { what: &'static str },
    #[error("image of {size_px:?} pixels is smaller than the window of {window_px}")]
    SmallerThanWindow { size_px: (u32, u32), window_px: u32 },
    #[error("{what} must be finite and above 0")]
    Setting { what: &'static str },
    #[error("sample image {index}: {source}")]
    SampleImage { index: usize, source: depth_image::DepthImageError },
}

/// Fails unless `len` equals `expected`.
pub(crate) fn expect_len(what: &'static str, len: usize, expected: usize) -> Result<(), MetricsError> {
    match len == expected {
        true => Ok(()),
        false => Err(MetricsError::BufferSize { what, len, expected }),
    }
}

/// Fails for a mask without one entry per pixel.
pub(crate) fn expect_mask(mask: Option<&[bool]>, pixels: usize) -> Result<(), MetricsError> {
    mask.map_or(Ok(()), |mask| expect_len("mask", mask.len(), pixels))
}
