// Pixels that this pass leaves to the next (pixel_list.rs).
struct List { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32>, last_count: atomic<u32> }
@group(0) var<storage, read_write> listed_pixels: array<u32>;
@group(0) var<storage, read_write> list: List;

fn list_pixel(place: u32) {
    let entry = atomicAdd(&list.count, 1u);
    listed_pixels[entry] = place;
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&list.workgroups, 1u); }
}

// Pixels of another kind fill the list from its end: no workgroup has both.
fn list_pixel_last(place: u32) {
    let entry = atomicAdd(&list.last_count, 1u);
    listed_pixels[arrayLength(&listed_pixels) - 1u - entry] = place;
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&list.workgroups, 1u); }
}
