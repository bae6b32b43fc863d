// The surfaces of one camera, as raster.wgsl or primary.wgsl has left them: words of packed_surface.wgsl, and the near plane
// over planar depth, 0 where there is no surface.
@group(0) var surfaces: texture_2d<u32>;
@group(0) var reversed_depth: {{ "texture_2d<f32>" if by_rays else "texture_depth_2d" }};

fn surface_at(pixel: vec2u) -> vec4u { return textureLoad(surfaces, pixel, 0); }
fn reversed_depth_at(pixel: vec2u) -> f32 { return textureLoad(reversed_depth, pixel, 0){{ ".x" if by_rays else "" }}; }
