//! Rectangles of a view's pixels, and the cameras that see them alone.

use glam::UVec2;

use crate::PinholeCamera;

/// The greatest distance between a pixel of a view and another that it depends on, in pixels: holes are filled from around.
pub const VIEW_REACH_PX: u32 = 48;

/// A rectangle of a view's pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewPart {
    /// The column and the row of its first pixel.
    pub first_px: UVec2,
    /// Columns and rows.
    pub size_px: UVec2,
}

impl ViewPart {
    /// All pixels of a view.
    #[must_use]
    pub fn whole(view_px: UVec2) -> Self {
        Self { first_px: UVec2::ZERO, size_px: view_px }
    }

    /// The square with a pixel, of those with sides of `side_px` that cover a view from its first pixel on. It is smaller at
    /// the view's end.
    #[must_use]
    pub fn square_of(pixel: UVec2, side_px: u32, view_px: UVec2) -> Self {
        let first_px = pixel / side_px * side_px;
        Self { first_px, size_px: UVec2::splat(side_px).min(view_px - first_px) }
    }

    /// The pixels up to `reach_px` away from it, as far as the view has them.
    #[must_use]
    pub fn surrounded(&self, reach_px: u32, view_px: UVec2) -> Self {
        let first_px = self.first_px.saturating_sub(UVec2::splat(reach_px));
        let end_px = (self.first_px + self.size_px + reach_px).min(view_px);
        Self { first_px, size_px: end_px - first_px }
    }

    /// For each pixel of an outer part, row by row, whether it is one of this part.
    pub fn mask_within(&self, outer: &Self) -> impl Iterator<Item = bool> {
        let part = *self;
        let Self { first_px, size_px } = *outer;
        let places = (0..size_px.y).flat_map(move |y| (0..size_px.x).map(move |x| UVec2::new(x, y)));
        places.map(move |place| part.contains(first_px + place))
    }

    fn contains(&self, pixel: UVec2) -> bool {
        pixel.cmpge(self.first_px).all() && pixel.cmplt(self.first_px + self.size_px).all()
    }
}

impl PinholeCamera {
    /// The camera of a part of the view.
    #[must_use]
    pub fn part(&self, part: &ViewPart) -> Self {
        Self { size_px: part.size_px, ..self.with_offset(part.first_px.as_vec2()) }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    const VIEW_PX: UVec2 = UVec2::new(300, 200);

    #[test]
    fn squares_cover_every_pixel_once() {
        let mut counts = vec![0; VIEW_PX.element_product() as usize];
        let whole = ViewPart::whole(VIEW_PX);
        for first in [[0, 0], [128, 0], [256, 0], [0, 128], [128, 128], [256, 128]].map(UVec2::from) {
            let part = ViewPart::square_of(first + 5, 128, VIEW_PX);
            assert_eq!(part.first_px, first);
            counts.iter_mut().zip(part.mask_within(&whole)).for_each(|(count, is_own)| *count += u32::from(is_own));
        }
        assert!(counts.iter().all(|&count| count == 1));
    }

    #[test]
    fn surroundings_end_with_the_view() {
        let part = ViewPart::square_of(UVec2::new(299, 10), 128, VIEW_PX);
        assert_eq!(part, ViewPart { first_px: UVec2::new(256, 0), size_px: UVec2::new(44, 128) });
        let outer = part.surrounded(58, VIEW_PX);
        assert_eq!(outer, ViewPart { first_px: UVec2::new(198, 0), size_px: UVec2::new(102, 186) });
        let mask: Vec<bool> = part.mask_within(&outer).collect();
        assert_eq!(mask.len(), 102 * 186);
        assert_eq!(mask.iter().filter(|&&is_own| is_own).count(), 44 * 128);
        assert!(!mask[57] && mask[58]);
    }

    #[test]
    fn a_pixel_of_a_part_has_the_ray_of_the_views_pixel() {
        let camera = PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 5.0), Vec3::ZERO, Vec3::Y, 0.9, VIEW_PX);
        let part = ViewPart { first_px: UVec2::new(120, 64), size_px: UVec2::new(7, 9) };
        let at = Vec2::new(3.5, 2.5);
        let first = part.first_px.as_vec2();
        assert_eq!(camera.part(&part).size_px, part.size_px);
        let [own, whole] = [camera.part(&part).ray(at), camera.ray(first + at)];
        assert!(own.at(1.0).distance(whole.at(1.0)) < 1e-5);
    }
}
