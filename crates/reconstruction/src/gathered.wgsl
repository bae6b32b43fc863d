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

// Four samples by their shares. Means of encoded numbers are encoded means: nothing but the mean is decoded.
fn gathered(places: vec4u, shares: vec4f) -> Gathered {
    var normal = vec3f(0.0);
    var reflector = vec4f(0.0);
    var reflecting = 0.0;
{% for word in range(visibility_words) %}
    var visible{{ word }} = vec4f(0.0);
{% endfor %}
{% for corner in range(4) %}
    {
        let place = places[{{ corner }}];
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
