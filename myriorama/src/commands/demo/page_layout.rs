//! The layout of the first page: four pictures of one view, their colours' names and one line of figures.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};
use pictures::{Legend, TextStyle};

/// Columns and rows of the page.
pub(super) const PAGE_PX: (u32, u32) = (1280, 720);
/// Columns and rows of the view, drawn and reconstructed.
pub(super) const VIEW_PX: (u32, u32) = (628, 392);
/// The same view in false colours.
const SMALL_PX: (u32, u32) = (380, 237);
const MARGIN_PX: u32 = 8;
/// The upper edges of both rows of pictures; their titles stand above.
const ROWS_PX: [u32; 2] = [30, 452];
const TITLE_PX: u32 = 20;
/// The upper edge of the line of figures.
const FIGURES_PX: u32 = 698;
const PAPER: Rgb<u8> = Rgb([20, 23, 26]);
const INK: TextStyle = TextStyle { dot_px: 2, color: [230, 233, 237] };
const SOFT: TextStyle = TextStyle { dot_px: 2, color: [154, 164, 174] };
/// The distance of lines beside the pictures, and the side of a colour's key.
const LINE_PX: u32 = 22;
const KEY_PX: u32 = 14;

/// The parts of the page.
pub(super) struct PageParts {
    pub direct: RgbImage,
    pub reconstructed: RgbImage,
    pub provenance: RgbImage,
    pub legend: Legend,
    pub error_map: RgbImage,
    /// Lines about the scene.
    pub facts: Vec<String>,
    /// One line with times and errors.
    pub figures: String,
}

impl PageParts {
    /// The page.
    pub(super) fn page(&self) -> RgbImage {
        let mut page = RgbImage::from_pixel(PAGE_PX.0, PAGE_PX.1, PAPER);
        let small = |image, filter| imageops::resize(image, SMALL_PX.0, SMALL_PX.1, filter);
        let second = MARGIN_PX * 2 + VIEW_PX.0;
        place(&mut page, (MARGIN_PX, ROWS_PX[0]), "drawn directly from the scene", &self.direct);
        place(&mut page, (second, ROWS_PX[0]), "made with four sample images", &self.reconstructed);
        // Between two sources there is no third.
        let provenance = small(&self.provenance, FilterType::Nearest);
        place(&mut page, (MARGIN_PX, ROWS_PX[1]), "where each pixel comes from", &provenance);
        let error_map = small(&self.error_map, FilterType::Triangle);
        place(&mut page, (MARGIN_PX * 2 + SMALL_PX.0, ROWS_PX[1]), "error (FLIP): black is none", &error_map);
        self.write_names(&mut page, (MARGIN_PX * 3 + SMALL_PX.0 * 2, ROWS_PX[1]));
        INK.write(&mut page, (MARGIN_PX, FIGURES_PX), &self.figures);
        page
    }

    fn write_names(&self, page: &mut RgbImage, (left, mut top): (u32, u32)) {
        for fact in &self.facts {
            SOFT.write(page, (left, top), fact);
            top += LINE_PX;
        }
        for (name, color) in &self.legend {
            let key = RgbImage::from_pixel(KEY_PX, KEY_PX, Rgb(*color));
            imageops::replace(page, &key, left.into(), top.into());
            INK.write(page, (left + KEY_PX + MARGIN_PX, top), name);
            top += LINE_PX;
        }
    }
}

fn place(page: &mut RgbImage, (left, top): (u32, u32), title: &str, image: &RgbImage) {
    SOFT.write(page, (left, top - TITLE_PX), title);
    imageops::replace(page, image, left.into(), top.into());
}

/// Returns whether a line of figures fits on the page.
#[cfg(test)]
pub(super) fn fits(figures: &str) -> bool {
    INK.size_px(figures).0 + 2 * MARGIN_PX <= PAGE_PX.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(size_px: (u32, u32), value: u8) -> RgbImage {
        RgbImage::from_pixel(size_px.0, size_px.1, Rgb([value; 3]))
    }

    fn parts() -> PageParts {
        PageParts {
            direct: flat(VIEW_PX, 100),
            reconstructed: flat(VIEW_PX, 110),
            provenance: flat(VIEW_PX, 120),
            legend: vec![("camera 0".to_owned(), [1, 2, 3]); 7],
            error_map: flat(VIEW_PX, 130),
            facts: vec![String::new(); 3],
            figures: "figures".to_owned(),
        }
    }

    #[test]
    fn every_part_is_on_the_page() {
        let page = parts().page();
        assert_eq!(page.dimensions(), PAGE_PX);
        let at = |x: u32, y: u32| page[(x, y)].0;
        assert_eq!([at(8, 30), at(635, 421), at(644, 30), at(1271, 421)], [[100; 3], [100; 3], [110; 3], [110; 3]]);
        assert_eq!([at(8, 452), at(387, 688), at(396, 452), at(775, 688)], [[120; 3], [120; 3], [130; 3], [130; 3]]);
        assert_eq!(at(784, 452 + 3 * LINE_PX), [1, 2, 3]);
        assert!((698..712).any(|y| at(8, y) == INK.color), "the line of figures");
    }

    #[test]
    fn parts_do_not_cover_each_other() {
        assert!(ROWS_PX[0] + VIEW_PX.1 <= ROWS_PX[1] - TITLE_PX && ROWS_PX[1] + SMALL_PX.1 <= FIGURES_PX);
        assert!(ROWS_PX[1] + 10 * LINE_PX <= FIGURES_PX, "three facts and seven names");
        assert_eq!(2 * VIEW_PX.0 + 3 * MARGIN_PX, PAGE_PX.0);
    }
}
