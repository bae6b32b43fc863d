use glam::Vec3;

use super::*;
use crate::PinholeCamera;

fn camera() -> Camera {
    Camera::Pinhole(PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.9, UVec2::new(7, 11)))
}

/// Every texel encodes its ray, so that a test detects a row in the wrong place.
fn image(camera: Camera) -> DepthImage {
    let texels = |size: UVec2| (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)));
    let encoded = |texel: UVec2| {
        let direction = camera.ray(texel.as_vec2() + 0.5).direction_in_world;
        (direction.dot(Vec3::new(3.0, 5.0, 7.0)) * 1000.0).round()
    };
    let corner =
        |texel: UVec2| (camera.ray(texel.as_vec2()).direction_in_world.dot(Vec3::new(3.0, 5.0, 7.0)) * 1000.0).round();
    let plane: Vec<f32> = texels(camera.size_px()).map(encoded).collect();
    DepthImage {
        camera,
        inverse_depth_per_m: plane.clone(),
        color_rgb9e5: plane.iter().map(|v| v.to_bits()).collect(),
        normal_oct16: Some(plane.iter().map(|v| v.to_bits() ^ 1).collect()),
        surface_id: None,
        specular: Some(SpecularPlanes {
            reflectance_srgb8_roughness8: plane.iter().map(|v| v.to_bits() ^ 2).collect(),
            visibility8: vec![plane.iter().map(|v| v.to_bits() ^ 3).collect(); 2],
        }),
        passed: Some(plane.iter().map(|v| v.to_bits() & 1 == 1).collect()),
        corner_inverse_depth_per_m: Some(texels(camera.size_px() + 1).map(corner).collect()),
        light: None,
    }
}

/// An image with light in place of colour, whose texels encode their rays, too.
fn lit_image(camera: Camera) -> DepthImage {
    let image = image(camera);
    let plane = |mask: u32| image.color_rgb9e5.iter().map(|word| word ^ mask).collect::<Vec<_>>();
    let light = LightPlanes {
        triangle_normal_oct16: plane(4),
        lamps_rgb9e5: plane(5),
        environment_rgb9e5: plane(6),
        share8: vec![plane(7), plane(8)],
    };
    DepthImage {
        color_rgb9e5: Vec::new(),
        specular: None,
        corner_inverse_depth_per_m: None,
        light: Some(light),
        ..image
    }
}

#[test]
fn joined_tiles_with_light_equal_the_image() {
    let whole = lit_image(camera());
    for count in 1..=11 {
        let tiles: Vec<_> = (0..count).map(|tile| lit_image(camera().tile(tile, count))).collect();
        assert_eq!(DepthImage::from_tiles(camera(), tiles).expect("they fit"), whole, "{count} tiles");
    }
}

#[test]
fn tiles_that_mix_light_and_colour_or_numbers_of_lamps_are_refused() {
    let tiles = || (0..3).map(|tile| lit_image(camera().tile(tile, 3))).collect::<Vec<_>>();
    let mut mixed = tiles();
    mixed[1] = image(camera().tile(1, 3));
    mixed[1].corner_inverse_depth_per_m = None;
    assert_eq!(DepthImage::from_tiles(camera(), mixed), Err(SampleImageError::MixedPlane { plane: "light" }));
    let mut of_fewer_lamps = tiles();
    of_fewer_lamps[2].light.as_mut().unwrap().share8.pop();
    assert_eq!(DepthImage::from_tiles(camera(), of_fewer_lamps), Err(SampleImageError::MixedPlane { plane: "share" }));
    let mut broken = tiles();
    broken[1].light.as_mut().unwrap().lamps_rgb9e5.pop();
    assert!(matches!(DepthImage::from_tiles(camera(), broken), Err(SampleImageError::TilePlanes { tile: 1, .. })));
}

#[test]
fn joined_tiles_equal_the_image() {
    let whole = image(camera());
    for count in 1..=11 {
        let tiles: Vec<_> = (0..count).map(|tile| image(camera().tile(tile, count))).collect();
        assert!(tiles.iter().all(|tile| tile.size_px().y >= 11 / count));
        assert_eq!(DepthImage::from_tiles(camera(), tiles).expect("they fit"), whole, "{count} tiles");
    }
}

#[test]
fn a_tile_without_highlights_joins_as_zeros() {
    let mut tiles: Vec<_> = (0..2).map(|tile| image(camera().tile(tile, 2))).collect();
    (tiles[0].specular, tiles[0].passed) = (None, None);
    let joined = DepthImage::from_tiles(camera(), tiles).expect("they fit");
    let specular = joined.specular.expect("one tile has it");
    assert!(specular.reflectance_srgb8_roughness8[..35].iter().all(|&r| r == 0));
    assert!(specular.reflectance_srgb8_roughness8[35..].iter().all(|&r| r != 0));
    assert!(specular.visibility8.iter().all(|plane| plane.len() == 77));
    assert_eq!(joined.passed.expect("one tile has it").len(), 77);
}

#[test]
fn tiles_that_do_not_fit_are_refused_by_number() {
    let tiles = || (0..3).map(|tile| image(camera().tile(tile, 3))).collect::<Vec<_>>();
    let mut swapped = tiles();
    swapped.swap(0, 2);
    assert!(matches!(DepthImage::from_tiles(camera(), swapped), Err(SampleImageError::TileSize { tile: 0, .. })));
    let mut broken = tiles();
    broken[1].color_rgb9e5.pop();
    assert!(matches!(DepthImage::from_tiles(camera(), broken), Err(SampleImageError::TilePlanes { tile: 1, .. })));
    let mut mixed = tiles();
    mixed[2].corner_inverse_depth_per_m = None;
    assert!(matches!(DepthImage::from_tiles(camera(), mixed), Err(SampleImageError::MixedPlane { .. })));
}

/// Lines of one to three samples, each of which encodes its line.
fn layered(camera: ParallelCamera) -> LayeredDepthImage {
    let line = |row: u32, column: u32| {
        let ray = camera.ray(UVec2::new(column, row).as_vec2() + 0.5);
        (ray.origin_in_world.dot(Vec3::new(3.0, 5.0, 7.0)) * 1000.0).round() as u32
    };
    let lines: Vec<u32> =
        (0..camera.size_px.y).flat_map(|row| (0..camera.size_px.x).map(move |column| line(row, column))).collect();
    let count = |line: &u32| line % 3 + 1;
    let samples: Vec<u32> = lines.iter().flat_map(|line| (0..count(line)).map(move |layer| 8 * line + layer)).collect();
    let first = lines.iter().scan(0, |next, line| Some(std::mem::replace(next, *next + count(line))));
    LayeredDepthImage {
        camera,
        first: first.chain([samples.len() as u32]).collect(),
        planar_depth_m: samples.iter().map(|sample| (sample % 8) as f32).collect(),
        plane_normal_oct8: samples.iter().map(|&sample| sample as u16).collect(),
        color_rgb9e5: samples.clone(),
        normal_oct16: Some(samples.iter().map(|sample| sample ^ 1).collect()),
        specular: Some(SpecularPlanes {
            reflectance_srgb8_roughness8: samples.iter().map(|sample| sample ^ 2).collect(),
            visibility8: vec![samples; 2],
        }),
        truncated: false,
    }
}

fn parallel_camera() -> ParallelCamera {
    ParallelCamera {
        corner_in_world: Vec3::splat(20.0),
        world_from_camera: glam::Quat::IDENTITY,
        spacing_m: 0.25,
        size_px: UVec2::new(5, 9),
        range_m: 4.0,
    }
}

fn layered_tiles(count: u32) -> Vec<LayeredDepthImage> {
    let tile = |tile| *SampleCamera::Layered(parallel_camera()).tile(tile, count).layered().unwrap();
    (0..count).map(|number| layered(tile(number))).collect()
}

#[test]
fn joined_tiles_equal_the_layered_image() {
    let whole = layered(parallel_camera());
    for count in 1..=9 {
        let joined = LayeredDepthImage::from_tiles(parallel_camera(), &layered_tiles(count)).unwrap();
        assert_eq!((joined.validate(), joined), (Ok(()), whole.clone()), "{count} tiles");
    }
}

#[test]
fn layered_tiles_that_do_not_fit_are_refused_and_missing_highlights_are_zeros() {
    let mut swapped = layered_tiles(4);
    swapped.swap(0, 3);
    let joined = LayeredDepthImage::from_tiles(parallel_camera(), &swapped);
    assert!(matches!(joined, Err(SampleImageError::TileLines { tile: 0, .. })));
    let mut tiles = layered_tiles(3);
    (tiles[0].specular, tiles[0].normal_oct16, tiles[0].truncated) = (None, None, true);
    let joined = LayeredDepthImage::from_tiles(parallel_camera(), &tiles).unwrap();
    assert_eq!((joined.validate(), joined.truncated), (Ok(()), true));
    let specular = joined.specular.unwrap();
    let of_first = tiles[0].sample_count();
    assert!(specular.visibility8[1][..of_first].iter().all(|&visibility| visibility == 0));
    tiles[1].specular.as_mut().unwrap().visibility8.pop();
    assert_eq!(LayeredDepthImage::from_tiles(parallel_camera(), &tiles), Err(SampleImageError::MixedTiles));
}
