//! The colours of views to compare.

use depth_image::View;

use crate::{MetricsError, error::expect_len};

/// The pixels of a view, row by row.
pub(crate) fn pixels(view: &View) -> &[[u8; 3]] {
    view.srgb8.as_chunks().0
}

/// Fails unless both views have pixels and colours of one size.
pub(crate) fn expect_same_size(reference: &View, test: &View) -> Result<(), MetricsError> {
    for view in [reference, test] {
        if view.size_px.min_element() == 0 {
            return Err(MetricsError::Empty { what: "image" });
        }
        expect_len("image", view.srgb8.len(), view.size_px.x as usize * view.size_px.y as usize * 3)?;
    }
    let [reference_px, test_px] = [reference, test].map(|view| view.size_px.into());
    if reference_px == test_px { Ok(()) } else { Err(MetricsError::SizesDiffer { reference_px, test_px }) }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    #[test]
    fn a_wrong_length_and_an_empty_side_are_refused() {
        let good = View::from_srgb8(UVec2::splat(2), vec![0; 12]);
        let empty = View::from_srgb8(UVec2::new(0, 3), vec![]);
        assert_eq!(expect_same_size(&good, &empty), Err(MetricsError::Empty { what: "image" }));
        let short = View::from_srgb8(UVec2::splat(2), vec![0; 11]);
        let refused = Err(MetricsError::BufferSize { what: "image", len: 11, expected: 12 });
        assert_eq!(expect_same_size(&short, &good), refused);
    }
}
