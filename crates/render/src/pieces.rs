//! Pictures in pieces of some rows each, so that work on a shared device is short; whole where nobody watches.

use depth_image::Camera;
use gpu::DispatchSize;

/// Pieces begin with whole workgroups.
const ROWS_ALIGNED: u32 = 8;

/// Some rows of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Piece {
    pub camera: usize,
    /// The place of the piece among those of all pictures, and in the uniform of cameras.
    pub element: u32,
    pub width_px: u32,
    pub first_row: u32,
    pub end_row: u32,
}

impl Piece {
    /// All pictures of a batch in pieces of at most so many pixels, where that is more than a few rows.
    pub fn all(cameras: &[Camera], most_px: u64) -> Vec<Self> {
        let mut all = Vec::new();
        for (camera, size_px) in cameras.iter().map(Camera::size_px).enumerate() {
            let most_rows = (most_px / u64::from(size_px.x)).clamp(1, size_px.y.into()) as u32;
            let count = size_px.y.div_ceil(most_rows.max(ROWS_ALIGNED));
            let a_piece = size_px.y.div_ceil(count).next_multiple_of(ROWS_ALIGNED);
            for first_row in (0..size_px.y).step_by(a_piece as usize) {
                let end_row = (first_row + a_piece).min(size_px.y);
                all.push(Self { camera, element: all.len() as u32, width_px: size_px.x, first_row, end_row });
            }
        }
        all
    }

    pub fn pixel_count(&self) -> u32 {
        self.width_px * (self.end_row - self.first_row)
    }

    /// A dispatch with an invocation for each pixel.
    pub fn size(&self) -> DispatchSize<'static> {
        DispatchSize::Invocations([self.width_px, self.end_row - self.first_row, 1])
    }
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;
    use glam::{UVec2, Vec3};

    use super::*;

    #[test]
    fn pieces_cover_every_row_of_every_picture_once() {
        let camera = |size: [u32; 2]| {
            Camera::from(PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, UVec2::from(size)))
        };
        let cameras = [[64, 48], [1, 1], [33, 21], [1280, 720]].map(camera);
        for (most_px, least_pieces) in [(u64::MAX, 4), (1, 6 + 1 + 3 + 90), (20_000, 4)] {
            let pieces = Piece::all(&cameras, most_px);
            assert!(pieces.len() >= least_pieces, "{most_px}: {}", pieces.len());
            assert!(pieces.iter().all(|piece| piece.first_row.is_multiple_of(ROWS_ALIGNED)));
            assert!((0..).zip(&pieces).all(|(element, piece)| piece.element == element));
            for (number, camera) in cameras.iter().enumerate() {
                let pieces = pieces.iter().filter(|piece| piece.camera == number);
                let rows: Vec<u32> = pieces.flat_map(|piece| piece.first_row..piece.end_row).collect();
                assert_eq!(rows, (0..camera.size_px().y).collect::<Vec<_>>());
            }
        }
        assert_eq!(Piece::all(&cameras, u64::MAX).len(), cameras.len());
    }
}
