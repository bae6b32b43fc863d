// Samples of images on the device, and whether those around a point's place in an image lie on its surface.

// A sample image.
struct CacheCamera {
    // Takes a place, from the view's eye, to (column · w, row · w, w); w is planar depth.
    homogeneous_texel_from_offset: array<vec4f, 3>,
    // From the view's eye.
    eye_offset: vec3f,
    // A texel's side on a surface that faces the camera, in metres at a depth of one metre.
    footprint: f32,
    // World direction of a texel = column · x + row · y + corner; its parameter is planar depth in metres.
    column_in_world: vec3f,
    // The number of its first sample in the table.
    first_sample: u32,
    row_in_world: vec3f,
    // Half a step of the stored inverse depth.
    half_step_per_m: f32,
    corner_in_world: vec3f,
    near_m: f32,
    size_px: vec2u,
}

// When samples know the light of a point.
struct LookUpTests {
    // The coverage by one image's texels from which light is known.
    least_coverage: f32,
    // From the plane of a texel's triangle, at most.
    plane_footprints: f32,
    // Between normals of triangles, at least.
    least_cosine: f32,
    // Between the luminances of texels, at most, relative to the greatest.
    most_difference: f32,
}

struct Cache {
    shares: LampShares,
    tests: LookUpTests,
    // Images that are consulted.
    camera_count: u32,
    cameras: array<CacheCamera, MAX_CACHE_CAMERAS>,
}

@group(0) var<uniform> cache: Cache;
// Texels of a sample: inverse depth, the normals of its triangle and of shading, light of lamps; light of the environment, and
// packed shares.
@group(0) var samples: texture_2d<u32>;
// Of the picture whose surfaces are compared with samples.
@group(0) var triangle_normals: texture_2d<u32>;

// Texels of a sample in the table.
const SAMPLE_TEXELS: u32 = {{ sample_texels }}u;

struct Point {
    // From the view's eye.
    offset: vec3f,
    normal: vec3f,
    normal_oct16: u32,
    triangle_normal: vec3f,
    footprint_m: f32,
}

// A texel of an image: where its sample is in the table, and its bilinear weight, 0 where it does not count.
struct Texel { first: u32, weight: f32, words: vec4u }

// A point as seen from an image's eye, and the first of the texels around its place with its direction. `along_normal` is the
// offset's share along the point's normal.
struct Sight { offset: vec3f, along_normal: f32, direction: vec3f }

fn point_at(pixel: vec2u, planar_depth_m: f32, surface: vec4u) -> Point {
    return Point(
        direction_of(pixel) * planar_depth_m, unit_from_oct16(surface.z), surface.z,
        unit_from_oct16(textureLoad(triangle_normals, pixel, 0).x), planar_depth_m * camera.footprint,
    );
}

fn sight_of(image: CacheCamera, point: Point, first_texel: vec2f) -> Sight {
    let offset = point.offset - image.eye_offset;
    let direction = image.column_in_world * first_texel.x + image.row_in_world * first_texel.y + image.corner_in_world;
    return Sight(offset, dot(point.triangle_normal, offset), direction);
}

// A vector along an octahedral unit vector, of another length: a root less.
fn along_oct16(packed: u32) -> vec3f {
    let flat = unpack2x16snorm(packed);
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    return vec3f(select(flat, oct_wrapped(flat), z < 0.0), z);
}

// `half_step` is half a step of the stored inverse depth times the depth of the point: times the depth of the texel it is what the
// step moves the texel along its direction.
fn texel_beside(sight: Sight, first: u32, direction: vec3f, weight: f32, point: Point, plane_m: f32, half_step: f32) -> Texel {
    let words = textureLoad(samples, texel_at(first), 0);
    let inverse_depth_per_m = bitcast<f32>(words.x);
    let depth_m = 1.0 / max(inverse_depth_per_m, 1e-30);
    let normal = along_oct16(words.y);
    let squared = dot(normal, normal);
    let cosine = dot(normal, point.triangle_normal);
    let along_texel = dot(normal, direction);
    let along_point = dot(point.triangle_normal, direction);
    let from_texel_m = dot(normal, sight.offset) - depth_m * along_texel;
    let from_point_m = sight.along_normal - depth_m * along_point;
    let step_m = half_step * depth_m;
    let is_turned_alike = cosine > 0.0 && cosine * cosine >= cache.tests.least_cosine * cache.tests.least_cosine * squared;
    let is_in_plane = abs(from_texel_m) <= plane_m * sqrt(squared) + step_m * abs(along_texel)
        && abs(from_point_m) <= plane_m + step_m * abs(along_point);
    let counts = inverse_depth_per_m > 0.0 && is_turned_alike && is_in_plane;
    return Texel(first, select(0.0, weight, counts), words);
}
