//! Distances to the nearest cell with samples, by which rays skip empty space.

use glam::UVec3;

/// Distances are no greater than this.
const FARTHEST: u32 = 1 << 16;

/// For each cell, how many steps along, beside or across edges and corners lead to the nearest of the `occupied` cells: 0 for these
/// themselves. Two sweeps with all neighbours give this distance exactly (Rosenfeld and Pfaltz 1966).
pub(super) fn distances(size: UVec3, occupied: &[bool]) -> Vec<u32> {
    let mut all: Vec<u32> = occupied.iter().map(|&is| if is { 0 } else { FARTHEST }).collect();
    let [columns, rows, layers] = size.to_array().map(|side| side as i64);
    let mut sweep = |forward: bool| {
        let order = |count: i64| (0..count).map(move |i| if forward { i } else { count - 1 - i });
        for z in order(layers) {
            for y in order(rows) {
                for x in order(columns) {
                    let place = |x: i64, y: i64, z: i64| (x + columns * (y + rows * z)) as usize;
                    let mut least = all[place(x, y, z)];
                    if least == 0 {
                        continue;
                    }
                    for [dx, dy, dz] in BEFORE {
                        let sign = if forward { 1 } else { -1 };
                        let [nx, ny, nz] = [x + sign * dx, y + sign * dy, z + sign * dz];
                        let is_inside =
                            (0..columns).contains(&nx) && (0..rows).contains(&ny) && (0..layers).contains(&nz);
                        if is_inside {
                            least = least.min(all[place(nx, ny, nz)] + 1);
                        }
                    }
                    all[place(x, y, z)] = least;
                }
            }
        }
    };
    sweep(true);
    sweep(false);
    all
}

/// The neighbours that a sweep has passed.
const BEFORE: [[i64; 3]; 13] = [
    [-1, -1, -1],
    [0, -1, -1],
    [1, -1, -1],
    [-1, 0, -1],
    [0, 0, -1],
    [1, 0, -1],
    [-1, 1, -1],
    [0, 1, -1],
    [1, 1, -1],
    [-1, -1, 0],
    [0, -1, 0],
    [1, -1, 0],
    [-1, 0, 0],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search_through_all_cells() {
        let size = UVec3::new(7, 5, 6);
        let cells: Vec<UVec3> = (0..size.element_product())
            .map(|i| UVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y))
            .collect();
        let occupied: Vec<bool> = (0..cells.len()).map(|i| i % 53 == 3).collect();
        let near: Vec<u32> = cells
            .iter()
            .map(|cell| {
                let to = |other: &UVec3| cell.as_ivec3().wrapping_sub(other.as_ivec3()).abs().max_element() as u32;
                cells.iter().zip(&occupied).filter(|(_, is)| **is).map(|(other, _)| to(other)).min().expect("some")
            })
            .collect();
        assert_eq!(distances(size, &occupied), near);
        assert!(distances(UVec3::splat(2), &[false; 8]).iter().all(|&distance| distance >= FARTHEST));
    }
}
