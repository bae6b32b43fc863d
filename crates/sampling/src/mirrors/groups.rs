//! Which surfaces of a scene belong together: those of one mirror, or of one object.

use std::collections::BTreeSet;

use depth_image::Aabb;
use glam::{UVec3, Vec3};
use scene::Scene;

/// Cells of a grid along the scene's longest side. Surfaces form one group where they touch the same cell or neighbouring cells.
const GRID: f32 = 32.0;
const SIDE: u32 = GRID as u32 + 1;
/// A triangle that is larger than two cells is split into four, and each part again, at most this many times.
const SPLITS: u32 = 5;

#[derive(Debug, Clone, Copy)]
pub(super) enum Surface {
    /// The corners of a triangle that stands still.
    Triangle([Vec3; 3]),
    /// The box of an instance that moves, over all moments.
    Moving(Aabb),
}

impl Surface {
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Triangle(corners) => Aabb::around(*corners),
            Self::Moving(bounds) => *bounds,
        }
    }

    fn center(&self) -> Vec3 {
        match self {
            Self::Triangle([a, b, c]) => (a + b + c) / 3.0,
            Self::Moving(bounds) => bounds.center(),
        }
    }
}

/// The surfaces of a scene whose materials are wanted.
pub(super) fn surfaces(scene: &Scene, is_wanted: &[bool], bounds_of_instances: &[Aabb]) -> Vec<Surface> {
    let moving = scene.animation.iter().flat_map(|animation| &animation.moving);
    let moving: BTreeSet<usize> = moving.map(|moving| moving.instance as usize).collect();
    let mut surfaces = Vec::new();
    for (number, (instance, bounds)) in scene.instances.iter().zip(bounds_of_instances).enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mut parts = mesh.parts.iter().filter(|part| is_wanted[part.material as usize]).peekable();
        if parts.peek().is_none() {
            continue;
        }
        if moving.contains(&number) || (scene.wind.is_some() && mesh.vertices.iter().any(|vertex| vertex.sway > 0.0)) {
            surfaces.push(Surface::Moving(*bounds));
            continue;
        }
        for part in parts {
            let indices = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
            for triangle in indices.as_chunks::<3>().0 {
                let corners = triangle.map(|index| Vec3::from(mesh.vertices[index as usize].position));
                let corners = corners.map(|corner| instance.world_from_mesh.transform_point3(corner));
                surfaces.push(Surface::Triangle(corners));
            }
        }
    }
    surfaces
}

/// Surfaces that touch one another, about.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub bounds: Aabb,
    pub area_m2: f64,
    /// The sum of the triangles' normals, each as long as the triangle's area.
    pub area_normal_m2: Vec3,
}

impl Group {
    const NONE: Self = Self { bounds: Aabb::EMPTY, area_m2: 0.0, area_normal_m2: Vec3::ZERO };

    fn add(&mut self, surface: &Surface) {
        match surface {
            Surface::Triangle([a, b, c]) => {
                let area_normal_m2 = 0.5 * (b - a).cross(c - a);
                self.area_normal_m2 += area_normal_m2;
                self.area_m2 += f64::from(area_normal_m2.length());
            }
            Surface::Moving(bounds) => self.area_m2 += f64::from(area_m2(bounds)),
        }
        self.bounds = Aabb::of_boxes(&[self.bounds, surface.bounds()]);
    }
}

/// The groups of surfaces, the largest first.
pub(super) fn groups(volume: &Aabb, surfaces: &[Surface]) -> Vec<Group> {
    let mut grid = Grid::over(volume);
    for surface in surfaces {
        match surface {
            Surface::Triangle(corners) => grid.occupy_triangle(*corners, SPLITS),
            Surface::Moving(bounds) => grid.occupy(bounds),
        }
    }
    let mut groups = Vec::new();
    for surface in surfaces {
        let number = grid.group_at(surface.center(), groups.len());
        if number == groups.len() {
            groups.push(Group::NONE);
        }
        groups[number].add(surface);
    }
    groups.sort_by(|a, b| area_m2(&b.bounds).total_cmp(&area_m2(&a.bounds)));
    groups
}

/// Which cells of a scene hold surfaces.
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
