//! The camera: a root pinhole and the frusta behind it.
//!
//! A frustum has an eye C and a convex face in the plane n · p = d. Its map is the central projection from C onto that plane, and then
//! the map of its parent. On points relative to the eyes both are 3 × 3 matrices, so that the map of each frustum is one:
//! `A · (p − C) = (column · w, row · w, w)`. It is scaled so that w is in metres along the frustum's own axis.

use std::collections::BTreeSet;

use depth_image::PinholeCamera;
use glam::{DMat3, DVec2, DVec3, UVec2};

use super::error::{FACE_CORNERS, GraphCameraError, MAX_FRUSTA, MAX_WALLS};
use super::plane::Plane;
use super::region;

/// Surfaces this far behind a wall belong to its frustum: walls are placed where surfaces are.
pub const WALL_SLACK_M: f64 = 0.01;
/// The greatest distance of a face's corner from its plane, and of a face from its parent's region.
const FACE_SLACK_M: f64 = 1e-5;
/// The far end of a pinhole.
const PINHOLE_FAR_M: f64 = 1e3;

/// The first frustum, as its maker describes it.
#[derive(Debug, Clone)]
pub struct RootPlan {
    /// Its image is the whole image of the nested layout.
    pub camera: PinholeCamera,
    pub walls: Vec<Plane>,
    /// Planar depth.
    pub far_m: f64,
}

/// A frustum behind the face of another.
#[derive(Debug, Clone)]
pub struct FrustumPlan {
    /// Among all frusta; the root is 0.
    pub parent: usize,
    pub eye_in_world: DVec3,
    /// The corners of the face in order, either way around.
    pub face: Vec<DVec3>,
    pub walls: Vec<Plane>,
    /// From the eye along the normal of the face.
    pub far_m: f64,
}

/// A camera, as its maker describes it. The root is frustum 0.
#[derive(Debug, Clone)]
pub struct GraphPlan {
    pub root: RootPlan,
    pub frusta: Vec<FrustumPlan>,
}

/// Where the frusta have their texels.
#[derive(Debug, Clone, PartialEq)]
pub enum Layout {
    /// One continuous image, the root's, as in the paper.
    Nested,
    /// A rectangle for each frustum, of its own size.
    Apart(Vec<UVec2>),
}

/// A frustum of a camera.
#[derive(Debug, Clone)]
pub struct Frustum {
    pub parent: Option<usize>,
    /// Faces on the way from the root.
    pub level: usize,
    pub eye_in_world: DVec3,
    /// Empty for the root.
    pub face: Vec<DVec3>,
    /// The plane through which rays enter.
    pub entry: Plane,
    /// All other planes of the region.
    pub walls: Vec<Plane>,
    /// The same with their surfaces, which are a part of the frustum.
    outer_walls: Vec<Plane>,
    /// A bit for each ancestor.
    ancestors: u64,
    pixel_from_eye: DMat3,
    eye_from_pixel: DMat3,
    children: Vec<usize>,
}

/// A graph camera whose frusta have been checked.
#[derive(Debug, Clone)]
pub struct GraphCamera {
    pub frusta: Vec<Frustum>,
    parts_px: Vec<UVec2>,
}

/// A pinhole: a root without frusta behind it.
///
/// # Errors
/// The camera cannot be used.
pub fn pinhole(camera: &PinholeCamera) -> anyhow::Result<GraphCamera> {
    let root = RootPlan { camera: *camera, walls: Vec::new(), far_m: PINHOLE_FAR_M };
    Ok(GraphCamera::new(&GraphPlan { root, frusta: Vec::new() }, &Layout::Nested)?)
}

/// A place in an image: the frustum, columns and rows of its part, and w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraphPlace {
    pub frustum: usize,
    pub pixel: DVec2,
    pub w_m: f64,
}

/// The part of a pixel's ray in one frustum: the points `eye + w · direction` for w in a span.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    pub frustum: usize,
    pub eye_in_world: DVec3,
    pub direction_in_world: DVec3,
    pub span_m: [f64; 2],
}

impl GraphCamera {
    /// # Errors
    /// The first frustum that cannot be used, or two that overlap.
    pub fn new(plan: &GraphPlan, layout: &Layout) -> Result<Self, GraphCameraError> {
        let GraphPlan { root, frusta: plans } = plan;
        root.camera.validate()?;
        if plans.len() >= MAX_FRUSTA {
            return Err(GraphCameraError::TooManyFrusta { frusta: plans.len() + 1 });
        }
        check_parents(plans)?;
        let mut frusta = vec![root_frustum(root)?];
        for plan in plans {
            let frustum = frusta.len();
            let child = child_frustum(frustum, plan, &frusta[plan.parent])?;
            frusta[plan.parent].children.push(frustum);
            frusta.push(child);
        }
        check_disjoint(&frusta)?;
        let parts_px = match layout {
            Layout::Nested => vec![root.camera.size_px],
            Layout::Apart(sizes_px) => {
                let own = frusta.iter_mut().zip(sizes_px);
                own.for_each(|(frustum, size_px)| frustum.be_apart(*size_px, root.camera.size_px));
                sizes_px.clone()
            }
        };
        Ok(Self { frusta, parts_px })
    }

    /// Sizes of the image's parts: one, or one for each frustum.
    pub fn parts_px(&self) -> &[UVec2] {
        &self.parts_px
    }

    /// The part of the image that has a frustum's texels.
    pub fn part(&self, frustum: usize) -> usize {
        if self.is_nested() { 0 } else { frustum }
    }

    pub fn is_nested(&self) -> bool {
        self.parts_px.len() == 1
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.parts_px.iter().map(|size_px| size_px.element_product() as usize).sum()
    }

    /// The frustum that a point lies in, or whose walls it lies on.
    pub fn frustum_of(&self, point_in_world: DVec3) -> Option<usize> {
        let depths = self.frusta.iter().map(|frustum| frustum.depth_m(point_in_world)).enumerate();
        let deepest = depths.max_by(|(_, a), (_, b)| a.total_cmp(b));
        deepest.filter(|(_, depth_m)| *depth_m >= -WALL_SLACK_M).map(|(frustum, _)| frustum)
    }

    /// The place of a point; `None` where no frustum is.
    pub fn project(&self, point_in_world: DVec3) -> Option<GraphPlace> {
        self.frustum_of(point_in_world).map(|frustum| self.project_in(frustum, point_in_world))
    }

    /// The place of a point in the image of one frustum, which may lie elsewhere.
    pub fn project_in(&self, frustum: usize, point_in_world: DVec3) -> GraphPlace {
        let at = self.frusta[frustum].homogeneous(point_in_world);
        GraphPlace { frustum, pixel: at.truncate() / at.z, w_m: at.z }
    }

    /// The point at a place.
    pub fn unproject(&self, place: GraphPlace) -> DVec3 {
        let frustum = &self.frusta[place.frustum];
        frustum.eye_in_world + frustum.direction(place.pixel) * place.w_m
    }

    /// The ray of a pixel, from frustum to frustum. Where frusta have parts of their own it ends with the first.
    pub fn pieces(&self, part: usize, pixel: DVec2) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut next = Some(part);
        while let Some(frustum) = next {
            let own = &self.frusta[frustum];
            let direction = own.direction(pixel);
            let Some([near_m, far_m]) = own.span(own.eye_in_world, direction, [0.0, f64::INFINITY]) else { break };
            let exit = self.exit(frustum, direction, [near_m, far_m]);
            let span_m = [near_m, exit.map_or(far_m, |(_, at_m)| at_m)];
            pieces.push(Piece { frustum, eye_in_world: own.eye_in_world, direction_in_world: direction, span_m });
            next = exit.map(|(child, _)| child).filter(|_| self.is_nested());
        }
        pieces
    }

    /// The face through which a ray from a frustum's eye leaves, and its w there.
    fn exit(&self, frustum: usize, direction: DVec3, [near_m, far_m]: [f64; 2]) -> Option<(usize, f64)> {
        let own = &self.frusta[frustum];
        let exits = own.children.iter().filter_map(|&child| {
            let face = &self.frusta[child];
            let at_m = -face.entry.depth_m(own.eye_in_world) / face.entry.inwards.dot(direction);
            let is_there = at_m >= near_m && at_m <= far_m && face.is_on_face(own.eye_in_world + direction * at_m);
            is_there.then_some((child, at_m))
        });
        exits.min_by(|(_, a), (_, b)| a.total_cmp(b))
    }
}

impl Frustum {
    /// How far a point lies inside of the region; negative outside.
    pub fn depth_m(&self, point_in_world: DVec3) -> f64 {
        region::depth_m(&self.walls, point_in_world).min(self.entry.depth_m(point_in_world))
    }

    /// The part of a line's span in the region, with the surfaces of its walls.
    pub fn span(&self, origin: DVec3, direction: DVec3, span: [f64; 2]) -> Option<[f64; 2]> {
        region::cut([&self.entry].into_iter().chain(&self.outer_walls), origin, direction, span)
    }

    /// Whether another frustum lies on the way from the root to this one.
    pub fn is_behind(&self, other: usize) -> bool {
        self.ancestors >> other & 1 == 1
    }

    /// Columns and rows times w, and w.
    pub fn homogeneous(&self, point_in_world: DVec3) -> DVec3 {
        self.pixel_from_eye * (point_in_world - self.eye_in_world)
    }

    /// The way from the eye to where w is 1 m.
    pub fn direction(&self, pixel: DVec2) -> DVec3 {
        self.eye_from_pixel * pixel.extend(1.0)
    }

    /// The side of a texel at w = 1 m, the longer one.
    pub fn footprint(&self) -> f64 {
        self.eye_from_pixel.x_axis.length().max(self.eye_from_pixel.y_axis.length())
    }

    /// All planes of the region.
    fn planes(&self) -> Vec<Plane> {
        [self.entry].into_iter().chain(self.walls.iter().copied()).collect()
    }

    /// The corners of the region.
    pub fn corners(&self) -> Vec<DVec3> {
        region::corners(&self.planes())
    }

    /// Whether a point of the face's plane lies on the face.
    fn is_on_face(&self, point: DVec3) -> bool {
        sides(self.eye_in_world, &self.face).iter().all(|side| side.depth_m(point) >= -FACE_SLACK_M)
    }

    /// Maps the face, or the root's whole image, to a rectangle of this size.
    fn be_apart(&mut self, size_px: UVec2, root_px: UVec2) {
        let size = size_px.as_dvec2();
        let pixel_from_eye = if self.face.is_empty() {
            let scale = size / root_px.as_dvec2();
            DMat3::from_diagonal(scale.extend(1.0)) * self.pixel_from_eye
        } else {
            face_map(self.eye_in_world, &self.face, self.entry, size)
        };
        self.set_map(pixel_from_eye);
    }

    fn set_map(&mut self, pixel_from_eye: DMat3) {
        let towards = pixel_from_eye.row(2);
        // w is positive in the region, and grows by a metre a metre.
        let middle = self.face.iter().sum::<DVec3>() / self.face.len().max(1) as f64;
        let is_behind = !self.face.is_empty() && towards.dot(middle - self.eye_in_world) < 0.0;
        let scale = if is_behind { -1.0 } else { 1.0 } / towards.length();
        self.pixel_from_eye = pixel_from_eye * scale;
        self.eye_from_pixel = self.pixel_from_eye.inverse();
    }
}

/// A map of points relative to the eye by their place on the face, as wide and high as the face's own bounds.
fn face_map(eye: DVec3, face: &[DVec3], plane: Plane, size: DVec2) -> DMat3 {
    let normal = plane.inwards;
    let level = if normal.y.abs() > 0.95 { DVec3::X } else { DVec3::Y };
    let right = normal.cross(level).normalize_or_zero();
    let away_m = -plane.depth_m(eye);
    let [columns, rows] = [(right, size.x), (normal.cross(right), size.y)].map(|(axis, pixels)| {
        let least = face.iter().map(|corner| axis.dot(*corner)).fold(f64::INFINITY, f64::min);
        let most = face.iter().map(|corner| axis.dot(*corner)).fold(f64::NEG_INFINITY, f64::max);
        // Along the axis: (d − n · C) axis · (p − C) + (axis · C − least) n · (p − C).
        (axis * away_m + normal * (axis.dot(eye) - least)) * (pixels / (most - least))
    });
    DMat3::from_cols(columns, rows, normal).transpose()
}

/// Planes through an eye and the edges of a face, which has its middle inside.
fn sides(eye: DVec3, face: &[DVec3]) -> Vec<Plane> {
    let middle = face.iter().sum::<DVec3>() / face.len() as f64;
    let edges = face.iter().zip(face.iter().cycle().skip(1));
    let planes = edges.map(|(a, b)| {
        let plane = Plane::through(eye, (a - eye).cross(b - eye));
        if plane.depth_m(middle) < 0.0 { Plane::through(eye, -plane.inwards) } else { plane }
    });
    planes.collect()
}

fn check_parents(plans: &[FrustumPlan]) -> Result<(), GraphCameraError> {
    for (frustum, plan) in (1..).zip(plans) {
        if plan.parent > plans.len() {
            return Err(GraphCameraError::NoSuchParent { frustum, parent: plan.parent });
        }
    }
    for (frustum, plan) in (1..).zip(plans) {
        let mut passed = BTreeSet::new();
        let mut next = Some(frustum);
        while let Some(at) = next {
            if !passed.insert(at) {
                return Err(GraphCameraError::Cycle { frustum: at });
            }
            next = at.checked_sub(1).map(|plan| plans[plan].parent);
        }
        if plan.parent > frustum {
            return Err(GraphCameraError::ParentAfterChild { frustum, parent: plan.parent });
        }
    }
    Ok(())
}

fn root_frustum(root: &RootPlan) -> Result<Frustum, GraphCameraError> {
    let camera = &root.camera;
    check_plan(0, camera.eye_in_world.as_dvec3(), &root.walls, root.far_m)?;
    let rows = camera.homogeneous_pixel_from_world().map(|row| row.truncate().as_dvec3());
    let eye = camera.eye_in_world.as_dvec3();
    let forward = rows[2].normalize_or_zero();
    let near_m = f64::from(camera.near_m);
    if root.far_m <= near_m {
        return Err(GraphCameraError::Far { frustum: 0, far_m: root.far_m });
    }
    let size = camera.size_px.as_dvec2();
    let mut walls = vec![Plane::through(eye + forward * root.far_m, -forward)];
    for (row, pixels) in [(rows[0], size.x), (rows[1], size.y)] {
        walls.extend([Plane::through(eye, row), Plane::through(eye, rows[2] * pixels - row)]);
    }
    walls.extend(&root.walls);
    let mut frustum = Frustum {
        parent: None,
        level: 0,
        eye_in_world: eye,
        face: Vec::new(),
        entry: Plane::through(eye + forward * near_m, forward),
        outer_walls: moved_out(&walls),
        walls,
        ancestors: 0,
        pixel_from_eye: DMat3::IDENTITY,
        eye_from_pixel: DMat3::IDENTITY,
        children: Vec::new(),
    };
    frustum.set_map(DMat3::from_cols(rows[0], rows[1], rows[2]).transpose());
    Ok(frustum)
}

fn check_plan(frustum: usize, eye: DVec3, walls: &[Plane], far_m: f64) -> Result<(), GraphCameraError> {
    let parts = [
        ("its eye", eye.is_finite()),
        ("a wall", walls.iter().all(Plane::is_finite)),
        ("its far end", far_m.is_finite()),
    ];
    if let Some((what, _)) = parts.into_iter().find(|(_, is_finite)| !is_finite) {
        return Err(GraphCameraError::NotFinite { frustum, what });
    }
    if walls.len() > MAX_WALLS {
        return Err(GraphCameraError::TooManyWalls { frustum, walls: walls.len() });
    }
    Ok(())
}

fn child_frustum(frustum: usize, plan: &FrustumPlan, parent: &Frustum) -> Result<Frustum, GraphCameraError> {
    let eye = plan.eye_in_world;
    check_plan(frustum, eye, &plan.walls, plan.far_m)?;
    let entry = entry_of(frustum, plan)?;
    let off_m = plan.face.iter().map(|corner| -parent.depth_m(*corner)).fold(0.0, f64::max);
    if off_m > FACE_SLACK_M {
        return Err(GraphCameraError::NotInParent { frustum, off_m });
    }
    let away_m = -entry.depth_m(eye);
    if plan.far_m <= away_m {
        return Err(GraphCameraError::Far { frustum, far_m: plan.far_m });
    }
    let mut walls = sides(eye, &plan.face);
    walls.push(Plane::through(eye + entry.inwards * plan.far_m, -entry.inwards));
    walls.extend(&plan.walls);
    let from_parent = eye - parent.eye_in_world;
    let projection = DMat3::from_diagonal(DVec3::splat(away_m)) + outer(from_parent, entry.inwards);
    let mut child = Frustum {
        parent: Some(plan.parent),
        level: parent.level + 1,
        eye_in_world: eye,
        face: plan.face.clone(),
        entry,
        outer_walls: moved_out(&walls),
        walls,
        ancestors: parent.ancestors | 1 << plan.parent,
        pixel_from_eye: DMat3::IDENTITY,
        eye_from_pixel: DMat3::IDENTITY,
        children: Vec::new(),
    };
    child.set_map(parent.pixel_from_eye * projection);
    Ok(child)
}

/// The plane of a face, with the eye outside.
fn entry_of(frustum: usize, plan: &FrustumPlan) -> Result<Plane, GraphCameraError> {
    let face = &plan.face;
    if !FACE_CORNERS.contains(&face.len()) {
        return Err(GraphCameraError::Corners { frustum, corners: face.len() });
    }
    if !face.iter().all(|corner| corner.is_finite()) {
        return Err(GraphCameraError::NotFinite { frustum, what: "its face" });
    }
    let turns: Vec<DVec3> = (0..face.len())
        .map(|at| {
            let [a, b, c] = [0, 1, 2].map(|next| face[(at + next) % face.len()]);
            (b - a).cross(c - b)
        })
        .collect();
    let normal = turns.iter().sum::<DVec3>().normalize_or_zero();
    let plane = Plane::through(face[0], normal);
    let off_m = face.iter().map(|corner| plane.depth_m(*corner).abs()).fold(0.0, f64::max);
    if off_m > FACE_SLACK_M {
        return Err(GraphCameraError::NotPlanar { frustum, off_m });
    }
    if turns.iter().any(|turn| turn.dot(normal) <= 0.0) {
        return Err(GraphCameraError::NotConvex { frustum });
    }
    let depth_m = plane.depth_m(plan.eye_in_world);
    if depth_m.abs() <= FACE_SLACK_M {
        return Err(GraphCameraError::EyeInFace { frustum });
    }
    Ok(if depth_m > 0.0 { Plane::through(face[0], -normal) } else { plane })
}

fn moved_out(walls: &[Plane]) -> Vec<Plane> {
    walls.iter().map(|wall| wall.moved_out(WALL_SLACK_M)).collect()
}

/// The matrix that maps v to `a (b · v)`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

fn check_disjoint(frusta: &[Frustum]) -> Result<(), GraphCameraError> {
    let planes: Vec<Vec<Plane>> = frusta.iter().map(Frustum::planes).collect();
    let corners: Vec<Vec<DVec3>> = planes.iter().map(|planes| region::corners(planes)).collect();
    for (second, own) in planes.iter().enumerate() {
        if corners[second].len() < 4 {
            return Err(GraphCameraError::Empty { frustum: second });
        }
        for first in 0..second {
            if !region::are_apart(&planes[first], own, [&corners[first], &corners[second]]) {
                return Err(GraphCameraError::Overlap { first, second });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "camera_tests.rs"]
mod tests;
