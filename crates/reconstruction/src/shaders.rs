//! The shaders' texts, written out for a number of cameras.

use depth_image::Highlight;
use gpu::{ShaderError, Templates, light_slots};
use minijinja::context;

use crate::{reflectors::sample_texels, word_texture};

/// All templates of this crate.
pub const SHADERS: &[(&str, &str)] = &[
    ("sample_set.wgsl", include_str!("sample_set.wgsl")),
    ("cell.wgsl", include_str!("cell.wgsl")),
    ("surface.wgsl", include_str!("surface.wgsl")),
    ("tile_start.wgsl", include_str!("tile_start.wgsl")),
    ("march.wgsl", include_str!("march.wgsl")),
    ("light_field_search.wgsl", include_str!("methods/light_field_search.wgsl")),
    ("joint_carve.wgsl", include_str!("methods/joint_carve.wgsl")),
    ("fill.wgsl", include_str!("fill.wgsl")),
    ("specular.wgsl", include_str!("specular.wgsl")),
    ("cut.wgsl", include_str!("cut.wgsl")),
    ("mesh.wgsl", include_str!("methods/mesh.wgsl")),
    ("hybrid_mesh.wgsl", include_str!("methods/hybrid_mesh.wgsl")),
    ("merge.wgsl", include_str!("merge.wgsl")),
    ("quad_count.wgsl", include_str!("quad_count.wgsl")),
    ("quad_scan.wgsl", include_str!("quad_scan.wgsl")),
    ("quad_indices.wgsl", include_str!("quad_indices.wgsl")),
    ("quads.wgsl", include_str!("quads.wgsl")),
    ("resolve.wgsl", include_str!("resolve.wgsl")),
];

/// The surface's thickness, in texel footprints: the best of a sweep (docs/methods/joint_carve.md).
pub(crate) const THICKNESS_FOOTPRINTS: f32 = 2.0;
/// How much a sample counts behind a surface that was left out.
pub(crate) const HIDDEN_WEIGHT: f32 = 0.02;
/// Moves of a carve in a set with holes.
pub(crate) const MOVES_AMONG_HOLES: u32 = 96;
/// The coarsest level that a pixel's own search uses; its tile has done the rest.
pub(crate) const START_LEVEL: u32 = 3;

/// Added to the squared angle between two lines of sight, so that no camera counts without end.
pub(crate) const ANGLE_FLOOR: f32 = 1e-2;

/// Of a surface against a line of sight, as a guessed corner has it: the tangent of 87.5°. Beyond, the corner runs to
/// infinity.
pub(crate) const GREATEST_SLOPE: f32 = 22.903_765;

/// A shader and all that is written into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ShaderKey {
    /// Among [`SHADERS`].
    pub name: &'static str,
    /// How many sample cameras.
    pub cameras: usize,
    /// See [`crate::ReconstructionMethod::JointCarve`].
    pub stop_level: u32,
    /// Which of a view's cameras, nearest first, is marched in; above 0 for every pass over a list of pixels.
    pub march_camera: usize,
    /// Whether fetches are counted for each pixel.
    pub count_fetches: bool,
    /// Whether some texels prove nothing of what lies before them.
    pub holes: bool,
    /// How surfaces reflect; of `specular.wgsl`, as what follows.
    pub highlight: Highlight,
    /// How many lights.
    pub lights: usize,
    /// How many words say which lights a sample sees; 0 where all do.
    pub visibility_words: usize,
    /// Whether each sample has a quad of its own; else quads lie between samples.
    pub hybrid: bool,
}

/// The WGSL of a shader.
///
/// # Errors
/// When a template is broken.
pub fn shader_text(templates: &Templates, key: ShaderKey) -> Result<String, ShaderError> {
    const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];
    let decimal = |v: f32| format!("{v:?}");
    let highlight = match key.highlight {
        Highlight::BlinnPhong => "blinn_phong",
        Highlight::Ggx => "ggx",
    };
    templates.render(
        key.name,
        context! {
            cameras => key.cameras,
            stop_level => key.stop_level,
            march_camera => key.march_camera,
            start_level => START_LEVEL.max(key.stop_level),
            count_fetches => key.count_fetches,
            holes => key.holes,
            holes_moves => MOVES_AMONG_HOLES,
            hidden_weight => decimal(HIDDEN_WEIGHT),
            thickness_footprints => decimal(THICKNESS_FOOTPRINTS),
            angle_floor => decimal(ANGLE_FLOOR),
            directions => DIRECTIONS,
            highlight,
            light_slots => light_slots(key.lights),
            visibility_words => key.visibility_words,
            sample_texels => sample_texels(key.visibility_words),
            hybrid => key.hybrid,
            greatest_slope => decimal(GREATEST_SLOPE),
            texture_width => word_texture::WIDTH,
        },
    )
}

#[cfg(test)]
mod tests {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;

    /// What is wrong with a text.
    fn fault(text: &str) -> Option<String> {
        let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let valid = |module| validator.validate(&module).map_err(|error| error.emit_to_string(text));
        module.and_then(valid).err()
    }

    #[test]
    fn specular_is_valid_for_any_light() {
        let templates = Templates::new(SHADERS).expect("templates");
        for (lights, words) in [(0, 0), (0, 1), (1, 0), (2, 1), (3, 1), (4, 2), (8, 3), (9, 0), (9, 3), (255, 64)] {
            for (highlight, cameras) in [(Highlight::BlinnPhong, 1), (Highlight::Ggx, 4), (Highlight::Ggx, 16)] {
                let key = ShaderKey { name: "specular.wgsl", cameras, highlight, lights, ..ShaderKey::default() };
                let key = ShaderKey { visibility_words: words, ..key };
                let text = shader_text(&templates, key).expect("a text");
                assert_eq!(fault(&text), None, "{key:?}");
            }
        }
        assert!(fault("fn f() -> f32 { return g; }").is_some());
    }
}
