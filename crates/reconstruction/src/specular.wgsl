// Adds the light that depends on the viewer to pixels that show a surface. Their colour so far is the light that the
// surface sends to all sides alike. The pass works on the finished view of any method.
//
// The samples around the point tell what a surface reflects: those of the contributing camera that is nearest to
// the view. A filled pixel shows no surface that a camera saw, and gets no highlight.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "light.wgsl" %}
{% include "highlight.wgsl" %}
{% include "view_work.wgsl" %}
{% include "cell.wgsl" %}

// Linear, as RGB9E5.
@group(0) var<storage, read_write> out_color: array<u32>;
@group(0) var<storage, read> inverse_depth: array<f32>;
@group(0) var<storage, read> provenance: array<u32>;
@group(0) var<uniform> illumination: Illumination;
// A normal, a reflector and the words of visibility for each sample, rounded up to whole texels: a load brings four
// words.
@group(0) var samples: texture_2d<u32>;

const SAMPLE_TEXELS: u32 = {{ sample_texels }}u;

// The mean of the samples around a point, packed as one sample, and the share of them that reflects.
struct Gathered { normal: vec3f, reflector: u32, visibility: VisibilityWords, reflecting: f32 }

fn sample_texel(sample: u32, texel: u32) -> vec4u {
    return textureLoad(samples, texel_at(sample * SAMPLE_TEXELS + texel), 0);
}

// On the octahedron, not the sphere: neighbours are near to each other, and their mean is brought to unit length
// once.
fn octahedral_from_oct16(packed: u32) -> vec3f {
    let flat = unpack2x16snorm(packed);
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    return vec3f(select(flat, oct_wrapped(flat), z < 0.0), z);
}

// The samples at a cell's corners, by their shares; `sample` is the upper left one's number. Means of encoded
// numbers are encoded means: nothing but the mean is decoded.
fn gathered(sample: u32, width_px: u32, shares: vec4f) -> Gathered {
    var normal = vec3f(0.0);
    var reflector = vec4f(0.0);
    var reflecting = 0.0;
{% for word in range(visibility_words) %}
    var visible{{ word }} = vec4f(0.0);
{% endfor %}
{% for corner in range(4) %}
    {
        let place = sample + {{ corner % 2 }}u + {{ corner // 2 }}u * width_px;
{% for texel in range(sample_texels) %}
        let words{{ texel }} = sample_texel(place, {{ texel }}u);
{% endfor %}
        let share = select(shares[{{ corner }}], 0.0, words0.y == 0u);
        normal += octahedral_from_oct16(words0.x) * share;
        reflector += unpack4x8unorm(words0.y) * share;
        reflecting += share;
{% for word in range(visibility_words) %}
        visible{{ word }} += unpack4x8unorm(words{{ (word + 2) // 4 }}[{{ (word + 2) % 4 }}]) * share;
{% endfor %}
    }
{% endfor %}
    let inverse = 1.0 / max(reflecting, 1e-6);
    var visibility: VisibilityWords;
{% for word in range(visibility_words) %}
    visibility[{{ word }}] = pack4x8unorm(visible{{ word }} * inverse);
{% endfor %}
    let all = max(dot(shares, vec4f(1.0)), 1e-6);
    return Gathered(unit_or_zero(normal), pack4x8unorm(reflector * inverse), visibility, reflecting / all);
}

{% if listed %}
{% include "pixel_list.wgsl" %}
{% endif %}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% if listed %}
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let pixel = place_of(index);
{% else %}
    let pixel = pixel_at(id);
    if any(pixel >= work.view.size_px) { return; }
    let index = work.view.first_pixel + pixel.y * work.view.size_px.x + pixel.x;
{% endif %}
    let origin = provenance[index];
    if (origin & 0xffu) != PROVENANCE_HIT { return; }
    let center = vec2f(pixel) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    let point_in_world = work.view.eye_in_world + direction / inverse_depth[index];
    // Cameras are sorted: of those that contributed, the last to be chosen is the nearest. On the software device one
    // camera by a variable index is cheaper than a choice among all.
    var nearest = 0u;
{% for k in range(cameras) | reverse %}
    nearest = select(nearest, {{ k }}u, (work.cameras[{{ k }}].mask & (origin >> 8u)) != 0u);
{% endfor %}
    let camera = work.cameras[nearest];
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let inverse_w = safe_reciprocal(p.z);
    let uv = clamp(p.xy * inverse_w - 0.5, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
    let cell = vec2u(uv);
    let at = uv - floor(uv);
    let cell_index = camera.first_cell + cell.y * camera.width_px + cell.x;
    let corners = corners_of(cell_index);
    // As in surface.wgsl: in a connected cell the surface itself counts, else each sample for itself.
    let code_above = camera.code_scale * inverse_w;
    let gaps = code_above + camera.code_offset - select(corners.codes, vec4f(bilinear(corners.codes, at)), corners.connected);
    let reach = vec4f(THICKNESS_FOOTPRINTS * code_above / camera.focal_px);
    let shares = select(vec4f(0.0), bilinear_shares(at), (abs(gaps) < reach) & (corners.codes > vec4f(1.5)));
    let around = gathered(cell_index, camera.width_px, shares);
    if around.reflecting <= 0.0 { return; }
    let towards_eye = unit_or_zero(-direction);
    let added = highlight(point_in_world, around.normal, towards_eye, around.reflector, around.visibility);
    out_color[index] = rgb9e5_from_linear(linear_from_rgb9e5(out_color[index]) + added * around.reflecting);
}
