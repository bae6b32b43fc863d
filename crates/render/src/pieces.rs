//! Pictures in pieces of some rows each, so that work on a shared device is short; whole where nobody watches.

use std::ops::Range;

use depth_image::Camera;

/// Pieces begin with whole workgroups.
const ROWS_ALIGNED: u32 = 8;

/// Some rows of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Piece {
    pub camera: usize,
    pub first_row: u32,
    pub end_row: u32,
}

/// The pieces of all pictures of a batch, in their order: each has an element of the uniform of cameras.
#[derive(Debug)]
pub(crate) struct Pieces {
    pub all: Vec<Piece>,
}

impl Pieces {
    /// Pieces of at most so many pixels, where that is more than a few rows.
    pub fn of(cameras: &[Camera], most_px: u64) -> Self {
        let pieces = cameras.iter().enumerate().flat_map(|(number, camera)| of_camera(number, camera, most_px));
        Self { all: pieces.collect() }
    }

    /// The pieces of a camera with their elements.
    pub fn of_camera(&self, camera: usize) -> impl Iterator<Item = (u32, Piece)> + use<'_> {
        (0..).zip(self.all.iter().copied()).filter(move |(_, piece)| piece.camera == camera)
    }
}

fn of_camera(number: usize, camera: &Camera, most_px: u64) -> Vec<Piece> {
    let size_px = camera.size_px();
    let rows = Range { start: 0, end: size_px.y };
    let most_rows = (most_px / u64::from(size_px.x)).clamp(1, size_px.y.into()) as u32;
    let count = size_px.y.div_ceil(most_rows.max(ROWS_ALIGNED));
    let a_piece = size_px.y.div_ceil(count).next_multiple_of(ROWS_ALIGNED);
    let piece = |first_row: u32| Piece { camera: number, first_row, end_row: (first_row + a_piece).min(size_px.y) };
    rows.step_by(a_piece as usize).map(piece).collect()
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
            let pieces = Pieces::of(&cameras, most_px);
            assert!(pieces.all.len() >= least_pieces, "{most_px}: {}", pieces.all.len());
            for (number, camera) in cameras.iter().enumerate() {
                let rows: Vec<u32> = pieces.of_camera(number).flat_map(|(_, p)| p.first_row..p.end_row).collect();
                assert_eq!(rows, (0..camera.size_px().y).collect::<Vec<_>>());
                assert!(pieces.of_camera(number).all(|(_, piece)| piece.first_row % ROWS_ALIGNED == 0));
            }
        }
        assert_eq!(Pieces::of(&cameras, u64::MAX).all.len(), cameras.len());
    }
}
