// Bytes of visibility: the environment's, then the lamps'.
fn visibility_word(word: u32, place: u32, open: f32) -> u32 {
    var shares = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let plane = word * 4u + i;
        if plane >= {{ light_count + 1 }}u { break; }
        let rays = select(camera.shadow_rays_in_sum, camera.ambient_rays_in_sum, plane == 0u);
        shares[i] = sum_at(OPEN_TO_ENVIRONMENT + plane, place) * select(1.0, open, plane == 0u) / f32(rays);
    }
    return pack4x8unorm(shares);
}
