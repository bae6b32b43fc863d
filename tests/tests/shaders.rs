//! Every shader is written out in every form that a pipeline may ask for, and validated.

use gpu::Templates;
use minijinja::context;
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use reconstruction::{MAX_SAMPLE_CAMERAS, ShaderKey, shader_text};

const CAMERAS: [usize; 4] = [1, 2, 4, MAX_SAMPLE_CAMERAS];
/// The command line's: `joint_carve:0` to `joint_carve:8`.
const STOP_LEVELS: std::ops::RangeInclusive<u32> = 0..=8;

/// The module, and what is wrong with it otherwise.
fn checked(wgsl: &str) -> Result<naga::Module, String> {
    let mut options = Options::new();
    options.capabilities = Capabilities::all();
    let module = Frontend::new_with_options(options).parse(wgsl).map_err(|error| error.emit_to_string(wgsl))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    validator.validate(&module).map_err(|error| error.emit_to_string(wgsl))?;
    Ok(module)
}

/// A text with an entry point is a shader; the others are parts of shaders.
fn has_entry(template: &str) -> bool {
    ["@compute", "@vertex", "@fragment"].iter().any(|stage| template.contains(stage))
}

/// The names of a module's entry points, once it has passed.
fn entries(name: &str, wgsl: &str) -> Vec<String> {
    let module = checked(wgsl).unwrap_or_else(|error| panic!("{name}:\n{error}"));
    module.entry_points.into_iter().map(|entry| entry.name).collect()
}

/// All keys that pipelines are made for: see `passes` in `reconstructor.rs`.
fn reconstruction_keys() -> Vec<ShaderKey> {
    let entry_points = reconstruction::SHADERS.iter().filter(|(_, text)| has_entry(text));
    let keys =
        entry_points.flat_map(|&(name, _)| CAMERAS.map(|cameras| ShaderKey { name, cameras, ..ShaderKey::default() }));
    keys.flat_map(forms).flat_map(|key| [false, true].map(|count_fetches| ShaderKey { count_fetches, ..key })).collect()
}

fn forms(key: ShaderKey) -> Vec<ShaderKey> {
    match key.name {
        "march.wgsl" => (0..key.cameras.min(2)).map(|march_camera| ShaderKey { march_camera, ..key }).collect(),
        "joint_carve.wgsl" => {
            STOP_LEVELS.map(|stop_level| ShaderKey { stop_level, march_camera: key.cameras, ..key }).collect()
        }
        _ => vec![key],
    }
}

#[test]
fn reconstruction_shaders_are_valid_for_every_number_of_cameras() {
    let templates = Templates::new(reconstruction::SHADERS).expect("templates");
    let keys = reconstruction_keys();
    for key in &keys {
        let text = shader_text(&templates, *key).unwrap_or_else(|error| panic!("{key:?}: {error}"));
        assert_eq!(entries(&format!("{key:?}"), &text), ["main"], "{key:?}");
    }
    let shaders = keys.iter().map(|key| key.name).collect::<std::collections::BTreeSet<_>>();
    assert!(shaders.len() >= 5 && keys.len() >= shaders.len() * CAMERAS.len() * 2, "{} texts", keys.len());
}

#[test]
fn raster_shader_is_valid_in_every_form() {
    let templates = Templates::new(render::SHADERS).expect("templates");
    let mut texts = 0;
    for bits in 0..512u32 {
        let bit = |place: u32| bits >> place & 1 == 1;
        let (samples, normal, surface_id) = (bit(0), bit(1), bit(2));
        // Optional planes are of samples only.
        if !samples && (normal || surface_id) {
            continue;
        }
        let form = context! {
            samples, normal, surface_id, normal_location => 1, id_location => 1 + u32::from(normal),
            wind => bit(3), lit => bit(4), double_sided => bit(5), alpha_tested => bit(6), textured => bit(7),
            specular => bit(8), lights => bits % 4,
        };
        let text = templates.render("raster.wgsl", form).unwrap_or_else(|error| panic!("{bits:#b}: {error}"));
        assert_eq!(entries("raster.wgsl", &text), ["vertex", "fragment"], "{bits:#b}");
        texts += 1;
    }
    assert_eq!(texts, 320);
    assert!(render::SHADERS.iter().all(|(name, text)| *name == "raster.wgsl" || !has_entry(text)), "a new shader");
}

#[test]
fn every_part_is_part_of_a_shader() {
    for shaders in [reconstruction::SHADERS, render::SHADERS] {
        for (name, _) in shaders.iter().filter(|(_, text)| !has_entry(text)) {
            let include = format!("{{% include \"{name}\" %}}");
            assert!(shaders.iter().any(|(_, text)| has_entry(text) && text.contains(&include)), "{name} is unused");
        }
    }
}

#[test]
fn what_is_wrong_is_seen() {
    assert!(checked("fn f() -> f32 { return 1.0; }").is_ok());
    assert!(checked("fn f() -> f32 { return 1u; }").is_err(), "types");
    assert!(checked("fn f() -> f32 { return g; }").is_err(), "names");
    assert!(checked("@compute @workgroup_size(0) fn main() {}").is_err(), "limits");
}
