// The look of a triangle where a ray meets it: attributes between its corners, and textures by hand, for a
// shader cannot choose among samplers.

{% if mapped and alpha_tested %}
{% include "hashed_alpha.wgsl" %}
{% endif %}
struct Attributes {
    normal: vec3f,
    uv: vec2f,
    color_linear: vec4f,
{% if mapped %}
    second_uv: vec2f,
    tangent: vec4f,
    // In the mesh's space, in metres of the world.
    place_m: vec3f,
{% endif %}
}

// Texels of a material: base colour; emission and alpha cutoff; metallic, roughness, reflector and the uses of textures;
// dielectric reflectance and the normal map's scale; then, for each texture, its first texel and its packed size, with the
// occlusion's strength and the transmission after them; what a metre of the medium takes, and the refractive index.
fn vertex_texel(corner: u32) -> vec4u { return textureLoad(flat_vertices, texel_at(corner & VERTEX), 0); }
fn material_texel(material: u32, part: u32) -> vec4u { return textureLoad(materials, texel_at(material * MATERIAL_TEXELS + part), 0); }
{% if mapped %}
// Second coordinates and tangent; place in the mesh's space.
fn detail_texel(corner: u32, part: u32) -> vec4u { return textureLoad(flat_details, texel_at((corner & VERTEX) * 2u + part), 0); }

// The lowest bit of a packed tangent is the sign of the bitangent.
fn tangent_of(word: u32) -> vec4f { return vec4f(unit_from_oct16(word & 0xfffffffeu), select(1.0, -1.0, (word & 1u) != 0u)); }
{% endif %}

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
{% if mapped %}
    let corners = crossing.corners;
    let d0 = detail_texel(corners.x, 0u);
    let d1 = detail_texel(corners.y, 0u);
    let d2 = detail_texel(corners.z, 0u);
    let second_uv = bitcast<vec2f>(d0.xy) * first + bitcast<vec2f>(d1.xy) * crossing.second + bitcast<vec2f>(d2.xy) * crossing.third;
    let tangent = tangent_of(d0.z) * first + tangent_of(d1.z) * crossing.second + tangent_of(d2.z) * crossing.third;
    let p0 = bitcast<vec3f>(detail_texel(corners.x, 1u).xyz);
    let p1 = bitcast<vec3f>(detail_texel(corners.y, 1u).xyz);
    let p2 = bitcast<vec3f>(detail_texel(corners.z, 1u).xyz);
    return Attributes(normal, uv, color, second_uv, tangent, p0 * first + p1 * crossing.second + p2 * crossing.third);
{% else %}
    return Attributes(normal, uv, color);
{% endif %}
}

{% if mapped %}
// A texture's use: bit 0 is set for the second coordinates; bits 1 and 2 say what is beyond the borders along u, bits 3
// and 4 along v.
fn use_of(uses: u32, number: u32) -> u32 { return (uses >> (number * 5u)) & 31u; }

fn wraps_of(used: u32) -> vec2u { return vec2u(used >> 1u, used >> 3u) & vec2u(3u); }

// A place in the texture, from 0 to 1.
fn wrapped(uv: vec2f, used: u32) -> vec2f {
    let wraps = wraps_of(used);
    let back_and_forth = 1.0 - abs(1.0 - 2.0 * fract(uv * 0.5));
    let mirrored = select(fract(uv), back_and_forth, wraps == vec2u(MIRROR));
    return select(mirrored, clamp(uv, vec2f(0.0), vec2f(1.0)), wraps == vec2u(CLAMP));
}

fn texel(first: u32, size: vec2u, place: vec2i, used: u32) -> vec4f {
    let most = vec2i(size) - 1;
    let repeated = (place % vec2i(size) + vec2i(size)) % vec2i(size);
    let at = vec2u(select(clamp(place, vec2i(0), most), repeated, wraps_of(used) == vec2u(0u)));
    return unpack4x8unorm(textureLoad(texels, texel_at(first + at.y * size.x + at.x), 0).x);
}
{% else %}
// All textures have the first coordinates and are repeated.
fn use_of(uses: u32, number: u32) -> u32 { return 0u; }

fn wrapped(uv: vec2f, used: u32) -> vec2f { return fract(uv); }

fn texel(first: u32, size: vec2u, place: vec2i, used: u32) -> vec4f {
    let at = vec2u((place % vec2i(size) + vec2i(size)) % vec2i(size));
    return unpack4x8unorm(textureLoad(texels, texel_at(first + at.y * size.x + at.x), 0).x);
}
{% endif %}

// One level of a texture between its texels.
fn bilinear_texel(first: u32, size: vec2u, uv: vec2f, used: u32) -> vec4f {
    let at = wrapped(uv, used) * vec2f(size) - 0.5;
    let low = vec2i(floor(at));
    let share = at - floor(at);
    let upper = mix(texel(first, size, low, used), texel(first, size, low + vec2i(1, 0), used), share.x);
    let lower = mix(texel(first, size, low + vec2i(0, 1), used), texel(first, size, low + vec2i(1, 1), used), share.x);
    return mix(upper, lower, share.y);
}

// The colour of a texture whose first texel and packed size are given, white where there is none; `footprint` is a pixel's
// side on the surface, in units of the first and of the second uv: the level whose texels are about as large.
fn sampled(place: vec2u, used: u32, at: Attributes, footprints: vec2f) -> vec4f {
    let first_texel = place.x;
    let packed_size = place.y;
{% if mapped %}
    let second = (used & 1u) != 0u;
    let uv = select(at.uv, at.second_uv, second);
    let footprint = select(footprints.x, footprints.y, second);
{% else %}
    let uv = at.uv;
    let footprint = footprints.x;
{% endif %}
    var size = vec2u(packed_size & 0xffffu, packed_size >> 16u);
    var first = first_texel;
    let wanted = log2(max(footprint * f32(max(size.x, size.y)), 1e-6));
    for (var level = 0.5; level < wanted && max(size.x, size.y) > 1u; level += 1.0) {
        first += size.x * size.y;
        size = max(size / 2u, vec2u(1u));
    }
    return select(vec4f(1.0), bilinear_texel(first, max(size, vec2u(1u)), uv, used), packed_size != 0u);
}

fn base_color(material: u32, at: Attributes, footprints: vec2f) -> vec4f {
    let factor = bitcast<vec4f>(material_texel(material, 0u));
    let uses = material_texel(material, 2u).w;
    let encoded = sampled(material_texel(material, 4u).xy, use_of(uses, 0u), at, footprints);
    return factor * at.color_linear * vec4f(linear_from_srgb(encoded.rgb), encoded.a);
}

{% if primary %}
fn coat(material: u32, flags: u32, at: Attributes, footprints: vec2f) -> Coat {
    let factors = material_texel(material, 2u);
    let dielectric_linear = bitcast<vec3f>(material_texel(material, 3u).xyz);
    let metallic_roughness = sampled(material_texel(material, 4u).zw, use_of(factors.w, 1u), at, footprints);
    var open = 1.0;
{% if mapped %}
    let occlusion = material_texel(material, 6u);
    open += bitcast<f32>(occlusion.z) * (sampled(occlusion.xy, use_of(factors.w, 4u), at, footprints).r - 1.0);
{% endif %}
    return Coat(
        bitcast<f32>(factors.x) * metallic_roughness.b, bitcast<f32>(factors.y) * metallic_roughness.g, dielectric_linear,
        factors.z, (flags & UNLIT) != 0u, (flags & SPECULAR) != 0u, open,
    );
}

fn emission(material: u32, at: Attributes, footprints: vec2f) -> vec3f {
    let factor = bitcast<vec3f>(material_texel(material, 1u).xyz);
{% if mapped %}
    let uses = material_texel(material, 2u).w;
    let encoded = sampled(material_texel(material, 5u).zw, use_of(uses, 3u), at, footprints);
    return factor * linear_from_srgb(encoded.rgb);
{% else %}
    return factor;
{% endif %}
}

// The front's normal.
fn normal_at(material: u32, at: Attributes, footprints: vec2f) -> vec3f {
{% if mapped %}
    let uses = material_texel(material, 2u).w;
    let texel = sampled(material_texel(material, 5u).xy, use_of(uses, 2u), at, footprints);
    return mapped_normal(texel.xyz, bitcast<f32>(material_texel(material, 3u).w), at.normal, at.tangent);
{% else %}
    return normalize(at.normal + vec3f(0.0, 1e-20, 0.0));
{% endif %}
}

// The share of a texture that a pixel covers, from the triangle's own scale, on the first and the second coordinates.
fn uv_footprints(crossing: Crossing, slot: u32, side_m: f32) -> vec2f {
    let p0 = bitcast<vec3f>(corner_texel(slot * 3u).xyz);
    let e1 = bitcast<vec3f>(corner_texel(slot * 3u + 1u).xyz) - p0;
    let e2 = bitcast<vec3f>(corner_texel(slot * 3u + 2u).xyz) - p0;
    let corners = crossing.corners;
    let first = uv_area(vertex_texel(corners.x).yz, vertex_texel(corners.y).yz, vertex_texel(corners.z).yz);
    var areas = vec2f(first);
{% if mapped %}
    areas.y = uv_area(detail_texel(corners.x, 0u).xy, detail_texel(corners.y, 0u).xy, detail_texel(corners.z, 0u).xy);
{% endif %}
    return side_m * sqrt(areas / max(length(cross(e1, e2)), 1e-20));
}

fn uv_area(a: vec2u, b: vec2u, c: vec2u) -> f32 {
    let d1 = bitcast<vec2f>(b) - bitcast<vec2f>(a);
    let d2 = bitcast<vec2f>(c) - bitcast<vec2f>(a);
    return abs(d1.x * d2.y - d1.y * d2.x);
}
{% endif %}
