// Tables in textures (table.rs): where the texel of an index lies.

fn texel_at(index: u32) -> vec2u {
    return vec2u(index & ((1u << {{ table_width_log2 }}u) - 1u), index >> {{ table_width_log2 }}u);
}
