//! What can be wrong with what is to be compared.

/// Why two things cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MetricsError {
    /// A buffer's length does not follow from its width and height.
    #[error("{what} holds {len} values, its size calls for {expected}")]
    BufferSize {
        /// Which buffer.
        what: &'static str,
        /// Values given.
        len: usize,
        /// Values that width and height call for.
        expected: usize,
    },
    /// Two images of different sizes.
    #[error("reference is {reference_px:?} pixels, test is {test_px:?}")]
    SizesDiffer {
        /// Columns and rows of the reference.
        reference_px: (u32, u32),
        /// Columns and rows of the test.
        test_px: (u32, u32),
    },
    /// A side of length 0.
    #[error("{what} has no pixels")]
    Empty {
        /// Which image.
        what: &'static str,
    },
    /// The image does not hold one window of the metric.
    #[error("image of {size_px:?} pixels is smaller than the window of {window_px}")]
    SmallerThanWindow {
        /// Columns and rows.
        size_px: (u32, u32),
        /// The window's side.
        window_px: u32,
    },
    /// A setting outside what the metric allows.
    #[error("{what} must be finite and above 0")]
    Setting {
        /// Which setting.
        what: &'static str,
    },
    /// A sample image whose planes do not fit its camera.
    #[error("sample image {index}: {source}")]
    SampleImage {
        /// Which, in the order given.
        index: usize,
        /// What does not fit.
        source: depth_image::DepthImageError,
    },
}

/// Fails unless `len` is what is expected.
pub(crate) fn expect_len(what: &'static str, len: usize, expected: usize) -> Result<(), MetricsError> {
    match len == expected {
        true => Ok(()),
        false => Err(MetricsError::BufferSize { what, len, expected }),
    }
}

/// Fails if there is a mask and it has not one entry a pixel.
pub(crate) fn expect_mask(mask: Option<&[bool]>, pixels: usize) -> Result<(), MetricsError> {
    mask.map_or(Ok(()), |mask| expect_len("mask", mask.len(), pixels))
}
