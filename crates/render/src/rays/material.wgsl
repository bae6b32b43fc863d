// The look of a triangle where a ray meets it: attributes between its corners, and textures by hand, for a
// shader cannot choose among samplers.

struct Attributes { normal: vec3f, uv: vec2f, color_linear: vec4f }

fn vertex_texel(corner: u32) -> vec4u { return textureLoad(flat_vertices, texel_at(corner & VERTEX), 0); }
fn material_texel(material: u32, part: u32) -> vec4u { return textureLoad(materials, texel_at(material * 4u + part), 0); }

fn vertex_color(word: u32) -> vec4f {
    let encoded = unpack4x8unorm(word);
    return vec4f(linear_from_srgb(encoded.rgb), encoded.a);
}

fn attributes_at(crossing: Crossing) -> Attributes {
    let v0 = vertex_texel(crossing.corners.x);
    let v1 = vertex_texel(crossing.corners.y);
    let v2 = vertex_texel(crossing.corners.z);
    let first = 1.0 - crossing.second - crossing.third;
    let normal = unit_from_oct16(v0.x) * first + unit_from_oct16(v1.x) * crossing.second + unit_from_oct16(v2.x) * crossing.third;
    let uv = bitcast<vec2f>(v0.yz) * first + bitcast<vec2f>(v1.yz) * crossing.second + bitcast<vec2f>(v2.yz) * crossing.third;
    let color = vertex_color(v0.w) * first + vertex_color(v1.w) * crossing.second + vertex_color(v2.w) * crossing.third;
    return Attributes(normal, uv, color);
}

// One texel of a mip level, repeated in both directions.
fn texel(first: u32, size: vec2u, place: vec2i) -> vec4f {
    let wrapped = vec2u((place % vec2i(size) + vec2i(size)) % vec2i(size));
    return unpack4x8unorm(textureLoad(texels, texel_at(first + wrapped.y * size.x + wrapped.x), 0).x);
}

fn bilinear_texel(first: u32, size: vec2u, uv: vec2f) -> vec4f {
    let at = fract(uv) * vec2f(size) - 0.5;
    let low = vec2i(floor(at));
    let share = at - floor(at);
    let upper = mix(texel(first, size, low), texel(first, size, low + vec2i(1, 0)), share.x);
    let lower = mix(texel(first, size, low + vec2i(0, 1)), texel(first, size, low + vec2i(1, 1)), share.x);
    return mix(upper, lower, share.y);
}

// The colour of a texture whose first texel and packed size are given, white where there is none; `footprint` is a pixel's
// side on the surface, in units of uv: the level whose texels are about as large.
fn sampled(first_texel: u32, packed_size: u32, uv: vec2f, footprint: f32) -> vec4f {
    var size = vec2u(packed_size & 0xffffu, packed_size >> 16u);
    var first = first_texel;
    let wanted = log2(max(footprint * f32(max(size.x, size.y)), 1e-6));
    for (var level = 0.5; level < wanted && max(size.x, size.y) > 1u; level += 1.0) {
        first += size.x * size.y;
        size = max(size / 2u, vec2u(1u));
    }
    return select(vec4f(1.0), bilinear_texel(first, max(size, vec2u(1u)), uv), packed_size != 0u);
}

fn base_color(material: u32, at: Attributes, footprint: f32) -> vec4f {
    let factor = bitcast<vec4f>(material_texel(material, 0u));
    let textures = material_texel(material, 3u);
    let encoded = sampled(textures.x, textures.y, at.uv, footprint);
    return factor * at.color_linear * vec4f(linear_from_srgb(encoded.rgb), encoded.a);
}

{% if primary %}
fn coat(material: u32, flags: u32, at: Attributes, footprint: f32) -> Coat {
    let factors = material_texel(material, 2u);
    let textures = material_texel(material, 3u);
    let metallic_roughness = sampled(textures.z, textures.w, at.uv, footprint);
    return Coat(
        bitcast<f32>(factors.x) * metallic_roughness.b, bitcast<f32>(factors.y) * metallic_roughness.g, factors.z,
        (flags & UNLIT) != 0u, (flags & SPECULAR) != 0u,
    );
}

// The share of the texture that a pixel covers, from the triangle's own scale.
fn uv_footprint(crossing: Crossing, slot: u32, side_m: f32) -> f32 {
    let p0 = bitcast<vec3f>(corner_texel(slot * 3u).xyz);
    let e1 = bitcast<vec3f>(corner_texel(slot * 3u + 1u).xyz) - p0;
    let e2 = bitcast<vec3f>(corner_texel(slot * 3u + 2u).xyz) - p0;
    let uv0 = bitcast<vec2f>(vertex_texel(crossing.corners.x).yz);
    let d1 = bitcast<vec2f>(vertex_texel(crossing.corners.y).yz) - uv0;
    let d2 = bitcast<vec2f>(vertex_texel(crossing.corners.z).yz) - uv0;
    let area = length(cross(e1, e2));
    return side_m * sqrt(abs(d1.x * d2.y - d1.y * d2.x) / max(area, 1e-20));
}
{% endif %}
