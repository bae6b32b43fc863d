//! Images to compare: borrowed or owned, of a size that is checked.

use std::borrow::Cow;

use depth_image::View;

use crate::{MetricsError, error::expect_len};

/// An 8-bit sRGB image, three bytes a pixel, rows top-down.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rgb8Image<'a> {
    width_px: u32,
    height_px: u32,
    srgb8: Cow<'a, [u8]>,
}

impl<'a> Rgb8Image<'a> {
    /// Wraps pixels, borrowed or owned.
    ///
    /// # Errors
    /// A side of 0, or a length other than width × height × 3.
    pub fn new(width_px: u32, height_px: u32, srgb8: impl Into<Cow<'a, [u8]>>) -> Result<Self, MetricsError> {
        let srgb8 = srgb8.into();
        if width_px == 0 || height_px == 0 {
            return Err(MetricsError::Empty { what: "image" });
        }
        expect_len("image", srgb8.len(), width_px as usize * height_px as usize * 3)?;
        Ok(Self { width_px, height_px, srgb8 })
    }

    /// Borrows the colour of a view.
    ///
    /// # Errors
    /// A side of 0, or a plane that is not of the view's size.
    pub fn of_view(view: &'a View) -> Result<Self, MetricsError> {
        Self::new(view.size_px.x, view.size_px.y, view.srgb8.as_slice())
    }

    /// Columns.
    #[must_use]
    pub fn width_px(&self) -> u32 {
        self.width_px
    }

    /// Columns and rows.
    #[must_use]
    pub fn size_px(&self) -> (u32, u32) {
        (self.width_px, self.height_px)
    }

    /// Columns times rows.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.width_px as usize * self.height_px as usize
    }

    /// Three bytes a pixel, row by row.
    #[must_use]
    pub fn srgb8(&self) -> &[u8] {
        &self.srgb8
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = [u8; 3]> + '_ {
        self.srgb8.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]])
    }

    /// Fails unless `test` has this image's size.
    pub(crate) fn expect_same_size(&self, test: &Rgb8Image) -> Result<(), MetricsError> {
        let reference_px = self.size_px();
        let test_px = test.size_px();
        if reference_px == test_px { Ok(()) } else { Err(MetricsError::SizesDiffer { reference_px, test_px }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_sizes_are_refused() {
        assert_eq!(Rgb8Image::new(0, 3, vec![]).unwrap_err(), MetricsError::Empty { what: "image" });
        let short = Rgb8Image::new(2, 2, vec![0; 11]).unwrap_err();
        assert_eq!(short, MetricsError::BufferSize { what: "image", len: 11, expected: 12 });
    }
}
