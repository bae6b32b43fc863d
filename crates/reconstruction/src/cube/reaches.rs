//! How far rays skip through empty cells, by the octant of their direction.

use glam::UVec3;

/// Octants of directions. A bit for each axis says whether a ray rises along it.
const OCTANTS: usize = 8;
/// Bits of a word for each octant.
const BITS: usize = 4;
/// Longer reaches count as this.
const FARTHEST: u8 = (1 << BITS) - 1;

/// A word for each cell that is not `occupied`. For each octant it has the side of the largest cube of empty cells that begins with this cell
/// and lies ahead of a ray, at least 1 and at most [`FARTHEST`]; what is outside of the grid is empty. The words of occupied cells are 0.
pub(super) fn reaches(size: UVec3, occupied: &[bool]) -> Vec<u32> {
    let mut words = vec![0; occupied.len()];
    for octant in 0..OCTANTS {
        for (word, reach) in words.iter_mut().zip(in_octant(size, occupied, octant)) {
            *word |= u32::from(reach) << (BITS * octant);
        }
    }
    words
}

/// A cube reaches one cell farther than the least of those that begin at the seven cells ahead.
fn in_octant(size: UVec3, occupied: &[bool], octant: usize) -> Vec<u8> {
    let [columns, rows, layers] = size.to_array().map(|side| side as usize);
    let mut all = vec![0; occupied.len()];
    let mut least_ahead = vec![FARTHEST; columns];
    for z in in_order(octant, 2, layers) {
        for y in in_order(octant, 1, rows) {
            least_ahead.fill(FARTHEST);
            for (y, z) in rows_ahead([y, z], [rows, layers], octant) {
                let row = &all[columns * (y + rows * z)..][..columns];
                least_ahead.iter_mut().zip(row).for_each(|(least, &reach)| *least = reach.min(*least));
            }
            let row = columns * (y + rows * z)..columns * (y + rows * z + 1);
            let own = &mut all[row.clone()];
            let occupied = &occupied[row];
            let mut before = FARTHEST;
            for x in in_order(octant, 0, columns) {
                let least = before.min(least_ahead[x]);
                own[x] = if occupied[x] { 0 } else { (least + 1).min(FARTHEST) };
                before = own[x].min(least_ahead[x]);
            }
        }
    }
    all
}

fn rises(octant: usize, axis: usize) -> bool {
    octant >> axis & 1 != 0
}

/// The places along an axis, those ahead of a ray first.
fn in_order(octant: usize, axis: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |i| if rises(octant, axis) { count - 1 - i } else { i })
}

/// The rows ahead of a row and within the grid: along y, along z, and along both.
fn rows_ahead(row: [usize; 2], size: [usize; 2], octant: usize) -> impl Iterator<Item = (usize, usize)> {
    let [y, z] = [0, 1].map(|axis| {
        let next = if rises(octant, axis + 1) { row[axis].checked_add(1) } else { row[axis].checked_sub(1) };
        next.filter(|&next| next < size[axis])
    });
    [y.map(|y| (y, row[1])), z.map(|z| (row[0], z)), y.zip(z)].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reaches_are_the_sides_of_the_largest_empty_cubes_ahead() {
        let size = UVec3::new(7, 5, 6);
        let cells: Vec<UVec3> = (0..size.element_product())
            .map(|i| UVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y))
            .collect();
        let occupied: Vec<bool> = (0..cells.len()).map(|i| i % 53 == 3).collect();
        let words = reaches(size, &occupied);
        for (cell, word) in cells.iter().zip(words) {
            for octant in 0..OCTANTS {
                let ahead = |other: &UVec3, axis: usize| {
                    let way = other[axis] as i32 - cell[axis] as i32;
                    if rises(octant, axis) { way } else { -way }
                };
                let ways = cells.iter().zip(&occupied).filter(|(_, is)| **is).filter_map(|(other, _)| {
                    let ways = [0, 1, 2].map(|axis| ahead(other, axis));
                    (ways.iter().min() >= Some(&0)).then(|| ways.into_iter().max())?
                });
                let nearest = ways.min().map_or(FARTHEST, |way| (way as u8).min(FARTHEST));
                assert_eq!(word >> (4 * octant) & 15, u32::from(nearest), "{cell} {octant}");
            }
        }
        assert_eq!(reaches(UVec3::splat(2), &[false; 8]), [u32::MAX; 8]);
    }
}
