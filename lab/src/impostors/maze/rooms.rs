//! The rooms of a maze, one for each frustum of its graph camera: straight parts of corridors, and junctions between them.
//!
//! Where a corridor ends, the next begins across the junction, so that all of the image goes around the corner, or a part of it to either
//! side. Where a corridor goes on, a junction is a room of its own, from whose eye no exit is seen at a grazing angle. How much of an image
//! goes through a portal follows from the number of cells behind.

use fixtures::{MAZE_WALL_M, Maze};
use glam::{DVec3, IVec2};

use crate::graph::{Corridor, Plane, Portal, upright};

/// Half the free width of a corridor.
pub const HALF_WIDTH_M: f64 = 0.5 - 0.5 * MAZE_WALL_M as f64;
/// The distance of an eye before its portal: at least this share of the corridor's length, and at most so far.
const LEAST_EYE_SHARE: f64 = 0.5;
const LEAST_EYE_M: f64 = HALF_WIDTH_M;
const MOST_EYE_M: f64 = 10.0;
/// The eye of a junction with two exits, and that of one with three.
const DIAGONAL_EYE_M: f64 = 1.5;
const SQUARE_EYE_M: f64 = HALF_WIDTH_M;
/// The share of a junction's image that either exit has at least.
const LEAST_SHARE: f64 = 0.2;

/// The portals of all rooms, parents first, and the extents of the rooms.
pub struct Rooms<'m> {
    maze: &'m Maze,
    pub portals: Vec<Portal>,
    pub surfaces: Vec<Surface>,
}

/// The extents of a room's surfaces.
pub struct Surface {
    /// Of its side walls.
    length_m: f64,
    width_m: f64,
    height_m: f64,
    /// The floor, and perhaps the ceiling.
    levels: f64,
}

/// A place in a corridor of the maze.
#[derive(Clone, Copy)]
struct Place {
    corridor: usize,
    /// The cell, from the corridor's first on.
    cell: i32,
}

/// A corridor that leaves another to the side.
#[derive(Clone, Copy)]
struct Side {
    corridor: usize,
    heading: DVec3,
    cells: usize,
}

impl<'m> Rooms<'m> {
    pub fn new(maze: &'m Maze) -> Self {
        let mut rooms = Self { maze, portals: Vec::new(), surfaces: Vec::new() };
        let first = &maze.corridors[0];
        let heading = in_space(first.heading);
        let outside = middle(first.first) - heading * (0.5 + 0.5 * f64::from(MAZE_WALL_M));
        rooms.add_straight(None, Place { corridor: 0, cell: 0 }, across(outside, heading));
        rooms
    }

    /// Adds the part of a corridor from a place on, up to its end or to where another leaves it, and all that lies behind.
    fn add_straight(&mut self, parent: Option<usize>, from: Place, line: [DVec3; 2]) {
        let corridor = &self.maze.corridors[from.corridor];
        let heading = in_space(corridor.heading);
        let mut cells = from.cell..corridor.length - 1;
        let junction = cells.find(|&cell| !self.sides(Place { cell, ..from }).is_empty());
        let last = Place { cell: junction.unwrap_or(corridor.length - 1), ..from };
        let axis = [self.middle(from), self.middle(last) + heading * HALF_WIDTH_M];
        let straight = Corridor { axis, half_width_m: HALF_WIDTH_M, height_m: f64::from(self.maze.height_m) };
        let face = upright(line, straight.height_m);
        let length_m = straight.length_m(&face);
        let own_cells = (last.cell - from.cell + 1) as usize;
        let share = 1.0 - own_cells as f64 / self.cells_from(from) as f64;
        let number = self.portals.len();
        self.portals.push(straight.portal(parent, face, eye_distance_m(length_m, share)));
        self.push_surface(length_m, 2.0 * HALF_WIDTH_M);
        match junction {
            Some(_) => self.add_junction(number, last),
            None => self.add_end(number, last),
        }
    }

    /// The corridors that leave the end of another.
    fn add_end(&mut self, number: usize, last: Place) {
        let heading = self.heading(last);
        let middle = self.middle(last);
        let sides = self.sides(last);
        let all_cells: usize = sides.iter().map(|side| side.cells).sum();
        for side in &sides {
            let share = if sides.len() == 1 { 1.0 } else { bounded(side.cells as f64 / all_cells as f64) };
            let near = middle + (side.heading - heading) * HALF_WIDTH_M;
            let far = middle + (heading + side.heading * (1.0 - 2.0 * share)) * HALF_WIDTH_M;
            self.add_straight(Some(number), Place { corridor: side.corridor, cell: 0 }, [near, far]);
        }
    }

    /// A junction that its corridor goes on behind.
    fn add_junction(&mut self, parent: usize, at: Place) {
        let heading = self.heading(at);
        let middle = self.middle(at);
        let sides = self.sides(at);
        let ahead = Place { cell: at.cell + 1, ..at };
        let height_m = f64::from(self.maze.height_m);
        let up = DVec3::Y * height_m;
        let (line, eye) = match sides.as_slice() {
            [side] => {
                let near = middle + (side.heading - heading) * HALF_WIDTH_M;
                let far = middle + (heading - side.heading) * HALF_WIDTH_M;
                // The line from the eye to the corner between the exits shares the image.
                let corner = middle + (heading + side.heading) * HALF_WIDTH_M;
                let share = bounded(side.cells as f64 / (side.cells + self.cells_from(ahead)) as f64);
                let split = near.lerp(far, share);
                ([near, far], split - (corner - split).normalize_or_zero() * DIAGONAL_EYE_M)
            }
            _ => {
                let start = middle - heading * HALF_WIDTH_M;
                (across(start, heading), start - heading * SQUARE_EYE_M)
            }
        };
        let walls = vec![Plane::through(middle, DVec3::Y), Plane::through(middle + up, DVec3::NEG_Y)];
        let number = self.portals.len();
        let face = upright(line, height_m);
        self.portals.push(Portal { parent: Some(parent), face, eye_in_world: eye + up * 0.5, walls });
        self.push_surface(0.0, HALF_WIDTH_M);
        for side in sides {
            let exit = across(middle + side.heading * HALF_WIDTH_M, side.heading);
            self.add_straight(Some(number), Place { corridor: side.corridor, cell: 0 }, exit);
        }
        self.add_straight(Some(number), ahead, across(middle + heading * HALF_WIDTH_M, heading));
    }

    fn push_surface(&mut self, length_m: f64, width_m: f64) {
        let levels = if self.maze.is_roofed { 2.0 } else { 1.0 };
        self.surfaces.push(Surface { length_m, width_m, height_m: f64::from(self.maze.height_m), levels });
    }

    /// The corridors that leave a place to its sides.
    fn sides(&self, place: Place) -> Vec<Side> {
        let outer = &self.maze.corridors[place.corridor];
        let junction = outer.first + outer.heading * place.cell;
        let corridors = self.maze.corridors.iter().enumerate();
        let leaving = corridors
            .filter(|(_, inner)| inner.parent == Some(place.corridor) && inner.first - inner.heading == junction);
        leaving
            .map(|(corridor, inner)| {
                let cells = self.cells_from(Place { corridor, cell: 0 });
                Side { corridor, heading: in_space(inner.heading), cells }
            })
            .collect()
    }

    /// The cells of a corridor from a place on, and all that are reached from there.
    fn cells_from(&self, place: Place) -> usize {
        let length = self.maze.corridors[place.corridor].length;
        let cells = (place.cell..length).map(|cell| {
            let behind = self.sides(Place { cell, ..place }).iter().map(|side| side.cells).sum::<usize>();
            1 + behind
        });
        cells.sum()
    }

    fn heading(&self, place: Place) -> DVec3 {
        in_space(self.maze.corridors[place.corridor].heading)
    }

    fn middle(&self, place: Place) -> DVec3 {
        let corridor = &self.maze.corridors[place.corridor];
        middle(corridor.first + corridor.heading * place.cell)
    }
}

impl Surface {
    pub fn area_m2(&self) -> f64 {
        let Self { length_m, width_m, height_m, levels } = self;
        // A junction has a floor of half a cell, and no walls.
        let level_m2 = length_m.max(2.0 * HALF_WIDTH_M) * width_m * levels;
        let end_m2 = if *length_m > 0.0 { width_m * height_m } else { 0.0 };
        2.0 * length_m * height_m + level_m2 + end_m2
    }

    /// Columns go along both sides and the end, rows along floor, end and ceiling.
    pub fn columns_over_rows(&self) -> f64 {
        let Self { length_m, width_m, height_m, levels } = self;
        (2.0 * length_m + width_m) / (levels * length_m + height_m)
    }
}

/// From as far away, as large a part of an image goes on behind a corridor's end as lies there: (e / (e + length))² is the share.
fn eye_distance_m(length_m: f64, share: f64) -> f64 {
    let side = share.sqrt();
    let least_m = (LEAST_EYE_SHARE * length_m).max(LEAST_EYE_M);
    (length_m * side / (1.0 - side)).clamp(least_m, MOST_EYE_M)
}

fn bounded(share: f64) -> f64 {
    share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
}

/// The line across a corridor, from left to right.
fn across(middle: DVec3, heading: DVec3) -> [DVec3; 2] {
    let right = heading.cross(DVec3::Y) * HALF_WIDTH_M;
    [middle - right, middle + right]
}

fn middle(cell: IVec2) -> DVec3 {
    Maze::middle(cell).as_dvec3()
}

fn in_space(cells: IVec2) -> DVec3 {
    DVec3::new(f64::from(cells.x), 0.0, f64::from(cells.y))
}
