// Lists of rays off mirrors, one for each mirror cell, of which a base is the last.

// Where the surfaces of a mirror cell lie. Smaller boxes come first.
struct MirrorBox {
    min_in_world: vec3f,
    // Where its list begins.
    first_listed: u32,
    max_in_world: vec3f,
    // In a cube a ray straight off a surface meets nothing nearer; in images, where this is 0, footprints tell.
    start_m: f32,
}

const MIRROR_CELLS: u32 = {{ mirror_cells }}u;

@group(0) var<uniform> mirror_boxes: array<MirrorBox, MIRROR_CELLS>;
@group(0) var<storage, read_write> next_rays: array<MirroredRay>;
@group(0) var<storage, read_write> next_listed: array<u32>;
struct NextList { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
// One for each mirror cell, and one that counts all rays.
@group(0) var<storage, read_write> next_lists: array<NextList, {{ mirror_cells + 1 }}>;

fn list_ray(cell: u32, ray: MirroredRay) {
    let number = atomicAdd(&next_lists[MIRROR_CELLS].count, 1u);
    let entry = atomicAdd(&next_lists[cell].count, 1u);
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&next_lists[cell].workgroups, 1u); }
    next_listed[mirror_boxes[cell].first_listed + entry] = number;
    next_rays[number] = ray;
}
