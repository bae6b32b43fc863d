//! Near and far in one image: 16 bits of inverse depth, and of depth.

use codec::{DecodeLimits, decode_depth_plane, encode_depth_plane};
use depth_image::ProvenanceKind;
use fixtures::quad;
use glam::Vec3;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::share_of_kind;
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Stage, looking};
use crate::failures::stand::Stand;

const RATIOS: X = X::log("far / near", "", &[1e1, 1e2, 1e3, 1e4, 1e5]);
/// Texels of the plane that is encoded.
const SIDE_PX: u32 = 64;
/// The focal length and the distance between two viewpoints for which a displacement is stated.
const FOCAL_PX: f64 = 512.0;
const BASELINE_NEARS: f64 = 0.1;

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Displacement against far over near",
        subject: "64 × 64 depths from near to far, 16 bits",
        x: RATIOS,
        y: ["greatest displacement", "px"],
        series: &[
            Series::new("linear depth", &[Shape::rises(1.0, 0.0)]),
            Series::new("inverse depth", &[Shape::Plateau { tolerance: 2e-4 }]),
        ],
        why: "A code of inverse depth moves a point by the same part of a pixel at every distance. A code of depth is as long near the eye as far away.",
        measure: displacement,
    },
    Curve {
        name: "A far wall found beside a near card",
        subject: "a card at 1 m before a wall, two images",
        x: RATIOS,
        y: ["pixels with a surface", ""],
        series: &[Series::new(
            "joint_carve",
            &[Shape::falls(0.3, 0.02), Shape::EqualAt { x: 1e2, y: 1.0, tolerance: 0.05 }],
        )],
        why: "Where half a code at the far wall is longer than a surface is thick, two footprints, the ray passes the wall: from 131,000 over the focal length in texels on.",
        measure: far_wall,
    },
];

fn displacement(_: &Stand, ratios: &[f64]) -> anyhow::Result<Rows> {
    rows(ratios, |ratio| {
        // Near is at 1.
        let texels = SIDE_PX * SIDE_PX;
        let depths: Vec<f64> = (0..texels).map(|i| ratio.powf(f64::from(i) / f64::from(texels - 1))).collect();
        let inverse: Vec<f32> = depths.iter().map(|depth| depth.recip() as f32).collect();
        let encoded = encode_depth_plane(&inverse);
        let decoded = decode_depth_plane(&encoded, SIDE_PX, SIDE_PX, &DecodeLimits::default())?;
        let moved = |exact: f64, coded: f64| (exact - coded).abs() * FOCAL_PX * BASELINE_NEARS;
        let of_inverse = inverse.iter().zip(&decoded).map(|(a, b)| moved(f64::from(*a), f64::from(*b)));
        let step = (ratio - 1.0) / f64::from(u16::MAX);
        let of_linear = depths.iter().map(|depth| {
            // Half a code off, where rounding is unfavourable.
            let coded = depth + 0.5 * step;
            moved(depth.recip(), coded.recip())
        });
        Ok([of_linear.fold(0.0, f64::max), of_inverse.fold(0.0, f64::max)])
    })
}

fn far_wall(stand: &Stand, ratios: &[f64]) -> anyhow::Result<Rows> {
    rows(ratios, |far_m| {
        let far_m = far_m as f32;
        let mut scene = quad(Vec3::NEG_Z * far_m, far_m, Vec3::Z, [180, 90, 40]);
        let near = quad(Vec3::new(-0.6, 0.0, -1.0), 0.3, Vec3::Z, [40, 90, 180]);
        scene.instances.push(scene::Instance { mesh: 1, ..near.instances[0] });
        scene.meshes.extend(near.meshes);
        let camera = |x: f32, size_px| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 60.0, size_px);
        let stage = Stage::new(stand, &scene, &[-0.1, 0.1].map(|x| camera(x, stand.sample_px)))?;
        let view = [camera(0.02, stand.view_px)];
        Ok([share_of_kind(&stage.views(&view, CARVE)?, ProvenanceKind::Hit)])
    })
}
