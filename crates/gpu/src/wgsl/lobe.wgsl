// Rays into the microfacet lobe of a surface. The includer has highlight.wgsl with GGX.

struct LobeRay { direction: vec3f, weight: f32 }

// The direction of a place in the unit square: GGX' visible normals (Heitz 2018) by spherical caps (Dupuy and Benyoub 2023). Its
// weight, G2 over G1, is what is left of the light without Fresnel's share: 0 below the surface.
fn lobe_ray(mirror: Mirror, place: vec2f) -> LobeRay {
    let alpha = ggx_alpha(mirror.reflector.roughness);
    let squared = alpha * alpha;
    let n_v = max(dot(mirror.normal, mirror.towards_eye), LEAST_COSINE);
    let around = tangents_of(mirror.normal);
    let eye = vec3f(dot(around.tangent, mirror.towards_eye), dot(around.bitangent, mirror.towards_eye), n_v);
    let stretched = unit_or_zero(vec3f(alpha * eye.xy, eye.z));
    let up = (1.0 - place.y) * (1.0 + stretched.z) - stretched.z;
    let across = sqrt(clamp(1.0 - up * up, 0.0, 1.0));
    let angle = 2.0 * LIGHT_PI * place.x;
    let cap = vec3f(cos(angle) * across, sin(angle) * across, up) + stretched;
    let towards = reflect(-eye, unit_or_zero(vec3f(alpha * cap.xy, cap.z)));
    let n_l = max(towards.z, 0.0);
    let weight = 2.0 * n_l * ggx_visibility(n_l, n_v, alpha) * (n_v + sqrt(n_v * n_v * (1.0 - squared) + squared));
    let direction = around.tangent * towards.x + around.bitangent * towards.y + mirror.normal * towards.z;
    return LobeRay(unit_or_zero(direction), weight);
}
