// Octahedral unit vectors; the twin of depth-image's encoding.rs.

fn oct_wrapped(v: vec2f) -> vec2f {
    return (1.0 - abs(v.yx)) * select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

fn oct16_from_unit(unit: vec3f) -> u32 {
    let n = unit / max(abs(unit.x) + abs(unit.y) + abs(unit.z), 1e-20);
    let folded = select(n.xy, oct_wrapped(n.xy), n.z < 0.0);
    return pack2x16snorm(folded);
}

fn unit_from_oct16(packed: u32) -> vec3f {
    let flat = unpack2x16snorm(packed);
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let xy = select(flat, oct_wrapped(flat), z < 0.0);
    return normalize(vec3f(xy, z));
}
