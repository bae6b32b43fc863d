//! Mirrors of a scene, and places of sample cameras for what they show.

use std::collections::BTreeSet;

use depth_image::{Aabb, MAX_MIRROR_CELLS, PinholeCamera, ROUGHEST_MIRROR};
use glam::{UVec2, UVec3, Vec3};
use scene::{Material, Scene, Texture};

/// Cells of a grid along the scene's longest side. Mirrors form one group where they touch the same cell or neighbouring cells.
const GRID: f32 = 32.0;
const SIDE: u32 = GRID as u32 + 1;
/// A triangle that is larger than two cells is split into four, and each part again, at most this many times.
const SPLITS: u32 = 5;
/// Boxes are wider than their mirrors on each side, in diagonals: depths of samples have errors.
const MARGIN: f32 = 0.01;
/// The field of view of a face of the cube around a mirror's middle: neighbours overlap.
const FACE_DEG: f32 = 94.0;
/// The field of view of further images.
const WIDE_DEG: f32 = 110.0;
/// The sides of images, in proportion.
const FACE_PX: UVec2 = UVec2::splat(148);
const WIDE_PX: UVec2 = UVec2::splat(256);
/// A mirror whose normals have a mean of this length is flat.
const FLAT: f32 = 0.9;
/// How far these lie from a flat mirror's middle, in half widths, and from another's.
const FLAT_ASIDE: f32 = 0.5;
const ASIDE: f32 = 0.6;
/// Texels of a roughness map that are looked at, along each side.
const TEXELS: u32 = 64;

/// A group of mirrors.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    /// Holds its surfaces at all moments.
    pub bounds: Aabb,
    /// For images of what it shows, of sizes in proportion. The mirror itself is not seen from within.
    pub cameras: Vec<PinholeCamera>,
}

/// The mirrors of a scene, the largest first, at most [`MAX_MIRROR_CELLS`]; and the number of those beyond.
#[must_use]
pub fn mirrors(scene: &Scene) -> (Vec<Mirror>, usize) {
    let is_mirror: Vec<bool> = scene.materials.iter().map(|material| mirrors_scene(scene, material)).collect();
    if !is_mirror.contains(&true) {
        return (Vec::new(), 0);
    }
    let of_instances = scene.bounds_of_instances();
    let volume = Aabb::of_boxes(&of_instances);
    let mut groups = groups(&volume, |each| for_each_surface(scene, &is_mirror, &of_instances, each));
    groups.sort_by(|a, b| area_m2(&b.bounds).total_cmp(&area_m2(&a.bounds)));
    let beyond = groups.split_off(groups.len().min(MAX_MIRROR_CELLS));
    let mirror = |group: Group| {
        let facing = group.area_normal_m2 / group.area_m2.max(f32::MIN_POSITIVE);
        let cameras = match facing.length() > FLAT {
            true => before_flat(&group.bounds, facing.normalize_or(Vec3::Y), volume.near_m()),
            false => all_around(&group.bounds, volume.center(), volume.near_m()),
        };
        Mirror { bounds: group.bounds.padded(group.bounds.size().length() * MARGIN), cameras }
    };
    (groups.into_iter().map(mirror).collect(), beyond.len())
}

/// Four images from the quarters of a flat mirror: what stands close before it hides little from all of them. And four along
/// it, from the middle.
fn before_flat(bounds: &Aabb, facing: Vec3, near_m: f32) -> Vec<PinholeCamera> {
    let right = facing.any_orthonormal_vector();
    // From the middle to the border of the mirror, which lies in its own plane however it is turned.
    let [right, up] = [right, facing.cross(right)].map(|axis| axis * (0.5 * bounds.size().dot(axis.abs())));
    let quarters = [-right - up, right + up, right - up, up - right]
        .map(|aside| looking((bounds.center() + aside * FLAT_ASIDE, near_m), facing, WIDE_DEG, WIDE_PX));
    let along = [right, -right, up, -up]
        .map(|along| looking((bounds.center(), near_m), along.normalize_or(facing), FACE_DEG, FACE_PX));
    quarters.into_iter().chain(along).collect()
}

/// Six images in all directions from the middle, and two from opposite sides towards the scene's middle, which see what
/// an object there hides.
fn all_around(bounds: &Aabb, middle_of_scene: Vec3, near_m: f32) -> Vec<PinholeCamera> {
    let middle = bounds.center();
    let towards = (middle_of_scene - middle).normalize_or(Vec3::Z);
    let right = towards.any_orthonormal_vector();
    let aside = (right + right.cross(towards)) * (0.5 * ASIDE * bounds.size().min_element());
    let pair = [-aside, aside].map(|aside| looking((middle + aside, near_m), towards, WIDE_DEG, WIDE_PX));
    faces(middle, near_m, FACE_PX).into_iter().chain(pair).collect()
}

/// Six images in all directions from one place.
#[must_use]
pub fn faces(eye_in_world: Vec3, near_m: f32, size_px: UVec2) -> Vec<PinholeCamera> {
    let directions = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    directions.map(|towards| looking((eye_in_world, near_m), towards, FACE_DEG, size_px)).collect()
}

/// An image from an eye in a direction. Nothing nearer than `near_m` is seen.
#[must_use]
pub fn looking((eye, near_m): (Vec3, f32), towards: Vec3, fov_deg: f32, size_px: UVec2) -> PinholeCamera {
    let up = if towards.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    let camera = PinholeCamera::looking_at(eye, eye + towards, up, fov_deg.to_radians(), size_px);
    PinholeCamera { near_m, ..camera }
}

/// A mirroring surface.
#[derive(Debug, Clone, Copy)]
enum Surface {
    /// A triangle that stands still, by its corners.
    Triangle([Vec3; 3]),
    /// The box of an instance that moves, over all moments.
    Moving(Aabb),
}

impl Surface {
    fn center(&self) -> Vec3 {
        match self {
            Self::Triangle([a, b, c]) => (a + b + c) / 3.0,
            Self::Moving(bounds) => bounds.center(),
        }
    }
}

/// Gives each mirroring surface of a scene to `each`.
fn for_each_surface(scene: &Scene, is_mirror: &[bool], of_instances: &[Aabb], each: &mut dyn FnMut(Surface)) {
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
            let indices = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
            let triangles = indices.as_chunks::<3>().0.iter();
            triangles.for_each(|triangle| each(Surface::Triangle(triangle.each_ref().map(corner))));
        }
    }
}

/// Surfaces that form one mirror.
#[derive(Debug, Clone, Copy)]
struct Group {
    bounds: Aabb,
    area_m2: f32,
    /// The sum of the triangles' normals, each as long as the triangle's area.
    area_normal_m2: Vec3,
}

impl Group {
    const NONE: Self = Self { bounds: Aabb::EMPTY, area_m2: 0.0, area_normal_m2: Vec3::ZERO };

    fn add(&mut self, surface: Surface) {
        let bounds = match surface {
            Surface::Triangle([a, b, c]) => {
                let area_normal_m2 = 0.5 * (b - a).cross(c - a);
                self.area_normal_m2 += area_normal_m2;
                self.area_m2 += area_normal_m2.length();
                Aabb::around([a, b, c])
            }
            Surface::Moving(bounds) => {
                self.area_m2 += area_m2(&bounds);
                bounds
            }
        };
        self.bounds = Aabb::of_boxes(&[self.bounds, bounds]);
    }
}

fn mirrors_scene(scene: &Scene, material: &Material) -> bool {
    let map = material.metallic_roughness_texture.and_then(|map| scene.textures.get(map.texture as usize));
    material.is_specular() && material.roughness * map.map_or(1.0, least_roughness) < ROUGHEST_MIRROR
}

/// The least green of texels that are spread over a texture.
fn least_roughness(texture: &Texture) -> f32 {
    let [columns, rows] = [texture.width_px, texture.height_px].map(|side| side.clamp(1, TEXELS));
    let texel = |at: u32| {
        let x = (at % columns) * texture.width_px / columns;
        let y = (at / columns) * texture.height_px / rows;
        texture.srgba8.get(4 * (y * texture.width_px + x) as usize + 1).copied().unwrap_or(u8::MAX)
    };
    f32::from((0..columns * rows).map(texel).min().unwrap_or(u8::MAX)) / 255.0
}

/// The groups of surfaces. `for_each` gives each surface to a function; it is called twice, so that none is kept.
fn groups(volume: &Aabb, for_each: impl Fn(&mut dyn FnMut(Surface))) -> Vec<Group> {
    let mut grid = Grid::over(volume);
    for_each(&mut |surface| match surface {
        Surface::Triangle(corners) => grid.occupy_triangle(corners, SPLITS),
        Surface::Moving(bounds) => grid.occupy(&bounds),
    });
    let mut groups = Vec::new();
    for_each(&mut |surface| {
        let number = grid.group_at(surface.center(), groups.len());
        if number == groups.len() {
            groups.push(Group::NONE);
        }
        groups[number].add(surface);
    });
    groups
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

#[cfg(test)]
mod tests {
    use scene::{Instance, Limits, MissingTextures, SceneSpec};

    use super::*;

    fn scene(name: &str) -> Scene {
        let spec: SceneSpec = name.parse().expect("a name");
        spec.load(&Limits::default(), MissingTextures::Refuse).expect("a scene")
    }

    #[test]
    fn mirrors_apart_from_each_other_have_a_box_each() {
        let (pebble, beyond) = mirrors(&scene("teapot-mirror"));
        assert_eq!((pebble.len(), beyond), (1, 0));
        let size = pebble[0].bounds.size();
        assert!((5.0..7.0).contains(&size.x) && (5.0..7.0).contains(&size.y), "{size}");
        let (pair, beyond) = mirrors(&scene("mirror-pair"));
        assert_eq!((pair.len(), beyond), (2, 0));
        assert!(pair.iter().all(|mirror| mirror.bounds.size().x < 0.3), "they are flat");
        assert!(pair[0].bounds.center().x * pair[1].bounds.center().x < 0.0, "on both sides");
        assert_eq!(mirrors(&scene("blocks")), (Vec::new(), 0));
    }

    #[test]
    fn the_largest_mirrors_are_followed_and_the_others_are_counted() {
        let mut many = scene("teapot-mirror");
        let first = many.instances[0];
        many.instances = (0..11)
            .map(|number| {
                let size = 1.0 - 0.05 * number as f32;
                let place = glam::Affine3A::from_translation(Vec3::X * (30.0 * number as f32));
                Instance { world_from_mesh: place * glam::Affine3A::from_scale(Vec3::splat(size)), ..first }
            })
            .collect();
        let (followed, beyond) = mirrors(&many);
        assert_eq!((followed.len(), beyond), (MAX_MIRROR_CELLS, 3));
        let places: Vec<f32> = followed.iter().map(|mirror| (mirror.bounds.center().x / 30.0).round()).collect();
        assert_eq!(places, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "the largest first");
    }

    #[test]
    fn images_of_a_flat_mirror_stand_in_its_plane_and_look_off_it() {
        let mut turned = scene("mirror-pair");
        for instance in &mut turned.instances {
            instance.world_from_mesh = glam::Affine3A::from_rotation_y(0.6) * instance.world_from_mesh;
        }
        for mirror in mirrors(&turned).0 {
            let facing = mirror.cameras[0].forward_in_world();
            let middle = mirror.bounds.center();
            for camera in &mirror.cameras {
                let off_m = (camera.eye_in_world - middle).dot(facing);
                assert!(off_m.abs() < 0.01, "{off_m} m off its plane");
                assert!(camera.near_m < 0.02 && mirror.bounds.grown_to(camera.eye_in_world) == mirror.bounds);
            }
            assert!((middle + facing).length() < middle.length(), "towards the other mirror");
        }
    }

    #[test]
    fn six_faces_see_every_direction() {
        let cameras = faces(Vec3::new(1.0, 2.0, 3.0), 0.01, UVec2::splat(64));
        let directions = (0..500).map(|i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            Vec3::new(sin, 0.0, cos) * (1.0 - y * y).sqrt() + Vec3::Y * y
        });
        for direction in directions {
            let point = Vec3::new(1.0, 2.0, 3.0) + direction * 5.0;
            let sees = |camera: &&PinholeCamera| camera.project(point).is_some_and(|at| camera.contains(at.pixel));
            assert!(cameras.iter().any(|camera| sees(&camera)), "{direction}");
        }
    }

    #[test]
    fn a_material_mirrors_where_its_roughness_map_is_smooth() {
        let mut textured = scene("blocks");
        let texels = [[0, 200, 0, 255]; 16].as_flattened().to_vec();
        textured.textures.push(Texture { width_px: 4, height_px: 4, is_srgb: false, srgba8: texels });
        let map = (textured.textures.len() as u32 - 1).into();
        textured.materials[0].metallic_roughness_texture = Some(map);
        textured.materials[0].roughness = 1.0;
        assert_eq!(mirrors(&textured).0, []);
        textured.textures.last_mut().expect("a texture").srgba8[4 * 5 + 1] = 20;
        assert!(!mirrors(&textured).0.is_empty());
    }
}
