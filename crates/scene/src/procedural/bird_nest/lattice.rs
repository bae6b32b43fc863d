//! The steel: trusses that carry, and beams at all angles between them, in four shells.

use std::f32::consts::TAU;

use glam::Vec3;

use super::super::geometry::{MeshBuilder, Station};
use super::super::random::{Rng, lerp};
use super::shell::{self, SECTORS, SEED};

const TRUSSES: u32 = 24;
/// Half the angle by which a truss turns around the stadium from its foot to the opening.
const TRUSS_TURN_RAD: f32 = 0.62;
/// Distance of the two chords of a truss.
const TRUSS_DEPTH_M: f32 = 7.0;
const CHORD_PIECES: u32 = 14;
const WEBS: u32 = 16;
const SECONDARY_BEAMS: u32 = 120;
const SECONDARY_PIECES: u32 = 10;
const TERTIARY_PIECES: u32 = 5;
/// Triangles of a tertiary beam, see [`MeshBuilder::beam`].
const TERTIARY_TRIANGLES: u32 = 8 * TERTIARY_PIECES + 4;
/// Shells of the tertiary beams, behind the outermost chords.
const TERTIARY_SHELLS_M: [f32; 3] = [1.0, 3.4, 5.6];
/// Depth of beams' ends below the ground.
const GROUND: f32 = -0.01;

/// A straight line over the unrolled shell, from (angle, up) to (angle, up).
#[derive(Clone, Copy)]
struct Line {
    from: (f32, f32),
    to: (f32, f32),
    inwards_m: f32,
}

impl Line {
    fn at(&self, t: f32) -> Station {
        shell::station(lerp(self.from.0, self.to.0, t), lerp(self.from.1, self.to.1, t), self.inwards_m)
    }

    fn add(&self, builder: &mut MeshBuilder, pieces: u32, width_m: f32, depth_m: f32, color_srgb: Vec3) {
        let stations: Vec<Station> = (0..=pieces).map(|i| self.at(i as f32 / pieces as f32)).collect();
        builder.beam(&stations, width_m, depth_m, color_srgb);
    }
}

/// Adds trusses, secondary beams and the rim, and then tertiary beams until the mesh has `triangles`.
pub(super) fn add(builder: &mut MeshBuilder, triangles: u32) {
    let mut rng = Rng::new(SEED, 1);
    add_rim(builder);
    for truss in 0..TRUSSES {
        let foot_rad = TAU * truss as f32 / TRUSSES as f32;
        for turn_rad in [-TRUSS_TURN_RAD, TRUSS_TURN_RAD] {
            let line = Line { from: (foot_rad, GROUND), to: (foot_rad + turn_rad, 1.0), inwards_m: 0.0 };
            add_truss(builder, line, &mut rng);
        }
    }
    (0..SECONDARY_BEAMS).for_each(|number| add_secondary(builder, number, &mut rng));
    let left = triangles.saturating_sub(builder.triangle_count()) / TERTIARY_TRIANGLES;
    (0..left).for_each(|number| add_tertiary(builder, number, left, &mut rng));
}

/// The edge of the opening, a closed beam with corners at each sector.
fn add_rim(builder: &mut MeshBuilder) {
    for inwards_m in [0.0, TRUSS_DEPTH_M] {
        let stations: Vec<Station> =
            (0..=SECTORS).map(|i| shell::station(TAU * i as f32 / SECTORS as f32, 1.0, inwards_m)).collect();
        builder.beam(&stations, 2.4, 2.4, steel(0.9));
    }
}

/// Two chords, one behind the other, and a zigzag between them.
fn add_truss(builder: &mut MeshBuilder, outer: Line, rng: &mut Rng) {
    let inner = Line { inwards_m: TRUSS_DEPTH_M, ..outer };
    let color = steel(rng.between(0.9, 1.04));
    outer.add(builder, CHORD_PIECES, 2.2, 2.0, color);
    inner.add(builder, CHORD_PIECES, 1.5, 1.5, color * 0.86);
    for web in 0..WEBS {
        let [here, there] = [web, web + 1].map(|i| i as f32 / WEBS as f32);
        let (outside, inside) = if web % 2 == 0 { (here, there) } else { (there, here) };
        let (outside, inside) = (outer.at(outside), inner.at(inside));
        let aside = (inside.middle - outside.middle).any_orthonormal_vector();
        let ends = [outside.middle, inside.middle].map(|middle| Station { middle, up: aside });
        builder.beam(&ends, 0.9, 0.9, color * 0.92);
    }
}

/// Long beams at many angles in the outermost shell, from the ground over the eave.
fn add_secondary(builder: &mut MeshBuilder, number: u32, rng: &mut Rng) {
    let foot_rad = TAU * (number as f32 + rng.unit()) / SECONDARY_BEAMS as f32;
    let steepness = rng.between(0.1, 1.0) * if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let top = rng.between(0.55, 1.0);
    let line =
        Line { from: (foot_rad, GROUND), to: (foot_rad + 0.9 * steepness, top), inwards_m: rng.between(-0.6, 1.2) };
    line.add(builder, SECONDARY_PIECES, rng.between(1.2, 2.0), 1.5, steel(rng.between(0.84, 1.0)));
}

/// Short beams in the shells behind, flat ones among them; more on the facade than on the roof.
fn add_tertiary(builder: &mut MeshBuilder, number: u32, count: u32, rng: &mut Rng) {
    let angle_rad = TAU * (number as f32 + rng.unit()) / count as f32;
    let middle = lerp(0.03, 0.95, rng.unit().powf(1.3));
    let (half_turn_rad, half_rise) = (rng.between(-0.2, 0.2), rng.between(-0.26, 0.26));
    let end = |side: f32| (angle_rad + side * half_turn_rad, (middle + side * half_rise).clamp(GROUND, 1.0));
    let shell = number as usize % TERTIARY_SHELLS_M.len();
    let line = Line { from: end(-1.0), to: end(1.0), inwards_m: TERTIARY_SHELLS_M[shell] };
    let shade = [0.88, 0.76, 0.66][shell] * rng.between(0.92, 1.06);
    line.add(builder, TERTIARY_PIECES, rng.between(0.8, 1.3), 1.0, steel(shade));
}

fn steel(shade: f32) -> Vec3 {
    Vec3::new(196.0, 198.0, 200.0) * shade
}
