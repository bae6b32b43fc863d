// What a layered depth cube shows at a place: between the four lines around it, of the samples that lie on one surface.

// A sample's colour, and the samples on its surface in the four neighbouring lines. Along the next axis: how far before and after its
// own number theirs are, in two halves of a word. Along the axis after that: their numbers, a word each.
@group(0) var cube_samples: texture_2d<u32>;

struct CubeSample { color_linear: vec3f, number: u32, links: vec3u }

fn cube_sample(number: u32) -> CubeSample {
    let words = textureLoad(cube_samples, texel_at(number), 0);
    return CubeSample(linear_from_rgb9e5(words.x), number, words.yzw);
}

// The sample of one surface on a neighbouring line; a sample is its own neighbour where there is none.
fn beside(own: CubeSample, is_after: bool) -> CubeSample {
    return cube_sample(select(own.number - (own.links.x & 0xffffu), own.number + (own.links.x >> 16u), is_after));
}

fn below(own: CubeSample, is_after: bool) -> CubeSample { return cube_sample(select(own.links.y, own.links.z, is_after)); }

// The samples around a place on a surface, their shares, and their colour.
struct AroundHit { samples: vec4u, shares: vec4f, color_linear: vec3f }

fn around_hit(hit: CubeHit) -> AroundHit {
    // Within the line's square, from its middle.
    let place = along(hit.axis, hit.off).yz;
    let is_after = place > vec2f(0.0);
    let own = cube_sample(hit.sample);
    let column = beside(own, is_after.x);
    let row = below(own, is_after.y);
    let corner = below(column, is_after.y);
    // What is not on the surface does not count.
    let found = vec3<bool>(column.number != own.number, row.number != own.number, corner.number != column.number);
    let at = min(abs(place), vec2f(0.5));
    let shares = vec4f((1.0 - at.x) * (1.0 - at.y), at.x * (1.0 - at.y), (1.0 - at.x) * at.y, at.x * at.y)
        * vec4f(1.0, select(0.0, 1.0, found.x), select(0.0, 1.0, found.y), select(0.0, 1.0, found.x && found.z));
    let sum = own.color_linear * shares.x + column.color_linear * shares.y + row.color_linear * shares.z + corner.color_linear * shares.w;
    let all = dot(shares, vec4f(1.0));
    return AroundHit(vec4u(own.number, column.number, row.number, corner.number), shares / all, sum / all);
}
