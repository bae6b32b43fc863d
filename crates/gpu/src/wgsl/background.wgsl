// The radiance of rays that leave the scene; the twin of depth-image's Environment::radiance_linear. With a map, the
// includer includes environment.wgsl.
{% if environment_map %}

fn background_linear(direction: vec3f) -> vec3f { return environment_radiance(normalize(direction)); }
{% else %}

struct Background { zenith_linear: vec3f, nadir_linear: vec3f }

@group(0) var<uniform> background: Background;

// A gradient from straight down to straight up, exact where both ends are equal. `direction` has any length.
fn background_linear(direction: vec3f) -> vec3f {
    let share = 0.5 + 0.5 * normalize(direction).y;
    return background.nadir_linear + (background.zenith_linear - background.nadir_linear) * share;
}
{% endif %}
