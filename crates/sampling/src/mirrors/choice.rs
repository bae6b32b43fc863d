//! Which images surround a mirror: few that see all the way of rays off it.

use std::ops::Range;

use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use rayon::prelude::*;

use crate::impostors::{ImageLimits, Models};

use super::directions::{ASIDE, FACE_DEG, SIDE_PX, WIDE_DEG, looking};
use super::groups::Group;
use super::rays::{PLACES, Triangles, Way};
use super::resolution::mean_side_m;
use super::seen::{Images, Ways, seen_by, share_of_ways, strike};
use super::single_pole;

/// A mirror whose normals have a mean of this length is flat.
const FLAT: f32 = 0.9;
/// How far images lie from a flat mirror's middle, in half widths.
const FLAT_ASIDE: f32 = 0.5;
/// The middle and four corners.
const PLACES_OF_EYES: usize = 5;
/// Fewer rays do not choose.
const LEAST_RAYS: usize = 512;
/// So many images or more begin with those that are always taken.
const LEAST_FOR_FIRST: usize = 4;
/// The least texels of an image over those of its fair share: it proves the way to the sky to be free.
const LEAST_SHARE: f32 = 1.0 / 16.0;

/// Images, and the shares of rays that they do not see all the way: see [`super::Mirror`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Choice {
    pub cameras: Vec<Camera>,
    pub candidates: Vec<Candidate>,
    /// Of the rays by which they were chosen, and of as many others. `None` where rays did not choose.
    pub unseen_ratio: Option<[f32; 2]>,
    /// Where rays end, of images that are not asked for by number.
    pub texel_side_m: Option<f32>,
}

/// Images from which a choice is made, of equal texels together.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Candidate {
    /// As `--impostors` names it.
    pub name: String,
    /// The share of the deciding rays that it does not see all the way.
    pub unseen_ratio: f32,
    pub is_chosen: bool,
}

/// Chooses by the rays off half of the mirror's points; the others tell how good the choice is. Where few eyes see the mirror, or
/// where the scene has no tree for rays, the usual images are taken.
pub(super) fn choose(
    group: &Group,
    triangles: Option<&Triangles>,
    limits: ImageLimits,
    (middle_of_scene, near_m): (Vec3, f32),
) -> Choice {
    let pool = pool(group, middle_of_scene, near_m);
    let [deciding, fresh] = [0, 1].map(|first| {
        let points = group.points.iter().enumerate().skip(first).step_by(2);
        let way = |(number, point)| triangles?.way(point, number);
        points.filter_map(way).collect::<Vec<Way>>()
    });
    let Some(triangles) = triangles.filter(|_| deciding.len().min(fresh.len()) >= LEAST_RAYS) else {
        return pool.usual(limits.most);
    };
    let ways = Ways { triangles, deciding, fresh };
    let mut candidates = Vec::new();
    let pinholes = pool.choose(&ways, limits, &mut candidates);
    let bent = match limits.models {
        Models::Pinholes => Vec::new(),
        Models::All | Models::SinglePoles(_) => single_pole::candidates(group, &ways),
    };
    let ratio = |images: &Images| share_of_ways(&images.unseen);
    candidates.extend(bent.iter().map(|images| Candidate {
        name: format!("single_pole:{}", images.cameras.len()),
        unseen_ratio: ratio(images),
        is_chosen: false,
    }));
    // As few images as do; of as many, pinholes.
    let is_enough = |images: &Images| ratio(images) <= limits.unseen_ratio;
    let is_less = |images: &&Images| is_enough(images) && images.cameras.len() < pinholes.cameras.len();
    let bent = bent.iter().find(|images| match limits.models {
        Models::SinglePoles(wanted) => images.cameras.len() == wanted,
        Models::All | Models::Pinholes => is_less(images),
    });
    let chosen = bent.unwrap_or(&pinholes);
    if chosen.cameras.is_empty() {
        return pool.usual(limits.most);
    }
    mark(&mut candidates, chosen);
    let mut of_fresh = vec![true; ways.fresh.len() * PLACES];
    chosen.cameras.iter().for_each(|camera| strike(&mut of_fresh, &seen_by(camera, &ways.fresh, triangles)));
    let unseen_ratio = Some([&chosen.unseen, &of_fresh].map(|unseen| share_of_ways(unseen)));
    let is_free = limits.models == Models::All;
    let texel_side_m = is_free.then(|| mean_side_m(&chosen.cameras, &ways)).flatten();
    Choice { cameras: chosen.cameras.clone(), candidates, unseen_ratio, texel_side_m }
}

fn mark(candidates: &mut [Candidate], chosen: &Images) {
    let name = format!("{}:{}", chosen.cameras[0].model_name(), chosen.cameras.len());
    candidates.iter_mut().for_each(|candidate| candidate.is_chosen = candidate.name == name);
}

/// Adds to the first images the one that sees most places that none does yet, until the share of ways with an unseen place is
/// within the limit or there are as many images as may be. Gives the images and which places none of them sees; each step is a
/// candidate.
fn cover(
    seen: &[Vec<bool>],
    first: Vec<usize>,
    limits: ImageLimits,
    candidates: &mut Vec<Candidate>,
) -> (Vec<usize>, Vec<bool>) {
    let mut unseen = vec![true; seen[0].len()];
    let mut chosen = first;
    chosen.iter().for_each(|&camera| strike(&mut unseen, &seen[camera]));
    let candidate = |chosen: &[usize], unseen: &[bool]| Candidate {
        name: format!("pinhole:{}", chosen.len()),
        unseen_ratio: share_of_ways(unseen),
        is_chosen: false,
    };
    candidates.extend((!chosen.is_empty()).then(|| candidate(&chosen, &unseen)));
    while chosen.len() < limits.most && (chosen.is_empty() || share_of_ways(&unseen) > limits.unseen_ratio) {
        let new = |camera: &usize| seen[*camera].iter().zip(&unseen).filter(|(seen, is)| **seen && **is).count();
        // Of equals the first.
        let best = (0..seen.len()).rev().max_by_key(new).filter(|best| new(best) > 0);
        let Some(best) = best else { break };
        strike(&mut unseen, &seen[best]);
        chosen.push(best);
        candidates.push(candidate(&chosen, &unseen));
    }
    (chosen, unseen)
}

/// Images to choose from.
struct Pool {
    cameras: Vec<PinholeCamera>,
    /// Those that are always taken.
    first: Range<usize>,
    /// Those that are taken where rays do not choose.
    usual: Vec<usize>,
}

impl Pool {
    fn usual(&self, most: usize) -> Choice {
        let cameras = self.usual.iter().take(most).map(|&camera| self.cameras[camera].into()).collect();
        Choice { cameras, candidates: Vec::new(), unseen_ratio: None, texel_side_m: None }
    }

    /// As few images as the limits allow.
    fn choose(&self, ways: &Ways<'_>, limits: ImageLimits, candidates: &mut Vec<Candidate>) -> Images {
        let seen = |camera: &PinholeCamera| seen_by(&(*camera).into(), &ways.deciding, ways.triangles);
        let seen: Vec<Vec<bool>> = self.cameras.par_iter().map(seen).collect();
        let first = if limits.most >= LEAST_FOR_FIRST { self.first.clone().collect() } else { Vec::new() };
        let (chosen, unseen) = cover(&seen, first, limits, candidates);
        let cameras: Vec<PinholeCamera> = chosen.iter().map(|&camera| self.cameras[camera]).collect();
        let of_chosen: Vec<&[bool]> = chosen.iter().map(|&camera| seen[camera].as_slice()).collect();
        let cameras = sized(&cameras, &of_chosen, &ways.deciding).into_iter().map(Camera::from).collect();
        Images { cameras, unseen }
    }
}

/// Images in many directions from five places on a flat mirror, or within another. Narrow ones come first: of equals the denser
/// one is taken.
fn pool(group: &Group, middle_of_scene: Vec3, near_m: f32) -> Pool {
    let (middle, half) = (group.bounds.center(), 0.5 * group.bounds.size());
    let facing = group.area_normal_m2 / (group.area_m2 as f32).max(f32::MIN_POSITIVE);
    let wide = |eye: Vec3, towards: Vec3| looking((eye, near_m), towards, WIDE_DEG, UVec2::splat(SIDE_PX as u32));
    let face = |eye: Vec3, towards: Vec3| looking((eye, near_m), towards, FACE_DEG, UVec2::splat(SIDE_PX as u32));
    if facing.length() > FLAT {
        let facing = facing.normalize_or(Vec3::Y);
        let right = facing.any_orthonormal_vector();
        // From the middle to the border of the mirror, which lies in its own plane however it is turned.
        let [right, up] = [right, facing.cross(right)].map(|axis| axis * half.dot(axis.abs()));
        let places = places(middle, [right * FLAT_ASIDE, up * FLAT_ASIDE]);
        let along = [right, -right, up, -up].map(|along| face(middle, along.normalize_or(facing)));
        let cameras: Vec<PinholeCamera> = places.map(|eye| wide(eye, facing)).into_iter().chain(along).collect();
        return Pool { usual: (1..cameras.len()).collect(), cameras, first: 0..0 };
    }
    let aside_m = ASIDE * half.min_element();
    let axes = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let towards = (middle_of_scene - middle).normalize_or(Vec3::Z);
    let from = |towards: Vec3| {
        let right = towards.any_orthonormal_vector();
        places(middle, [right * aside_m, right.cross(towards) * aside_m])
    };
    let faces = axes.flat_map(|axis| from(axis).map(|eye| face(eye, axis)));
    let cameras: Vec<PinholeCamera> = faces.chain(from(towards).map(|eye| wide(eye, towards))).collect();
    // Two from opposite sides: what one sees past an edge, the other sees as well, so that the edge lies where it is.
    let first = cameras.len() - 4..cameras.len() - 2;
    // From the middle to all sides, and these two.
    let usual = (0..6).map(|axis| axis * PLACES_OF_EYES).chain(first.clone()).collect();
    Pool { cameras, first, usual }
}

/// The middle and four corners around it.
fn places(middle: Vec3, [right, up]: [Vec3; 2]) -> [Vec3; PLACES_OF_EYES] {
    [middle, middle - right - up, middle + right + up, middle + right - up, middle - right + up]
}

/// Shares texels by how many ends at surfaces each image shows, together with others or alone: n ∝ h to the power 2/3, which
/// makes the mean side of their texels least.
fn sized(cameras: &[PinholeCamera], seen: &[&[bool]], ways: &[Way]) -> Vec<PinholeCamera> {
    let mut shown = vec![0.0; cameras.len()];
    for (number, _) in ways.iter().enumerate().filter(|(_, way)| way.ends_at_surface) {
        let shows = |camera: &usize| seen[*camera][(number + 1) * PLACES - 1];
        let of = (0..cameras.len()).filter(shows).count() as f32;
        (0..cameras.len()).filter(shows).for_each(|camera| shown[camera] += 1.0 / of);
    }
    let wanted: Vec<f32> = shown.iter().map(|shown| shown.powf(2.0 / 3.0)).collect();
    let least = LEAST_SHARE * wanted.iter().sum::<f32>() / cameras.len() as f32;
    let texels: Vec<f32> = wanted.iter().map(|texels| texels.max(least)).collect();
    let most = texels.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let sized = |(camera, texels): (&PinholeCamera, &f32)| {
        camera.resized(UVec2::splat((SIDE_PX * (texels / most).sqrt()).round().max(2.0) as u32))
    };
    cameras.iter().zip(&texels).map(sized).collect()
}
