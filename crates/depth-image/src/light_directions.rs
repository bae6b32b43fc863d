//! The directions of a light field: the vertices of an octahedron whose faces are divided, on the unit sphere.

use std::collections::HashMap;

use glam::{IVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::CameraError;

/// How many directions a light field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LightDirections {
    /// 66, from edges in four parts.
    D66,
    /// 258, from edges in eight parts.
    D258,
    /// 1026, from edges in sixteen parts.
    D1026,
}

/// A direction, and its part of all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightDirection {
    /// Where light goes; a unit vector.
    pub towards: Vec3,
    /// A third of the triangles around the vertex, steradians. All together are 4π.
    pub solid_angle_sr: f32,
}

impl LightDirections {
    /// All numbers of directions.
    pub const ALL: [Self; 3] = [Self::D66, Self::D258, Self::D1026];

    /// The directions of a number of them.
    ///
    /// # Errors
    /// A number that no division gives.
    pub fn of(count: u32) -> Result<Self, CameraError> {
        let found = Self::ALL.into_iter().find(|directions| directions.count() == count);
        found.ok_or(CameraError::OutOfRange {
            field: "directions",
            value: f64::from(count),
            allowed: "66, 258 or 1026",
        })
    }

    /// The parts of an edge.
    #[must_use]
    pub fn divisions(self) -> u32 {
        match self {
            Self::D66 => 4,
            Self::D258 => 8,
            Self::D1026 => 16,
        }
    }

    /// The number of directions.
    #[must_use]
    pub fn count(self) -> u32 {
        4 * self.divisions() * self.divisions() + 2
    }

    /// Pairs of opposite directions.
    #[must_use]
    pub fn pairs(self) -> u32 {
        self.count() / 2
    }

    /// All directions; each pair of opposite ones stands together.
    #[must_use]
    pub fn all(self) -> Vec<LightDirection> {
        let solid_angles = self.solid_angles_sr();
        let vertices = self.first_vertices().flat_map(|vertex| [vertex, -vertex]);
        let directions = vertices.map(|vertex| LightDirection {
            towards: unit(vertex),
            solid_angle_sr: solid_angles.get(&vertex).copied().unwrap_or(0.0),
        });
        directions.collect()
    }

    /// One vertex of each opposite two.
    fn first_vertices(self) -> impl Iterator<Item = IVec3> {
        let n = self.divisions() as i32;
        let lines = (0..=n).flat_map(move |k| (-n..=n).map(move |j| (j, k)));
        let places = lines.flat_map(move |(j, k)| (-n..=n).map(move |i| IVec3::new(i, j, k)));
        let vertices = places.filter(move |v| v.abs().element_sum() == n);
        vertices.filter(|v| [v.z, v.y, v.x].into_iter().find(|&c| c != 0).is_some_and(|c| c > 0))
    }

    fn solid_angles_sr(self) -> HashMap<IVec3, f32> {
        let mut all = HashMap::new();
        let signs = [-1, 1]
            .into_iter()
            .flat_map(|x| [-1, 1].map(|y| (x, y)))
            .flat_map(|(x, y)| [-1, 1].map(|z| IVec3::new(x, y, z)));
        for sign in signs {
            for corners in self.face_triangles() {
                let corners = corners.map(|corner| corner * sign);
                let third = triangle_sr(corners.map(unit)) / 3.0;
                corners.into_iter().for_each(|corner| *all.entry(corner).or_insert(0.0) += third);
            }
        }
        all
    }

    /// The triangles of the face whose coordinates are not negative.
    fn face_triangles(self) -> Vec<[IVec3; 3]> {
        let n = self.divisions() as i32;
        let corners = (0..n).flat_map(|i| (0..n - i).map(move |j| IVec3::new(i, j, n - i - j)));
        let [right, up] = [IVec3::new(1, 0, -1), IVec3::new(0, 1, -1)];
        let upright = corners.clone().map(|at| [at, at + right, at + up]);
        let inverted = corners.filter(|at| at.z >= 2).map(|at| [at + right, at + right + up, at + up]);
        upright.chain(inverted).collect()
    }
}

fn unit(vertex: IVec3) -> Vec3 {
    vertex.as_vec3().normalize_or_zero()
}

/// The solid angle of a triangle on the unit sphere (Van Oosterom and Strackee 1983).
fn triangle_sr([a, b, c]: [Vec3; 3]) -> f32 {
    let volume = a.dot(b.cross(c)).abs();
    2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    #[test]
    fn directions_are_all_different_and_cover_the_sphere() {
        // Computed by another program.
        let shares = [[0.3687, 1.2368], [0.2765, 1.5125], [0.2414, 1.6150]];
        for ((directions, count), [smallest, largest]) in
            LightDirections::ALL.into_iter().zip([66, 258, 1026]).zip(shares)
        {
            let all = directions.all();
            assert_eq!((all.len(), directions.count()), (count, count as u32));
            assert_eq!(LightDirections::of(count as u32), Ok(directions));
            let sum: f32 = all.iter().map(|direction| direction.solid_angle_sr).sum();
            assert!((sum - 4.0 * PI).abs() < 1e-3, "{count}: {sum}");
            let mean = 4.0 * PI / count as f32;
            let [least, most] =
                [f32::min, f32::max].map(|pick| all.iter().map(|d| d.solid_angle_sr / mean).reduce(pick).unwrap());
            assert!((least - smallest).abs() < 1e-3 && (most - largest).abs() < 1e-3, "{count}: {least} to {most}");
            for pair in all.chunks(2) {
                assert_eq!(pair[0].towards, -pair[1].towards);
                assert!((pair[0].towards.length() - 1.0).abs() < 1e-6);
            }
            let mut places: Vec<[i32; 3]> =
                all.iter().map(|d| (d.towards * 1000.0).round().as_ivec3().to_array()).collect();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), count);
        }
    }

    #[test]
    fn other_numbers_are_refused() {
        for count in [0, 65, 100, 259, u32::MAX] {
            let refused = LightDirections::of(count);
            assert!(matches!(refused, Err(CameraError::OutOfRange { field: "directions", .. })), "{count}");
        }
    }
}
