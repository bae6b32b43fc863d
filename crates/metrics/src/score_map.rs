//! One score a pixel, and its mean over any part of the image.

use glam::UVec2;

use crate::{MetricsError, error::expect_mask};

/// A metric's value at every pixel. A metric with a window has no value within `border_px` of the image's edge; those
/// pixels hold 0 and are in no mean.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreMap {
    /// Columns and rows.
    pub size_px: UVec2,
    /// The number of pixels at each edge without a value.
    pub border_px: u32,
    /// One value a pixel, row by row.
    pub values: Vec<f32>,
}

impl ScoreMap {
    /// The mean over all pixels with a value, or over those in the mask; `None` without such pixels.
    ///
    /// # Errors
    /// The mask has another size.
    pub fn mean(&self, mask: Option<&[bool]>) -> Result<Option<f64>, MetricsError> {
        expect_mask(mask, self.values.len())?;
        let columns = self.border_px..self.size_px.x.saturating_sub(self.border_px);
        let rows = self.border_px..self.size_px.y.saturating_sub(self.border_px);
        let pixels = rows.flat_map(|y| columns.clone().map(move |x| (y * self.size_px.x + x) as usize));
        let selected = pixels.filter(|&index| mask.is_none_or(|mask| mask[index]));
        let values = selected.map(|index| f64::from(self.values[index]));
        let (sum, count) = values.fold((0.0, 0_u64), |(sum, count), value| (sum + value, count + 1));
        Ok((count > 0).then(|| sum / count as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_is_in_no_mean() {
        let values = vec![9.0, 9.0, 9.0, 9.0, 0.5, 9.0, 9.0, 9.0, 9.0];
        let map = ScoreMap { size_px: UVec2::splat(3), border_px: 1, values };
        assert_eq!(map.mean(None).unwrap(), Some(0.5));
        let mut corner = [false; 9];
        corner[0] = true;
        assert_eq!(map.mean(Some(&corner)).unwrap(), None);
        assert!(map.mean(Some(&corner[1..])).is_err());
    }
}
