//! The bounding volume hierarchy: eight children a node, boxes in eight bits (Ylitie et al. 2017). `obvhs` builds
//! it; moving triangles are refitted here, for the crate refits only its two-child form.

use glam::{Vec3, Vec3A};
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode};
use obvhs::{BvhBuildParams, aabb::Aabb, ploc::PlocBuilder};

/// Most levels that the device's traversal has room for.
pub const MAX_DEPTH: u32 = 48;

/// A refitted tree whose rays meet this many times the boxes of a new one is built anew.
pub const WORST_REFIT: f32 = 1.3;

/// Triangles of a scene at one time, and the tree over them.
pub struct Bvh {
    pub tree: CwBvh,
    /// Levels of nodes.
    pub depth: u32,
    /// Expected node visits and triangle tests of a random ray through the scene's box (the surface area
    /// heuristic).
    pub cost: f32,
    /// The cost of the tree when it was built.
    pub cost_when_built: f32,
}

impl Bvh {
    /// Builds a tree over triangles, given by three points each.
    pub fn build(corners_in_world: &[[Vec3; 3]]) -> Self {
        let tree = bvh2_to_cwbvh(&two_children(corners_in_world), MOST_TRIANGLES_A_LEAF, true, false);
        let mut bvh = Self { tree, depth: 0, cost: 0.0, cost_when_built: 0.0 };
        bvh.refit(corners_in_world);
        bvh.cost_when_built = bvh.cost;
        bvh.depth = bvh.measured_depth();
        bvh
    }

    /// Fits the boxes to where the triangles are now. Children come after their parents, so that one pass from
    /// the last node to the first sees every box complete.
    pub fn refit(&mut self, corners_in_world: &[[Vec3; 3]]) {
        let mut bounds = vec![Aabb::empty(); self.tree.nodes.len()];
        let mut area_sum = 0.0;
        for index in (0..self.tree.nodes.len()).rev() {
            let children = self.child_bounds(index, &bounds, corners_in_world);
            let node = &mut self.tree.nodes[index];
            bounds[index] = children.iter().flatten().fold(Aabb::empty(), |all, child| all.union(child));
            area_sum += half_area(&bounds[index]) + leaf_area(node, &children);
            quantise(node, &bounds[index], &children);
        }
        self.cost = bounds.first().map_or(0.0, |root| area_sum / half_area(root).max(f32::MIN_POSITIVE));
    }

    /// Boxes have grown so that a new tree would be worth its time.
    pub fn is_worn(&self) -> bool {
        self.cost > self.cost_when_built * WORST_REFIT
    }

    fn child_bounds(&self, index: usize, nodes: &[Aabb], corners_in_world: &[[Vec3; 3]]) -> [Option<Aabb>; 8] {
        let node = &self.tree.nodes[index];
        std::array::from_fn(|child| {
            if node.is_child_empty(child) {
                return None;
            }
            if !node.is_leaf(child) {
                return Some(nodes[node.child_node_index(child) as usize]);
            }
            let (first, count) = node.child_primitives(child);
            let slots = self.tree.primitive_indices[first as usize..(first + count) as usize].iter();
            let boxes = slots.map(|&triangle| around(&corners_in_world[triangle as usize]));
            Some(boxes.fold(Aabb::empty(), |all, triangle| all.union(&triangle)))
        })
    }

    fn measured_depth(&self) -> u32 {
        let mut depths = vec![1u32; self.tree.nodes.len()];
        for (index, node) in self.tree.nodes.iter().enumerate() {
            for child in (0..8).filter(|&child| !node.is_child_empty(child) && !node.is_leaf(child)) {
                depths[node.child_node_index(child) as usize] = depths[index] + 1;
            }
        }
        depths.into_iter().max().unwrap_or(0)
    }
}

/// The format's.
const MOST_TRIANGLES_A_LEAF: u32 = 3;
/// Deeper trees of two children are not worth their steps, and conversion, which calls itself, has no room for them.
const DEEPEST: usize = 160;

/// A tree with two children a node: by cost, or by halves where triangles lie on one another in heaps, of which cost
/// makes chains.
fn two_children(corners_in_world: &[[Vec3; 3]]) -> Bvh2 {
    let boxes: Vec<Aabb> = corners_in_world.iter().map(around).collect();
    let plan = BvhBuildParams::medium_build();
    let all = (0..boxes.len() as u32).collect();
    let mut ploc = PlocBuilder::with_capacity(boxes.len());
    let mut tree = ploc.build(plan.ploc_search_distance, &boxes, all, plan.sort_precision, plan.search_depth_threshold);
    ReinsertionOptimizer::default().run(&mut tree, plan.reinsertion_batch_ratio, None);
    if levels(&tree) > DEEPEST { halved(&boxes) } else { tree }
}

fn levels(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut pending = vec![(0usize, 1usize)];
    while let Some((node, level)) = pending.pop() {
        deepest = deepest.max(level);
        let Bvh2Node { prim_count, first_index, .. } = tree.nodes[node];
        if prim_count == 0 {
            pending.extend([0, 1].map(|child| (first_index as usize + child, level + 1)));
        }
    }
    deepest
}

/// Halves of equal number along the widest axis, down to single triangles, of which conversion makes leaves.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut pending = vec![(0usize, 0..boxes.len())];
    while let Some((node, range)) = pending.pop() {
        let own = &mut order[range.clone()];
        let bounds = own.iter().fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]));
        if range.len() == 1 {
            nodes[node] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let axis = bounds.largest_axis();
        own.select_nth_unstable_by(range.len() / 2, |&a, &b| {
            let [a, b] = [a, b].map(|i| boxes[i as usize].min[axis] + boxes[i as usize].max[axis]);
            a.total_cmp(&b)
        });
        let first = nodes.len();
        let split = range.start + range.len() / 2;
        nodes.extend([Bvh2Node::default(); 2]);
        nodes[node] = Bvh2Node::new(bounds, 0, first as u32);
        pending.extend([(first, range.start..split), (first + 1, split..range.end)]);
    }
    Bvh2 { nodes, primitive_indices: order, ..Bvh2::default() }
}

fn around(corners: &[Vec3; 3]) -> Aabb {
    Aabb::from_points(&corners.map(Vec3A::from))
}

fn half_area(bounds: &Aabb) -> f32 {
    let size = bounds.diagonal().max(Vec3A::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Area of leaves, each as often as it has triangles.
fn leaf_area(node: &CwBvhNode, children: &[Option<Aabb>; 8]) -> f32 {
    let leaves = (0..8).filter(|&child| node.is_leaf(child));
    leaves.filter_map(|c| children[c].map(|b| half_area(&b) * node.child_primitives(c).1 as f32)).sum()
}

/// A share of a step of the eight-bit boxes: more than the rounding of a difference.
const ROUNDING: f32 = 1e-3;

/// Writes a node's box and its children's, rounded outwards.
fn quantise(node: &mut CwBvhNode, bounds: &Aabb, children: &[Option<Aabb>; 8]) {
    let size = bounds.diagonal().to_array();
    node.p = bounds.min.into();
    node.e = size.map(exponent);
    let scale = node.e.map(|e| f32::from_bits(u32::from(e) << 23));
    for (child, bounds_of_child) in children.iter().enumerate() {
        let Some(b) = bounds_of_child else { continue };
        let low = [0, 1, 2].map(|axis| ((b.min[axis] - bounds.min[axis]) / scale[axis] - ROUNDING).floor() as u8);
        let high = [0, 1, 2].map(|axis| ((b.max[axis] - bounds.min[axis]) / scale[axis] + ROUNDING).ceil() as u8);
        [node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]] = low;
        [node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]] = high;
    }
}

/// The biased exponent of the least power of two of which 255 span `size`.
fn exponent(size: f32) -> u8 {
    // 254 leaves room for rounding; the least exponent keeps flat boxes from dividing by zero.
    let step = (size / 254.0).max(1e-30);
    let bits = step.to_bits();
    let up = u32::from(bits & 0x7f_ffff != 0);
    ((bits >> 23) + up).min(254) as u8
}
