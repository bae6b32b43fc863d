//! Newell's teapot: 32 bicubic patches, 6.4 m long, 3.15 m high and 4 m wide (M. Newell, *The Utilization of Procedure
//! Models in Digital Image Synthesis*, 1975).

use std::array;

use glam::{Vec2, Vec3};

use super::parts::{MeshBuilder, vertex};

/// The side of the pattern's cubes, metres.
const PATTERN_M: f32 = 0.5;
const LIGHT: Vec3 = Vec3::new(226.0, 196.0, 120.0);
const DARK: Vec3 = Vec3::new(120.0, 52.0, 60.0);

/// The control points of a patch. Its front is towards `across × along`.
type Patch = [[Vec3; 4]; 4];

/// Control points of a surface of revolution: distance from the axis and height, metres. The front is on the left.
type Profile = [[f32; 2]; 4];

/// Rim, body above and below, lid's knob, lid, bottom. Each makes four patches, a quarter of a turn each.
const PROFILES: [Profile; 6] = [
    [[1.4, 2.4], [1.3375, 2.53125], [1.4375, 2.53125], [1.5, 2.4]],
    [[1.5, 2.4], [1.75, 1.875], [2.0, 1.35], [2.0, 0.9]],
    [[2.0, 0.9], [2.0, 0.45], [1.5, 0.225], [1.5, 0.15]],
    [[0.0, 3.15], [0.8, 3.15], [0.0, 2.85], [0.2, 2.7]],
    [[0.2, 2.7], [0.4, 2.55], [1.3, 2.55], [1.3, 2.4]],
    [[1.5, 0.15], [1.5, 0.075], [1.425, 0.0], [0.0, 0.0]],
];
/// Where the inner control points of a quarter of a turn lie, in radii.
const QUARTER: f32 = 0.56;

/// A section of a tube: two places on the plane z = 0 (x and height), and the half width between them, metres.
type Section = ([f32; 2], f32, [f32; 2]);

/// Handle above and below, spout below and above. Each makes two patches, one on either side of z = 0.
const TUBES: [[Section; 4]; 4] = [
    [
        ([-1.6, 2.025], 0.3, [-1.5, 2.25]),
        ([-2.3, 2.025], 0.3, [-2.5, 2.25]),
        ([-2.7, 2.025], 0.3, [-3.0, 2.25]),
        ([-2.7, 1.8], 0.3, [-3.0, 1.8]),
    ],
    [
        ([-2.7, 1.8], 0.3, [-3.0, 1.8]),
        ([-2.7, 1.575], 0.3, [-3.0, 1.35]),
        ([-2.5, 1.125], 0.3, [-2.65, 0.9375]),
        ([-2.0, 0.9], 0.3, [-1.9, 0.6]),
    ],
    [
        ([1.7, 1.425], 0.66, [1.7, 0.6]),
        ([2.6, 1.425], 0.66, [3.1, 0.825]),
        ([2.3, 2.1], 0.25, [2.4, 2.025]),
        ([2.7, 2.4], 0.25, [3.3, 2.4]),
    ],
    [
        ([2.7, 2.4], 0.25, [3.3, 2.4]),
        ([2.8, 2.475], 0.25, [3.525, 2.49375]),
        ([2.9, 2.475], 0.15, [3.45, 2.5125]),
        ([2.8, 2.4], 0.15, [3.2, 2.4]),
    ],
];

/// A teapot in a pattern of cubes, with its spout towards +x: 64 · `squares`² triangles.
#[derive(Clone, Copy)]
pub struct Teapot {
    /// The middle of its bottom.
    pub foot: Vec3,
    /// Its size, over that of Newell's.
    pub scale: f32,
    /// Squares along each side of a patch.
    pub squares: u32,
}

/// Adds a teapot to a mesh.
pub fn teapot(builder: &mut MeshBuilder, teapot: Teapot) {
    let squares = teapot.squares;
    for patch in patches() {
        for square in 0..squares * squares {
            add_square(builder, &patch, [square / squares, square % squares], teapot);
        }
    }
}

fn patches() -> impl Iterator<Item = Patch> {
    let turned = PROFILES.iter().flat_map(|profile| (0..4).map(|quarter| quarter_turn(profile, quarter)));
    let tubes = TUBES.iter().flat_map(|tube| [half_tube(tube), mirrored(half_tube(tube))]);
    turned.chain(tubes)
}

fn quarter_turn(profile: &Profile, quarter: u32) -> Patch {
    let [ahead, aside] = [0, 1].map(|more| match (quarter + more) % 4 {
        0 => Vec3::X,
        1 => Vec3::Z,
        2 => Vec3::NEG_X,
        _ => Vec3::NEG_Z,
    });
    profile.map(|[radius_m, height_m]| {
        [[1.0, 0.0], [1.0, QUARTER], [QUARTER, 1.0], [0.0, 1.0]]
            .map(|[a, b]| (ahead * a + aside * b) * radius_m + Vec3::Y * height_m)
    })
}

fn half_tube(tube: &[Section; 4]) -> Patch {
    tube.map(|([x0, y0], width_m, [x1, y1])| {
        [[x0, y0, 0.0], [x0, y0, width_m], [x1, y1, width_m], [x1, y1, 0.0]].map(Vec3::from)
    })
}

/// The other side of z = 0; its front is outside as well.
fn mirrored(patch: Patch) -> Patch {
    patch.map(|row| array::from_fn(|column| row[3 - column] * Vec3::new(1.0, 1.0, -1.0)))
}

/// Two triangles of one colour.
fn add_square(builder: &mut MeshBuilder, patch: &Patch, [row, column]: [u32; 2], teapot: Teapot) {
    let Teapot { foot, scale, squares } = teapot;
    let places = [[0, 0], [0, 1], [1, 1], [1, 0]]
        .map(|[r, c]| Vec2::new((row + r) as f32, (column + c) as f32) / squares as f32);
    let color_srgb = pattern(point(patch, (places[0] + places[2]) * 0.5));
    let corners =
        places.map(|place| builder.push(vertex(point(patch, place) * scale + foot, normal(patch, place), color_srgb)));
    builder.quad(corners);
}

fn pattern(point: Vec3) -> Vec3 {
    let cube = (point / PATTERN_M).floor();
    if (cube.x + cube.y + cube.z).rem_euclid(2.0) < 0.5 { LIGHT } else { DARK }
}

/// Cubic Bernstein weights.
fn weights(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

fn slopes(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

fn sum(patch: &Patch, along: [f32; 4], across: [f32; 4]) -> Vec3 {
    (0..16).map(|i| patch[i / 4][i % 4] * (along[i / 4] * across[i % 4])).sum()
}

/// A place is a share along the rows of control points, and one across them.
fn point(patch: &Patch, place: Vec2) -> Vec3 {
    sum(patch, weights(place.x), weights(place.y))
}

fn normal(patch: &Patch, place: Vec2) -> Vec3 {
    // Rows of the knob's top and of the bottom's middle are one point: there the normal is that of a place beside it.
    let Vec2 { x: along, y: across } = place.clamp(Vec2::splat(1e-3), Vec2::splat(1.0 - 1e-3));
    sum(patch, weights(along), slopes(across)).cross(sum(patch, slopes(along), weights(across))).normalize_or(Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    fn triangles() -> Vec<([Vec3; 3], Vec3)> {
        let mut builder = MeshBuilder::default();
        teapot(&mut builder, Teapot { foot: Vec3::ZERO, scale: 1.0, squares: 16 });
        let mesh = builder.into_scene("teapot", Material::default()).meshes.remove(0);
        let of = |corners: &[u32]| {
            let at = |i: usize| mesh.vertices[corners[i] as usize];
            ([0, 1, 2].map(|i| Vec3::from(at(i).position)), (0..3).map(|i| Vec3::from(at(i).normal)).sum::<Vec3>())
        };
        mesh.indices.chunks_exact(3).map(of).collect()
    }

    #[test]
    fn the_teapot_has_its_size_and_faces_out() {
        let triangles = triangles();
        assert_eq!(triangles.len(), 16_384);
        let corners = triangles.iter().flat_map(|(corners, _)| corners);
        let (min, max) = corners.fold((Vec3::MAX, Vec3::MIN), |(min, max), &p| (min.min(p), max.max(p)));
        assert!((max - min - Vec3::new(6.43, 3.15, 4.0)).abs().max_element() < 0.02, "{min} {max}");
        let facing = |&([a, b, c], normal): &([Vec3; 3], Vec3)| {
            let out = (b - a).cross(c - a);
            // Triangles at the knob's top and at the bottom's middle have no area.
            out.length() < 1e-7 || out.normalize_or_zero().dot(normal.normalize_or_zero()) > 0.7
        };
        assert!(triangles.iter().all(facing));
        let volume_m3: f32 = triangles.iter().map(|([a, b, c], _)| a.dot(b.cross(*c)) / 6.0).sum();
        assert!(volume_m3 > 20.0, "{volume_m3}");
    }
}
