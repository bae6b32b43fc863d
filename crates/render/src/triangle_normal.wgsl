// A triangle's normal on the side that is seen; `across` has its direction or the opposite one, and any length.
fn triangle_normal_oct16(across: vec3f, from_eye: vec3f) -> u32 {
    let towards_eye = select(across, -across, dot(across, from_eye) > 0.0);
    return oct16_from_unit(towards_eye);
}
