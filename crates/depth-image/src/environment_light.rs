//! What an environment map is as a light: its bright texels, which rays sample, and its means over lobes.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3};

use crate::environment_map::direction_at;
use crate::{EnvironmentMap, rgb9e5_from_linear};

/// Columns and rows of a [lobe's](Lobe) means.
pub const LOBE_SIZE_PX: UVec2 = UVec2::new(96, 48);
/// The roughness of the surfaces whose lobes the mirrored map is averaged over; between them, means are interpolated, and
/// below the first, between it and the map.
pub const LOBE_ROUGHNESS: [f32; 5] = [0.2, 0.35, 0.5, 0.75, 1.0];
/// Parts of texels above this many times the base's mean luminance are bright. Rays over a cosine lobe never meet more of the
/// rest than this, so that its noise is bounded.
const BRIGHT_MEANS: f64 = 4.0;
/// Above every luminance of RGB9E5.
const NO_LIMIT: f32 = 1e9;
/// The limit falls from step to step; at most a quarter of all directions is above it after any.
const LIMIT_STEPS: usize = 4;
/// Rec. 709.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// A mean of the map over lobes around each direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lobe {
    /// GGX around the mirror direction, for the n-th of [`LOBE_ROUGHNESS`].
    Mirror(usize),
    /// The cosine lobe: what a white surface reflects.
    Diffuse,
    /// The cosine lobe, without the bright texels' excess.
    DiffuseBase,
}

/// A texel that is sampled as a lamp. The layout is that of `bright_texels` in environment.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct BrightTexel {
    /// The share of the bright power in this texel and those before it; the last's is 1.
    pub cumulated_share: f32,
    /// Column in the low half, row in the high half.
    pub place: u32,
    /// Radiance over luminance, in RGB9E5.
    pub chroma_rgb9e5: u32,
    /// Zero.
    pub padding: u32,
}

/// An environment map as a light: *bright* is the part of each texel's luminance above a limit, *base* is the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentLight {
    /// In the order of a Z curve, so that neighbours in the list are neighbours in the map. Rays to bright texels take
    /// stratified points for shares, and stay stratified.
    pub bright_texels: Vec<BrightTexel>,
    /// The irradiance of all bright luminance on surfaces that face it, in the unit of
    /// [`Illumination`](crate::Illumination): with the reflectance's 1/π.
    pub bright_irradiance: f32,
    /// The greatest luminance of the base.
    pub base_limit: f32,
    /// [`Lobe`] after lobe, row by row: means of radiance, linear RGB, and 0.
    pub lobes: Vec<[f32; 4]>,
}

impl Lobe {
    /// The place of the lobe among all.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::Mirror(number) => number,
            Self::Diffuse => LOBE_ROUGHNESS.len(),
            Self::DiffuseBase => LOBE_ROUGHNESS.len() + 1,
        }
    }
}

const LOBES: usize = LOBE_ROUGHNESS.len() + 2;

impl EnvironmentLight {
    /// Splits a map and averages it over lobes.
    #[must_use]
    pub fn of(map: &EnvironmentMap) -> Self {
        let limit = base_limit(map);
        let (bright_texels, bright_irradiance) = bright_texels(map, limit);
        // Without bright texels all is base, whatever its rounding.
        let base_limit = if bright_texels.is_empty() { NO_LIMIT } else { limit };
        Self { bright_texels, bright_irradiance, base_limit, lobes: lobes(&cells(map, base_limit)) }
    }
}

/// The part of a radiance whose luminance is within the limit.
pub(crate) fn base_of(radiance_linear: Vec3, base_limit: f32) -> Vec3 {
    radiance_linear * (base_limit / radiance_linear.dot(LUMINANCE).max(1e-9)).min(1.0)
}

/// The limit of the base, relative to the mean of the base itself: a sun does not raise it.
fn base_limit(map: &EnvironmentMap) -> f32 {
    (0..LIMIT_STEPS).fold(NO_LIMIT, |limit, _| (BRIGHT_MEANS * mean_luminance(map, limit)) as f32)
}

/// The mean over all directions, of luminance up to a limit.
fn mean_luminance(map: &EnvironmentMap, limit: f32) -> f64 {
    let [columns, rows] = map.size_px().to_array();
    let sums = (0..rows).map(|row| {
        let luminances = (0..columns).map(|column| f64::from(map.texel_linear(column, row).dot(LUMINANCE).min(limit)));
        luminances.sum::<f64>() * f64::from(map.solid_angle_sr(row))
    });
    sums.sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// The texels above the limit with their shares, and their irradiance together.
fn bright_texels(map: &EnvironmentMap, limit: f32) -> (Vec<BrightTexel>, f32) {
    let size_px = map.size_px();
    let mut found = Vec::new();
    for row in 0..size_px.y {
        let solid_angle_sr = map.solid_angle_sr(row);
        for column in 0..size_px.x {
            let radiance = map.texel_linear(column, row);
            let luminance = radiance.dot(LUMINANCE);
            if luminance > limit {
                found.push((column | row << 16, radiance / luminance, f64::from((luminance - limit) * solid_angle_sr)));
            }
        }
    }
    found.sort_by_key(|&(place, ..)| z_order(place));
    let all: f64 = found.iter().map(|&(.., power)| power).sum();
    let mut before = 0.0;
    let listed = found.into_iter().map(|(place, chroma, power)| {
        before += power;
        let cumulated_share = (before / all) as f32;
        BrightTexel { cumulated_share, place, chroma_rgb9e5: rgb9e5_from_linear(chroma), padding: 0 }
    });
    let mut listed: Vec<BrightTexel> = listed.collect();
    if let Some(last) = listed.last_mut() {
        last.cumulated_share = 1.0;
    }
    (listed, (all / std::f64::consts::PI) as f32)
}

/// The bits of column and row of a place, interleaved.
fn z_order(place: u32) -> u32 {
    let halves = [place & 0xffff, place >> 16];
    let [column, row] = halves.map(|half| (0..16).fold(0, |bits, i| bits | (half >> i & 1) << (2 * i)));
    column | row << 1
}

/// The light of some texels of the map, as if it came from one direction.
#[derive(Clone, Default)]
struct Cell {
    towards_in_world: Vec3,
    solid_angle_sr: f32,
    /// Radiance times solid angle: of all, and of the base.
    all_linear: Vec3,
    base_linear: Vec3,
}

/// The map in cells of [`LOBE_SIZE_PX`]. A cell's direction is the mean of its texels', weighted by luminance, so that a
/// small sun keeps its place.
fn cells(map: &EnvironmentMap, base_limit: f32) -> Vec<Cell> {
    let mut cells = vec![Cell::default(); LOBE_SIZE_PX.element_product() as usize];
    // Texels of a small map are cut, so that each cell has some.
    let size_px = map.size_px();
    let parts = (LOBE_SIZE_PX + size_px - 1) / size_px;
    let fine = size_px * parts;
    for y in 0..fine.y {
        let row = y / parts.y;
        let solid_angle_sr = map.solid_angle_sr(row) / parts.element_product() as f32;
        for x in 0..fine.x {
            let radiance = map.texel_linear(x / parts.x, row);
            let towards = direction_at((Vec2::new(x as f32, y as f32) + 0.5) / fine.as_vec2());
            let at = UVec2::new(x, y) * LOBE_SIZE_PX / fine;
            let cell = &mut cells[(at.y * LOBE_SIZE_PX.x + at.x) as usize];
            cell.towards_in_world += towards * (solid_angle_sr * radiance.dot(LUMINANCE).max(1e-9));
            cell.solid_angle_sr += solid_angle_sr;
            cell.all_linear += radiance * solid_angle_sr;
            cell.base_linear += base_of(radiance, base_limit) * solid_angle_sr;
        }
    }
    cells.iter_mut().for_each(|cell| cell.towards_in_world = cell.towards_in_world.normalize_or(Vec3::Y));
    cells
}

/// The cells' means over each lobe around each direction.
fn lobes(cells: &[Cell]) -> Vec<[f32; 4]> {
    let alpha_squared = LOBE_ROUGHNESS.map(|roughness| roughness.powi(4));
    let directions = LOBE_SIZE_PX.element_product() as usize;
    let mut lobes = vec![[0.0; 4]; LOBES * directions];
    for place in 0..directions {
        let at = UVec2::new(place as u32 % LOBE_SIZE_PX.x, place as u32 / LOBE_SIZE_PX.x);
        let middle = direction_at((at.as_vec2() + 0.5) / LOBE_SIZE_PX.as_vec2());
        let mut sums = [Vec3::ZERO; LOBES];
        let mut weights = [0.0f32; LOBES];
        for cell in cells {
            let cosine = middle.dot(cell.towards_in_world);
            if cosine <= 0.0 {
                continue;
            }
            for (lobe, squared) in alpha_squared.iter().enumerate() {
                // Trowbridge-Reitz of the half-way vector, whose angle is half as great; eye and normal are the middle.
                let spread = 1.0 - 0.5 * (1.0 + cosine) * (1.0 - squared);
                let weight = cosine * squared / (spread * spread);
                sums[lobe] += cell.all_linear * weight;
                weights[lobe] += cell.solid_angle_sr * weight;
            }
            let [diffuse, base] = [Lobe::Diffuse, Lobe::DiffuseBase].map(Lobe::index);
            sums[diffuse] += cell.all_linear * cosine;
            sums[base] += cell.base_linear * cosine;
            weights[diffuse] += cell.solid_angle_sr * cosine;
            weights[base] += cell.solid_angle_sr * cosine;
        }
        for lobe in 0..LOBES {
            lobes[lobe * directions + place] = (sums[lobe] / weights[lobe].max(1e-20)).extend(0.0).to_array();
        }
    }
    lobes
}
