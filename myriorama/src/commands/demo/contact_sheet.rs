//! Many images on one sheet.

use image::{Rgb, RgbImage, imageops};

/// The colour between images: near black, so that it is not taken for a part of them.
const GAP_COLOR: Rgb<u8> = Rgb([28, 30, 34]);

/// Lays images out in rows, in cells as large as the largest image, with `gap_px` between cells and around all. No
/// images make an empty sheet; 0 columns count as 1.
pub(super) fn contact_sheet(images: &[RgbImage], columns: u32, gap_px: u32) -> RgbImage {
    let count = images.len() as u32;
    let columns = columns.clamp(1, count.max(1));
    let rows = count.div_ceil(columns);
    let cell_width = images.iter().map(RgbImage::width).max().unwrap_or(0);
    let cell_height = images.iter().map(RgbImage::height).max().unwrap_or(0);
    let [width, height] = match count {
        0 => [0, 0],
        _ => [gap_px + columns * (cell_width + gap_px), gap_px + rows * (cell_height + gap_px)],
    };
    let mut sheet = RgbImage::from_pixel(width, height, GAP_COLOR);
    for (index, image) in (0..count).zip(images) {
        let x = gap_px + index % columns * (cell_width + gap_px);
        let y = gap_px + index / columns * (cell_height + gap_px);
        imageops::replace(&mut sheet, image, x.into(), y.into());
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(width: u32, height: u32, value: u8) -> RgbImage {
        RgbImage::from_pixel(width, height, Rgb([value; 3]))
    }

    #[test]
    fn cells_stand_in_rows_with_gaps() {
        let sheet = contact_sheet(&[flat(4, 3, 100), flat(4, 3, 150), flat(2, 2, 200)], 2, 1);
        assert_eq!(sheet.dimensions(), (1 + 2 * 5, 1 + 2 * 4));
        assert_eq!(sheet.get_pixel(1, 1).0, [100; 3]);
        assert_eq!(sheet.get_pixel(6, 1).0, [150; 3]);
        assert_eq!(sheet.get_pixel(1, 5).0, [200; 3]);
        assert_eq!([sheet[(0, 0)], sheet[(5, 1)], sheet[(3, 5)], sheet[(6, 5)]], [GAP_COLOR; 4]);
    }

    #[test]
    fn empty_and_small_sheets_have_their_size() {
        assert_eq!(contact_sheet(&[], 3, 4).dimensions(), (0, 0));
        assert_eq!(contact_sheet(&[flat(4, 3, 1)], 0, 0).dimensions(), (4, 3));
        assert_eq!(contact_sheet(&[flat(4, 3, 1)], 9, 0).dimensions(), (4, 3));
    }
}
