// Which rays go into the lobes of rough surfaces.

// Rays of a pixel; the number of one of them.
struct LobeRays { count: u32, number: u32 }

@group(0) var<uniform> lobe_rays: LobeRays;

// Of noise: that of a place does not depend on the picture around it.
fn seed_of(point_in_world: vec3f) -> u32 {
    let bits = bitcast<vec3u>(point_in_world);
    return hashed(bits.x ^ hashed(bits.y ^ hashed(bits.z)));
}
