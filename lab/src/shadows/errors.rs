//! Errors of visibility and intensity (Xie et al. 2016, §6.2).

use depth_image::View;
use image::{Rgb, RgbImage};

use super::subject::GRID_SIDE;

const BACKGROUND: [u8; 3] = [24, 24, 48];

/// Words of a pixel's bits.
const WORDS: usize = (GRID_SIDE * GRID_SIDE / 32) as usize;

/// Errors over the pixels that show a surface, from 0 to 255: of the places of the lamp that a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ShadowErrors {
    /// i: mean difference of the number of places that are seen.
    pub intensity: f64,
    /// v: mean number of places that are wrong.
    pub visibility: f64,
    /// Mean difference with its sign: light that leaks is positive.
    pub signed: f64,
    /// The greatest difference of a pixel.
    pub most: f64,
    /// i where the truth sees all of the lamp, a part, and nothing.
    pub lit: f64,
    pub penumbra: f64,
    pub umbra: f64,
}

/// A mean that is built step by step.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn value(self) -> f64 {
        if self.count > 0 { self.sum / self.count as f64 } else { 0.0 }
    }
}

impl ShadowErrors {
    /// Of bits against true ones, where the view shows a surface.
    pub fn of(truth: &[u32], test: &[u32], view: &View) -> Self {
        let scale = 255.0 / f64::from(GRID_SIDE * GRID_SIDE);
        let shown = view.inverse_depth_per_m.as_deref().unwrap_or_default();
        let [mut intensity, mut visibility, mut signed] = [Mean::default(); 3];
        let [mut lit, mut penumbra, mut umbra] = [Mean::default(); 3];
        let mut most = 0.0_f64;
        let pixels = shown.iter().zip(truth.chunks_exact(WORDS)).zip(test.chunks_exact(WORDS));
        for ((depth, truth), test) in pixels {
            if *depth <= 0.0 {
                continue;
            }
            let open = f64::from(seen(truth));
            let difference = (f64::from(seen(test)) - open) * scale;
            let wrong: u32 = truth.iter().zip(test).map(|(a, b)| (a ^ b).count_ones()).sum();
            intensity.add(difference.abs());
            visibility.add(f64::from(wrong) * scale);
            signed.add(difference);
            most = most.max(difference.abs());
            let class = match seen(truth) {
                0 => &mut umbra,
                all if all == GRID_SIDE * GRID_SIDE => &mut lit,
                _ => &mut penumbra,
            };
            class.add(difference.abs());
        }
        Self {
            intensity: intensity.value(),
            visibility: visibility.value(),
            signed: signed.value(),
            most,
            lit: lit.value(),
            penumbra: penumbra.value(),
            umbra: umbra.value(),
        }
    }
}

/// The share of the lamp that each pixel sees, as a grey; background where no surface is shown.
pub fn share_picture(bits: &[u32], view: &View) -> RgbImage {
    let shown = view.inverse_depth_per_m.as_deref().unwrap_or_default();
    let mut picture = RgbImage::from_pixel(view.size_px.x, view.size_px.y, Rgb(BACKGROUND));
    for ((pixel, depth), bits) in picture.pixels_mut().zip(shown).zip(bits.chunks_exact(WORDS)) {
        if *depth > 0.0 {
            *pixel = Rgb([(seen(bits) * 255 / (GRID_SIDE * GRID_SIDE)) as u8; 3]);
        }
    }
    picture
}

fn seen(bits: &[u32]) -> u32 {
    bits.iter().map(|word| word.count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    #[test]
    fn errors_cancel_in_intensity_but_not_in_visibility() {
        let mut view = View::from_srgb8(UVec2::new(3, 1), vec![0; 9]);
        view.inverse_depth_per_m = Some(vec![1.0, 1.0, 0.0]);
        let truth = [vec![0x0000_ffff; WORDS], vec![0; WORDS], vec![0; WORDS]].concat();
        let test = [vec![0xffff_0000; WORDS], vec![u32::MAX; WORDS], vec![u32::MAX; WORDS]].concat();
        let errors = ShadowErrors::of(&truth, &test, &view);
        assert_eq!((errors.intensity, errors.visibility), (127.5, 255.0), "the pixel without a surface does not count");
        assert_eq!((errors.signed, errors.most), (127.5, 255.0));
        assert_eq!((errors.lit, errors.penumbra, errors.umbra), (0.0, 0.0, 255.0));
        assert_eq!(ShadowErrors::of(&truth, &truth, &view), ShadowErrors::default());
    }
}
