//! Tiles of a sample image, one above the other. Each has its own camera, and together they are the image.

use glam::UVec2;

use crate::{
    Camera, DepthImage, LayeredDepthImage, LayeredLightField, LightFieldCamera, LightPlanes, ParallelCamera,
    SampleCamera, SampleImageError, SpecularPlanes, ViewPart,
};

impl Camera {
    /// The camera of tile number `tile`, from the top, of `count`. With fewer rows than tiles, some tiles are empty.
    #[must_use]
    pub fn tile(&self, tile: u32, count: u32) -> Self {
        self.part(&part(self.size_px(), tile, count))
    }
}

impl SampleCamera {
    /// The camera of tile number `tile`, from the top, of `count`. With fewer rows than tiles, some tiles are empty.
    #[must_use]
    pub fn tile(&self, tile: u32, count: u32) -> Self {
        match self {
            Self::Depth(camera) => Self::Depth(camera.tile(tile, count)),
            Self::Layered(camera) => Self::Layered(camera.part(&part(camera.size_px, tile, count))),
            Self::LightField(camera) => Self::LightField(camera.part(&part(camera.size_px(), tile, count))),
        }
    }
}

/// The rows of a tile.
fn part(size_px: UVec2, tile: u32, count: u32) -> ViewPart {
    let [first, end] =
        [tile, tile + 1].map(|tile| (u64::from(tile) * u64::from(size_px.y) / u64::from(count.max(1))) as u32);
    ViewPart { first_px: UVec2::new(0, first), size_px: UVec2::new(size_px.x, end - first) }
}

impl LayeredDepthImage {
    /// Joins tiles, from the top, to one image.
    ///
    /// # Errors
    /// Tiles of other sizes, and planes that are not those of their lines.
    pub fn from_tiles(camera: ParallelCamera, tiles: &[Self]) -> Result<Self, SampleImageError> {
        for (number, tile) in tiles.iter().enumerate() {
            let expected = part(camera.size_px, number as u32, tiles.len() as u32).size_px;
            if tile.camera.size_px != expected {
                return Err(SampleImageError::TileLines { tile: number, given: tile.camera.size_px, expected });
            }
            tile.validate()?;
        }
        let specular = specular(tiles, Self::sample_count, |tile| tile.specular.as_ref());
        Ok(Self {
            camera,
            first: joined_lines(tiles.iter().map(|tile| &tile.first[..])),
            planar_depth_m: concat(tiles, |tile| &tile.planar_depth_m),
            plane_normal_oct8: concat(tiles, |tile| &tile.plane_normal_oct8),
            color_rgb9e5: concat(tiles, |tile| &tile.color_rgb9e5),
            normal_oct16: filled(tiles, Self::sample_count, |tile| tile.normal_oct16.as_deref()),
            specular: specular.ok_or(SampleImageError::MixedTiles)?,
            truncated: tiles.iter().any(|tile| tile.truncated),
        })
    }
}

impl LayeredLightField {
    /// Joins tiles, from the first pair of directions, to one light field.
    ///
    /// # Errors
    /// Tiles of other directions, and planes that are not those of their lines.
    pub fn from_tiles(camera: LightFieldCamera, tiles: &[Self]) -> Result<Self, SampleImageError> {
        let size_px = camera.size_px();
        for (number, tile) in tiles.iter().enumerate() {
            let expected = camera.part(&part(size_px, number as u32, tiles.len() as u32));
            if tile.camera != expected {
                return Err(SampleImageError::LightFieldTile { tile: number });
            }
            tile.validate()?;
        }
        Ok(Self {
            camera,
            first: joined_lines(tiles.iter().map(|tile| &tile.first[..])),
            planar_depth_m: concat(tiles, |tile| &tile.planar_depth_m),
            radiance_rgb9e5: concat(tiles, |tile| &tile.radiance_rgb9e5),
        })
    }
}

/// The prefix sums of the lines of all tiles.
fn joined_lines<'a>(tiles: impl Iterator<Item = &'a [u32]>) -> Vec<u32> {
    let mut joined = vec![0];
    for first in tiles {
        let before = joined[joined.len() - 1];
        joined.extend(first.iter().skip(1).map(|line| before + line));
    }
    joined
}

impl DepthImage {
    /// Joins tiles, from the top, to one image.
    ///
    /// # Errors
    /// Tiles of other sizes, and planes that only some of them have.
    pub fn from_tiles(camera: Camera, tiles: Vec<Self>) -> Result<Self, SampleImageError> {
        let count = tiles.len() as u32;
        for (number, tile) in tiles.iter().enumerate() {
            let expected = camera.tile(number as u32, count).size_px();
            if tile.size_px() != expected {
                return Err(SampleImageError::TileSize { tile: number, given: tile.size_px(), expected });
            }
            tile.validate().map_err(|source| SampleImageError::TilePlanes { tile: number, source: source.into() })?;
        }
        let corners = joined(&tiles, "corner_inverse_depth", |tile| tile.corner_inverse_depth_per_m.as_deref())?;
        let surface_id = joined(&tiles, "surface_id", |tile| tile.surface_id.as_deref())?;
        let specular = specular(&tiles, texel_count, |tile| tile.specular.as_ref());
        Ok(Self {
            camera,
            inverse_depth_per_m: concat(&tiles, |tile| &tile.inverse_depth_per_m),
            color_rgb9e5: concat(&tiles, |tile| &tile.color_rgb9e5),
            surface_id,
            normal_oct16: filled(&tiles, texel_count, |tile| tile.normal_oct16.as_deref()),
            passed: filled(&tiles, texel_count, |tile| tile.passed.as_deref()),
            specular: specular.ok_or(SampleImageError::MixedPlane { plane: "visibility" })?,
            corner_inverse_depth_per_m: corners.map(|_| shared_corners(&tiles)),
            light: light(&tiles)?,
        })
    }
}

/// Joins a plane that all tiles have.
fn concat<I, T: Copy>(tiles: &[I], plane: impl Fn(&I) -> &[T]) -> Vec<T> {
    tiles.iter().flat_map(|tile| plane(tile).iter().copied()).collect()
}

/// Joins a plane that either all tiles have, or none.
fn joined<T: Copy>(
    tiles: &[DepthImage],
    name: &'static str,
    plane: impl Fn(&DepthImage) -> Option<&[T]>,
) -> Result<Option<Vec<T>>, SampleImageError> {
    let have = tiles.iter().filter(|tile| plane(tile).is_some()).count();
    match have {
        0 => Ok(None),
        _ if have == tiles.len() => Ok(Some(tiles.iter().filter_map(&plane).flatten().copied().collect())),
        _ => Err(SampleImageError::MixedPlane { plane: name }),
    }
}

/// Joins a plane that a tile lacks where all of it would be zero.
fn filled<I, T: Copy + Default>(
    tiles: &[I],
    len: impl Fn(&I) -> usize,
    plane: impl Fn(&I) -> Option<&[T]>,
) -> Option<Vec<T>> {
    tiles.iter().any(|tile| plane(tile).is_some()).then(|| {
        let planes = tiles.iter().map(|tile| plane(tile).map_or_else(|| vec![T::default(); len(tile)], <[T]>::to_vec));
        planes.flatten().collect()
    })
}

fn texel_count(tile: &DepthImage) -> usize {
    tile.size_px().element_product() as usize
}

/// Joins the planes of light. No tile has colour beside another's light, and all have shares of the same lamps.
fn light(tiles: &[DepthImage]) -> Result<Option<LightPlanes>, SampleImageError> {
    let lights: Vec<&LightPlanes> = tiles.iter().filter_map(|tile| tile.light.as_ref()).collect();
    let Some(first) = lights.first() else { return Ok(None) };
    if lights.len() < tiles.len() {
        return Err(SampleImageError::MixedPlane { plane: "light" });
    }
    let share_count = first.share8.len();
    if lights.iter().any(|light| light.share8.len() != share_count) {
        return Err(SampleImageError::MixedPlane { plane: "share" });
    }
    Ok(Some(LightPlanes {
        triangle_normal_oct16: concat(&lights, |light| &light.triangle_normal_oct16),
        lamps_rgb9e5: concat(&lights, |light| &light.lamps_rgb9e5),
        environment_rgb9e5: concat(&lights, |light| &light.environment_rgb9e5),
        share8: (0..share_count).map(|number| concat(&lights, |light| &light.share8[number])).collect(),
    }))
}

/// Joins the inputs of highlights of tiles, whose lengths are known. A tile without highlights has no visibility either. `None` for
/// tiles of different lamps.
fn specular<I>(
    tiles: &[I],
    len: fn(&I) -> usize,
    specular: fn(&I) -> Option<&SpecularPlanes>,
) -> Option<Option<SpecularPlanes>> {
    let mut counts = tiles.iter().filter_map(specular).map(|specular| specular.visibility8.len());
    let Some(count) = counts.next() else { return Some(None) };
    if counts.any(|other| other != count) {
        return None;
    }
    let reflectance = filled(tiles, len, |tile| Some(specular(tile)?.reflectance_srgb8_roughness8.as_slice()));
    let visibilities =
        (0..count).filter_map(|plane| filled(tiles, len, |tile| Some(specular(tile)?.visibility8[plane].as_slice())));
    Some(Some(SpecularPlanes {
        reflectance_srgb8_roughness8: reflectance.unwrap_or_default(),
        visibility8: visibilities.collect(),
    }))
}

/// Joins the corners. Those between two tiles are in both; the lower tile's are used.
fn shared_corners(tiles: &[DepthImage]) -> Vec<f32> {
    let mut corners = Vec::new();
    for (number, tile) in tiles.iter().enumerate() {
        let rows = tile.size_px().y as usize + usize::from(number + 1 == tiles.len());
        let plane = tile.corner_inverse_depth_per_m.as_deref().unwrap_or_default();
        corners.extend_from_slice(&plane[..rows * (tile.size_px().x as usize + 1)]);
    }
    corners
}

#[cfg(test)]
#[path = "tiles_tests.rs"]
mod tests;
