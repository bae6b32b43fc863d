//! Which surfaces of a scene form one mirror.

use std::collections::BTreeSet;

use depth_image::Aabb;
use glam::{UVec3, Vec3};
use scene::Scene;

/// Cells of a grid along the scene's longest side. Mirrors form one group where they touch the same cell or neighbouring cells.
const GRID: f32 = 32.0;
const SIDE: u32 = GRID as u32 + 1;
/// A triangle that is larger than two cells is split into four, and each part again, at most this many times.
const SPLITS: u32 = 5;
/// Points that are spread over a mirror.
const POINTS: usize = 8192;

/// A mirroring surface.
#[derive(Debug, Clone, Copy)]
pub(super) enum Surface {
    /// A triangle that stands still, by its corners; whether its back mirrors, too.
    Triangle([Vec3; 3], bool),
    /// The box of an instance that moves, over all moments.
    Moving(Aabb),
}

impl Surface {
    fn center(&self) -> Vec3 {
        match self {
            Self::Triangle([a, b, c], _) => (a + b + c) / 3.0,
            Self::Moving(bounds) => bounds.center(),
        }
    }
}

/// Gives each mirroring surface of a scene to `each`.
pub(super) fn for_each_surface(
    scene: &Scene,
    is_mirror: &[bool],
    of_instances: &[Aabb],
    each: &mut dyn FnMut(Surface),
) {
    let moving = scene.animation.iter().flat_map(|animation| &animation.moving);
    let moving: BTreeSet<usize> = moving.map(|moving| moving.instance as usize).collect();
    for (number, (instance, bounds)) in scene.instances.iter().zip(of_instances).enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mut parts = mesh.parts.iter().filter(|part| is_mirror[part.material as usize]).peekable();
        if parts.peek().is_none() {
            continue;
        }
        let sways = || scene.wind.is_some() && mesh.vertices.iter().any(|vertex| vertex.sway > 0.0);
        if moving.contains(&number) || sways() {
            each(Surface::Moving(*bounds));
            continue;
        }
        let corner = |index: &u32| {
            instance.world_from_mesh.transform_point3(Vec3::from(mesh.vertices[*index as usize].position))
        };
        for part in parts {
            let double_sided = scene.materials[part.material as usize].double_sided;
            let indices = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
            let triangles = indices.as_chunks::<3>().0.iter();
            triangles.for_each(|triangle| each(Surface::Triangle(triangle.each_ref().map(corner), double_sided)));
        }
    }
}

/// Surfaces that form one mirror.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub bounds: Aabb,
    pub area_m2: f64,
    /// The sum of the triangles' normals, each as long as the triangle's area.
    pub area_normal_m2: Vec3,
    /// Some part of it moves.
    pub moves: bool,
    /// Points spread over it by area, as soon as its area is known.
    pub points: Vec<SurfacePoint>,
}

impl Group {
    const NONE: Self =
        Self { bounds: Aabb::EMPTY, area_m2: 0.0, area_normal_m2: Vec3::ZERO, moves: false, points: Vec::new() };

    fn add(&mut self, surface: Surface) {
        let bounds = match surface {
            Surface::Triangle([a, b, c], _) => {
                let area_normal_m2 = 0.5 * (b - a).cross(c - a);
                self.area_normal_m2 += area_normal_m2;
                self.area_m2 += f64::from(area_normal_m2.length());
                Aabb::around([a, b, c])
            }
            Surface::Moving(bounds) => {
                self.moves = true;
                self.area_m2 += f64::from(area_m2(&bounds));
                bounds
            }
        };
        self.bounds = Aabb::of_boxes(&[self.bounds, bounds]);
    }

    /// Adds the points of a triangle: one for each step of area that ends in it. `passed_m2` is the area before it.
    fn spread(&mut self, [a, b, c]: [Vec3; 3], double_sided: bool, passed_m2: &mut f64) {
        let area_normal_m2 = 0.5 * (b - a).cross(c - a);
        let step_m2 = self.area_m2 / POINTS as f64;
        *passed_m2 += f64::from(area_normal_m2.length());
        while self.points.len() < POINTS && *passed_m2 > (self.points.len() as f64 + 0.5) * step_m2 {
            // Folded into the triangle.
            let [u, v] = spread_2d(self.points.len());
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            let normal = area_normal_m2.normalize_or(Vec3::Y);
            let point_in_world = a + (b - a) * u + (c - a) * v;
            self.points.push(SurfacePoint { point_in_world, normal, double_sided });
        }
    }
}

/// A point of a mirror.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfacePoint {
    pub point_in_world: Vec3,
    pub normal: Vec3,
    /// Its back mirrors, too.
    pub double_sided: bool,
}

/// Evenly spread numbers from 0 to 1 in pairs (Roberts 2018, R2).
pub(super) fn spread_2d(number: usize) -> [f32; 2] {
    [0.754_877_666, 0.569_840_296].map(|step: f64| ((number as f64 + 0.5) * step).fract() as f32)
}

/// The largest groups of surfaces, at most `most`, and the number of those beyond. `for_each` gives each surface to a function; it
/// is called three times, so that none is kept.
pub(super) fn groups(volume: &Aabb, most: usize, for_each: impl Fn(&mut dyn FnMut(Surface))) -> (Vec<Group>, usize) {
    let mut grid = Grid::over(volume);
    for_each(&mut |surface| match surface {
        Surface::Triangle(corners, _) => grid.occupy_triangle(corners, SPLITS),
        Surface::Moving(bounds) => grid.occupy(&bounds),
    });
    let mut groups = Vec::new();
    for_each(&mut |surface| {
        let number = grid.group_at(surface.center(), groups.len());
        if number == groups.len() {
            groups.push((number, Group::NONE));
        }
        groups[number].1.add(surface);
    });
    let mut place_of = vec![None; groups.len()];
    groups.sort_by(|(_, a), (_, b)| area_m2(&b.bounds).total_cmp(&area_m2(&a.bounds)));
    let beyond = groups.split_off(groups.len().min(most)).len();
    groups.iter().enumerate().for_each(|(place, (number, _))| place_of[*number] = Some(place));
    let mut followed: Vec<(Group, f64)> = groups.into_iter().map(|(_, group)| (group, 0.0)).collect();
    for_each(&mut |surface| {
        if let Surface::Triangle(corners, double_sided) = surface
            && let Some(place) = place_of[grid.group_at(surface.center(), place_of.len())]
        {
            let (group, passed_m2) = &mut followed[place];
            group.spread(corners, double_sided, passed_m2);
        }
    });
    (followed.into_iter().map(|(group, _)| group).collect(), beyond)
}

/// Which cells of a scene hold mirrors.
struct Grid {
    origin: Vec3,
    cell_m: f32,
    cells: Vec<Cell>,
}

/// A cell of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    Empty,
    Occupied,
    /// Occupied, and of this group.
    Of(usize),
}

impl Grid {
    fn over(volume: &Aabb) -> Self {
        let cell_m = (volume.size().max_element() / GRID).max(f32::MIN_POSITIVE);
        Self { origin: volume.min, cell_m, cells: vec![Cell::Empty; (SIDE * SIDE * SIDE) as usize] }
    }

    fn cell(&self, point: Vec3) -> UVec3 {
        ((point - self.origin) / self.cell_m).clamp(Vec3::ZERO, Vec3::splat(GRID)).as_uvec3()
    }

    fn occupy(&mut self, bounds: &Aabb) {
        let cells = cells_between(self.cell(bounds.min), self.cell(bounds.max));
        cells.for_each(|at| self.cells[number(at)] = Cell::Occupied);
    }

    /// In parts of about two cells: the box of a large triangle that is turned holds much that lies beside it.
    fn occupy_triangle(&mut self, [a, b, c]: [Vec3; 3], splits: u32) {
        let bounds = Aabb::around([a, b, c]);
        if splits == 0 || bounds.size().max_element() <= 2.0 * self.cell_m {
            return self.occupy(&bounds);
        }
        let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            self.occupy_triangle(part, splits - 1);
        }
    }

    /// The group of the cells that are connected with a point's; `next` where they have none yet.
    fn group_at(&mut self, point: Vec3, next: usize) -> usize {
        let mut reached = vec![self.cell(point)];
        if let Cell::Of(group) = self.cells[number(reached[0])] {
            return group;
        }
        // The point's own cell counts, whatever rounding says.
        self.cells[number(reached[0])] = Cell::Occupied;
        while let Some(at) = reached.pop() {
            if self.cells[number(at)] == Cell::Occupied {
                self.cells[number(at)] = Cell::Of(next);
                reached.extend(cells_between(at.saturating_sub(UVec3::ONE), (at + 1).min(UVec3::splat(SIDE - 1))));
            }
        }
        next
    }
}

fn cells_between(first: UVec3, last: UVec3) -> impl Iterator<Item = UVec3> {
    let rows = (first.z..=last.z).flat_map(move |z| (first.y..=last.y).map(move |y| (y, z)));
    rows.flat_map(move |(y, z)| (first.x..=last.x).map(move |x| UVec3::new(x, y, z)))
}

fn number(cell: UVec3) -> usize {
    ((cell.z * SIDE + cell.y) * SIDE + cell.x) as usize
}

fn area_m2(bounds: &Aabb) -> f32 {
    let size = bounds.size();
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
}
