//! The layout of the first page: a view made in two ways, a reference, both errors and two lines of facts.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};
use pictures::TextStyle;

/// Columns and rows of the page.
const PAGE_PX: (u32, u32) = (1280, 776);
/// Columns and rows of the large pictures.
pub(super) const VIEW_PX: (u32, u32) = (628, 392);
/// Columns and rows of the small pictures.
const SMALL_PX: (u32, u32) = (416, 260);
const MARGIN_PX: u32 = 8;
/// The upper edges of both rows of pictures; their titles stand above.
const ROWS_PX: [u32; 2] = [30, 452];
const TITLE_PX: u32 = 20;
/// The upper edges of the lines of facts.
const FACTS_PX: [u32; 2] = [724, 748];
const PAPER: Rgb<u8> = Rgb([20, 23, 26]);
const INK: TextStyle = TextStyle { dot_px: 2, color: [230, 233, 237] };
const SOFT: TextStyle = TextStyle { dot_px: 2, color: [154, 164, 174] };

/// A picture and the title above it.
pub(super) struct TitledPicture {
    pub(super) title: String,
    pub(super) image: RgbImage,
}

/// The page.
pub(super) fn page(large: [TitledPicture; 2], small: [TitledPicture; 3], facts: [String; 2]) -> RgbImage {
    let mut page = RgbImage::from_pixel(PAGE_PX.0, PAGE_PX.1, PAPER);
    for (column, picture) in (0..).zip(large) {
        let left = MARGIN_PX + column * (VIEW_PX.0 + MARGIN_PX);
        INK.write(&mut page, (left, ROWS_PX[0] - TITLE_PX), &picture.title);
        imageops::replace(&mut page, &picture.image, left.into(), ROWS_PX[0].into());
    }
    for (column, picture) in (0..).zip(small) {
        let left = MARGIN_PX + column * (SMALL_PX.0 + MARGIN_PX);
        INK.write(&mut page, (left, ROWS_PX[1] - TITLE_PX), &picture.title);
        let image = imageops::resize(&picture.image, SMALL_PX.0, SMALL_PX.1, FilterType::Triangle);
        imageops::replace(&mut page, &image, left.into(), ROWS_PX[1].into());
    }
    for (top, fact) in FACTS_PX.into_iter().zip(&facts) {
        SOFT.write(&mut page, (MARGIN_PX, top), fact);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: u8) -> TitledPicture {
        TitledPicture { title: "title".to_owned(), image: RgbImage::from_pixel(VIEW_PX.0, VIEW_PX.1, Rgb([value; 3])) }
    }

    #[test]
    fn every_part_is_on_the_page() {
        let page = page([100, 110].map(flat), [120, 130, 140].map(flat), ["first", "second"].map(str::to_owned));
        assert_eq!(page.dimensions(), PAGE_PX);
        let at = |x: u32, y: u32| page[(x, y)].0;
        assert_eq!([at(8, 30), at(635, 421), at(644, 30), at(1271, 421)], [[100; 3], [100; 3], [110; 3], [110; 3]]);
        assert_eq!([at(8, 452), at(432, 711), at(1271, 711)], [[120; 3], [130; 3], [140; 3]]);
        let has_text = |top: u32| (top..top + 14).any(|y| (0..80).any(|x| at(x, y) != PAPER.0));
        assert!(ROWS_PX.iter().all(|top| has_text(top - TITLE_PX)) && FACTS_PX.into_iter().all(has_text));
    }

    #[test]
    fn parts_do_not_cover_each_other() {
        assert!(ROWS_PX[0] + VIEW_PX.1 <= ROWS_PX[1] - TITLE_PX && ROWS_PX[1] + SMALL_PX.1 <= FACTS_PX[0]);
        assert!(2 * VIEW_PX.0 + 3 * MARGIN_PX == PAGE_PX.0 && 3 * SMALL_PX.0 + 4 * MARGIN_PX == PAGE_PX.0);
    }
}
