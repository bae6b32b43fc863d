//! Rays through layered images by quadtrees of depths, one for each layer (Lischinski §4.3).
//!
//! Lengths are in spacings of the lines. The nodes of one place lie layer behind layer in memory: the paper's cross link is the next.

use std::ops::Range;

use depth_image::{LayeredDepthImage, ParallelCamera, Ray};
use glam::{UVec2, Vec3};

/// The slope of 89°: normals in two bytes are within a degree, and no ε is infinite.
const MAX_SLOPE: f32 = 57.3;
/// A ray along an axis of the image leans by this much, so that nothing divides by zero.
const LEAST_LEAN: f32 = 1e-12;

/// The sample that a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f32,
    pub image: usize,
    pub sample: usize,
}

impl Hit {
    /// The nearer of two; among equals the one with the lower numbers.
    fn is_before(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && (self.image, self.sample) < (other.image, other.sample))
    }
}

/// Quadtrees of all layers of all images.
pub struct Pyramids<'c> {
    trees: Vec<Trees<'c>>,
}

/// The quadtrees of one image's layers.
struct Trees<'c> {
    number: usize,
    image: &'c LayeredDepthImage,
    forward_in_world: Vec3,
    /// From single texels, whose nodes are the samples, to one place for the whole image.
    levels: Vec<Level>,
}

/// A place in a quadtree, and the layer from which on it is searched.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// The level, from 0 for single texels.
    height: usize,
    place: UVec2,
    layer: usize,
}

/// The nodes of one size.
struct Level {
    size: UVec2,
    /// The number of the first node of each place, and at last the number of nodes.
    first: Vec<u32>,
    /// The least depth that the samples of this and of all deeper layers accept, and the greatest that those of this layer accept.
    reach: Vec<[f32; 2]>,
}

/// A ray among the lines of an image: columns, rows and depth.
struct ImageRay {
    origin: Vec3,
    direction: Vec3,
    /// The front of a surface faces this direction by a negative product.
    direction_in_world: Vec3,
    near: f32,
}

impl<'c> Pyramids<'c> {
    pub fn new(images: &'c [LayeredDepthImage]) -> Self {
        Self { trees: images.iter().enumerate().map(|(number, image)| Trees::new(number, image)).collect() }
    }

    /// The nearest sample that faces the ray and whose depth is within ε of the ray's over its texel, from `near` on. Images follow
    /// one another, bounded by the best hit so far. Gives also the nodes and samples that were read.
    pub fn trace(&self, ray: Ray, near: f32) -> (Option<Hit>, usize) {
        let mut best = None;
        let mut loads = 0;
        for trees in &self.trees {
            let ray = ImageRay::new(&trees.image.camera, ray, near);
            let root = Node { height: trees.levels.len() - 1, place: UVec2::ZERO, layer: 0 };
            trees.traverse(&ray, root, &mut best, &mut loads);
        }
        (best, loads)
    }
}

impl<'c> Trees<'c> {
    fn new(number: usize, image: &'c LayeredDepthImage) -> Self {
        let first = image.first.clone();
        let size = image.camera.size_px;
        let forward_in_world = image.camera.axes_in_world()[2];
        let mut trees = Self { number, image, forward_in_world, levels: Vec::new() };
        let mut reach: Vec<[f32; 2]> = (0..image.sample_count()).map(|sample| trees.reach(sample)).collect();
        for line in 0..image.camera.pixel_count() {
            let deepest_first = image.line(line).rev();
            deepest_first.fold(f32::INFINITY, |least, sample| {
                reach[sample][0] = reach[sample][0].min(least);
                reach[sample][0]
            });
        }
        trees.levels.push(Level { size, first, reach });
        while let Some(above) = trees.levels.last().and_then(Level::above) {
            trees.levels.push(above);
        }
        trees
    }

    /// The depths of rays that a sample accepts.
    fn reach(&self, sample: usize) -> [f32; 2] {
        let cos = self.image.plane_normal_in_world(sample).dot(self.forward_in_world).abs().min(1.0);
        let slope = ((1.0 - cos * cos).sqrt() / cos).min(MAX_SLOPE);
        let depth = self.depth(sample);
        // ε is half a texel at the slope of the sample's surface.
        let epsilon = 0.5 * slope;
        [depth - epsilon, depth + epsilon]
    }

    fn depth(&self, sample: usize) -> f32 {
        self.image.planar_depth_m[sample] / self.image.camera.spacing_m
    }

    /// The paper's `Traverse`, from a layer of a place on.
    fn traverse(&self, ray: &ImageRay, from: Node, best: &mut Option<Hit>, loads: &mut usize) {
        let Node { height, place, layer } = from;
        let level = &self.levels[height];
        let nodes = level.nodes(place);
        let Some(along) = ray.over(height, place).filter(|_| layer < nodes.len()) else { return };
        if best.is_some_and(|best| along[0] > best.t) {
            return;
        }
        let [z_in, z_out] = ray.depths(along);
        for node in nodes.start + layer..nodes.end {
            *loads += 1;
            let [least, greatest] = level.reach[node];
            if z_out < least {
                return;
            }
            if z_in > greatest {
                continue;
            }
            if height == 0 {
                self.offer(ray, node, along, best);
            } else {
                for corner in ray.corners() {
                    let below = Node { height: height - 1, place: place * 2 + corner, layer: node - nodes.start };
                    self.traverse(ray, below, best, loads);
                }
                return;
            }
        }
    }

    /// Takes a sample of a texel if it is a hit before the best one.
    fn offer(&self, ray: &ImageRay, sample: usize, along: [f32; 2], best: &mut Option<Hit>) {
        let [z_in, z_out] = ray.depths(along);
        let [least, greatest] = self.reach(sample);
        let is_met = z_in <= greatest && least <= z_out;
        if !is_met || self.image.plane_normal_in_world(sample).dot(ray.direction_in_world) >= 0.0 {
            return;
        }
        // Where the ray has the sample's depth, or else where it is nearest to it in the texel. No bound of `max` is NaN.
        let t = (self.depth(sample) - ray.origin.z) / ray.direction.z;
        let hit = Hit { t: t.max(along[0]).min(along[1]), image: self.number, sample };
        if best.is_none_or(|best| hit.is_before(&best)) {
            *best = Some(hit);
        }
    }
}

impl Level {
    /// The nodes of a place, one for each layer; none outside.
    fn nodes(&self, place: UVec2) -> Range<usize> {
        if place.cmpge(self.size).any() {
            return 0..0;
        }
        let at = (place.y * self.size.x + place.x) as usize;
        self.first[at] as usize..self.first[at + 1] as usize
    }

    /// The level of nodes that are twice as wide; `None` above one node.
    fn above(&self) -> Option<Self> {
        let size = (self.size + 1) / 2;
        if self.size.max_element() == 1 {
            return None;
        }
        let mut first = vec![0];
        let mut reach = Vec::new();
        for place in (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))) {
            let below = CORNERS.map(|corner| self.nodes(place * 2 + corner));
            for layer in 0..below.iter().map(Range::len).max().unwrap_or(0) {
                let nodes =
                    below.iter().filter(|nodes| layer < nodes.len()).map(|nodes| self.reach[nodes.start + layer]);
                let none = [f32::INFINITY, f32::NEG_INFINITY];
                reach.push(nodes.fold(none, |all, own| [all[0].min(own[0]), all[1].max(own[1])]));
            }
            first.push(reach.len() as u32);
        }
        Some(Self { size, first, reach })
    }
}

const CORNERS: [UVec2; 4] = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE];

impl ImageRay {
    fn new(camera: &ParallelCamera, ray: Ray, near: f32) -> Self {
        let axes = camera.axes_in_world();
        let [origin, direction] = [ray.origin_in_world - camera.corner_in_world, ray.direction_in_world]
            .map(|v| Vec3::from(axes.map(|axis| axis.dot(v) / camera.spacing_m)));
        let [x, y] = [direction.x, direction.y].map(|v| if v.abs() < LEAST_LEAN { LEAST_LEAN } else { v });
        Self { origin, direction: Vec3::new(x, y, direction.z), direction_in_world: ray.direction_in_world, near }
    }

    /// The ray's parameters where it is within a node's columns and rows.
    fn over(&self, height: usize, place: UVec2) -> Option<[f32; 2]> {
        let edges = [place << height as u32, (place + 1) << height as u32];
        let [a, b] = edges.map(|edge| (edge.as_vec2() - self.origin.truncate()) / self.direction.truncate());
        let t_in = a.min(b).max_element().max(self.near);
        let t_out = a.max(b).min_element();
        (t_in <= t_out).then_some([t_in, t_out])
    }

    /// The least and the greatest depth between two parameters. The paper assumes that depth rises along the ray.
    fn depths(&self, along: [f32; 2]) -> [f32; 2] {
        let [a, b] = along.map(|t| self.origin.z + self.direction.z * t);
        [a.min(b), a.max(b)]
    }

    /// The children of a node in the order in which the ray meets them.
    fn corners(&self) -> [UVec2; 4] {
        let flip = UVec2::new(u32::from(self.direction.x < 0.0), u32::from(self.direction.y < 0.0));
        CORNERS.map(|corner| corner ^ flip)
    }
}

#[cfg(test)]
pub mod tests {
    use depth_image::oct8_from_unit;
    use glam::{Quat, Vec2};

    use super::*;

    /// An image with these depths and normals on each line, which looks along -Z.
    pub fn image(size_px: UVec2, layers: impl Fn(Vec2) -> Vec<(f32, Vec3)>) -> LayeredDepthImage {
        let camera = ParallelCamera {
            corner_in_world: Vec3::new(-2.0, 1.5, 2.0),
            world_from_camera: Quat::IDENTITY,
            spacing_m: 4.0 / size_px.x as f32,
            size_px,
            range_m: 10.0,
        };
        let places = (0..size_px.y).flat_map(|y| (0..size_px.x).map(move |x| Vec2::new(x as f32, y as f32) + 0.5));
        let lines: Vec<Vec<(f32, Vec3)>> = places.map(layers).collect();
        let samples: Vec<(f32, Vec3)> = lines.iter().flatten().copied().collect();
        let ends = lines.iter().scan(0, |end, line| {
            *end += line.len() as u32;
            Some(*end)
        });
        LayeredDepthImage {
            camera,
            first: [0].into_iter().chain(ends).collect(),
            planar_depth_m: samples.iter().map(|(depth_m, _)| *depth_m).collect(),
            plane_normal_oct8: samples.iter().map(|(_, normal)| oct8_from_unit(*normal)).collect(),
            color_rgb9e5: vec![0; samples.len()],
            normal_oct16: None,
            specular: None,
            truncated: false,
        }
    }

    /// From 0 to 1, without order.
    fn noise(number: usize) -> f32 {
        (number as f32 * 0.618_034 + (number as f32).sin() * 43.758).fract().abs()
    }

    fn noisy(size_px: UVec2) -> LayeredDepthImage {
        image(size_px, |at| {
            let number = (at.x * 71.0 + at.y * 1009.0) as usize;
            let layer = |layer: usize| {
                let [x, y] = [1, 2].map(|part| noise(number + 13 * layer + part) * 4.0 - 2.0);
                (1.0 + layer as f32 * 0.7 + 0.6 * noise(number + layer), Vec3::new(x, y, 0.3).normalize_or_zero())
            };
            (0..(noise(number) * 5.0) as usize).map(layer).collect()
        })
    }

    fn ray(number: usize) -> Ray {
        let at = |from: usize| Vec3::from([0, 1, 2].map(|part| noise(number * 6 + from + part) - 0.5));
        let towards = match number % 5 {
            0 => Vec3::NEG_Z,
            1 => Vec3::X,
            _ => at(3) * Vec3::new(4.0, 3.0, 4.0),
        };
        let eye = if number.is_multiple_of(5) { at(0) * 3.0 + Vec3::Z * 3.0 } else { at(0) * 12.0 };
        Ray { origin_in_world: eye, direction_in_world: if number % 5 < 2 { towards } else { towards - eye } }
    }

    #[test]
    fn quadtrees_find_what_every_texel_of_the_way_holds() {
        let images = [noisy(UVec2::new(37, 29)), noisy(UVec2::new(16, 1))];
        let pyramids = Pyramids::new(&images);
        let mut hits = 0;
        for ray in (0..2000).map(ray) {
            let mut best = None;
            for trees in &pyramids.trees {
                let size = trees.image.camera.size_px;
                let in_image = ImageRay::new(&trees.image.camera, ray, 0.1);
                for place in (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))) {
                    let along = in_image.over(0, place);
                    let samples = trees.image.line((place.y * size.x + place.x) as usize);
                    along.into_iter().for_each(|along| {
                        samples.clone().for_each(|sample| trees.offer(&in_image, sample, along, &mut best))
                    });
                }
            }
            assert_eq!(pyramids.trace(ray, 0.1).0, best, "{ray:?}");
            hits += usize::from(best.is_some());
        }
        assert!((400..1900).contains(&hits), "{hits}");
    }

    #[test]
    fn a_slab_that_faces_the_eye_is_met_at_its_depth() {
        let images = [image(UVec2::new(32, 24), |_| vec![(4.0, Vec3::Z), (6.0, Vec3::Z)])];
        let pyramids = Pyramids::new(&images);
        for at in (0..50).map(|number| (Vec2::new(noise(number), noise(number + 99)) - 0.5) * 0.58) {
            let towards = Vec3::new(at.x, at.y, -1.0);
            let ray = Ray { origin_in_world: Vec3::Z * 3.0, direction_in_world: towards * 0.5 };
            let (hit, loads) = pyramids.trace(ray, 0.01);
            assert_eq!(hit.map(|hit| hit.t), Some(10.0), "{at}");
            assert!(loads < 60, "{loads}");
            let from_behind = Ray { origin_in_world: Vec3::NEG_Z * 9.0, direction_in_world: -towards };
            assert_eq!(pyramids.trace(from_behind, 0.01).0, None);
        }
    }
}
