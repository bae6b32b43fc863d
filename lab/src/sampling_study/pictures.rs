//! Fig. 6: redundant, disoccluded and useful samples in colours.

use depth_image::DepthImage;
use image::{Rgb, RgbImage};
use report::{Picture, PictureRow};

use super::counts::ImageCount;
use super::methods::METHODS;

const NOTHING: [u8; 3] = [0, 0, 0];
const KNOWN: [u8; 3] = [96, 96, 104];
const DISOCCLUDED: [u8; 3] = [70, 160, 80];
const USEFUL: [u8; 3] = [240, 210, 60];
/// The largest side of a picture; larger images are subsampled.
const SIDE_PX: u32 = 512;

/// A picture of each image of every method but the conventional one.
pub fn false_colors(scene: &str, sets: &[Vec<DepthImage>], counts: &[Vec<ImageCount>]) -> PictureRow {
    let pictures = METHODS.iter().zip(sets).zip(counts).skip(1).flat_map(|((method, set), counts)| {
        set.iter().zip(counts).enumerate().map(move |(number, (image, count))| {
            let caption = format!("{method}, image {number}");
            let legend = [("known to conventional images", KNOWN), ("disoccluded", DISOCCLUDED), ("useful", USEFUL)];
            Picture {
                legend: legend.map(|(name, color)| (name.to_owned(), color)).to_vec(),
                ..Picture::new(format!("{scene} {caption}"), caption, false_color(image, count))
            }
        })
    });
    PictureRow {
        title: format!("{scene}: what images hold beside conventional ones (Fig. 6)"),
        pictures: pictures.collect(),
    }
}

fn false_color(image: &DepthImage, count: &ImageCount) -> RgbImage {
    let size = image.size_px();
    let mut colors: Vec<[u8; 3]> =
        image.inverse_depth_per_m.iter().map(|&d| if d > 0.0 { KNOWN } else { NOTHING }).collect();
    for (sample, &useful) in count.disoccluded.iter().zip(&count.useful) {
        colors[sample.index] = if useful { USEFUL } else { DISOCCLUDED };
    }
    let step = (size.x / SIDE_PX).max(1);
    RgbImage::from_fn(size.x / step, size.y / step, |x, y| Rgb(colors[(y * step * size.x + x * step) as usize]))
}
