//! Every shader is written out in every form that a pipeline may ask for, and validated.

use std::collections::BTreeMap;

use depth_image::Highlight;
use gpu::{ShaderInterface, ShaderSource, Templates};
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use reconstruction::{MAX_SAMPLE_CAMERAS, ShaderKey, shader_text};
use sampling::SamplingMethod;

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
    keys.flat_map(forms).flat_map(among_holes).flat_map(counting).collect()
}

/// What reads pyramids or cells is written out for sets with holes, too: see `has_holes` in `sample_set.rs`.
fn among_holes(key: ShaderKey) -> Vec<ShaderKey> {
    let reads = [
        "tile_start.wgsl",
        "march.wgsl",
        "joint_carve.wgsl",
        "light_field_search.wgsl",
        "specular.wgsl",
        "resolve.wgsl",
    ];
    let switches = if reads.contains(&key.name) { vec![false, true] } else { vec![false] };
    switches.into_iter().map(|holes| ShaderKey { holes, ..key }).collect()
}

/// Only what finds surfaces counts what it fetches.
fn counting(key: ShaderKey) -> Vec<ShaderKey> {
    let searches = ["march.wgsl", "joint_carve.wgsl", "light_field_search.wgsl", "resolve.wgsl"].contains(&key.name);
    let counted = if searches { vec![false, true] } else { vec![false] };
    counted.into_iter().map(|count_fetches| ShaderKey { count_fetches, ..key }).collect()
}

fn forms(key: ShaderKey) -> Vec<ShaderKey> {
    match key.name {
        "march.wgsl" => (0..key.cameras.min(2)).map(|march_camera| ShaderKey { march_camera, ..key }).collect(),
        "joint_carve.wgsl" => {
            STOP_LEVELS.map(|stop_level| ShaderKey { stop_level, march_camera: key.cameras, ..key }).collect()
        }
        "specular.wgsl" => [Highlight::BlinnPhong, Highlight::Ggx]
            .into_iter()
            .flat_map(|highlight| [(0, 0), (3, 0), (3, 1), (9, 3)].map(|(lights, words)| (highlight, lights, words)))
            .map(|(highlight, lights, visibility_words)| ShaderKey { highlight, lights, visibility_words, ..key })
            .collect(),
        "quads.wgsl" | "quad_indices.wgsl" => [false, true].map(|hybrid| ShaderKey { hybrid, ..key }).to_vec(),
        _ => vec![key],
    }
}

#[test]
fn reconstruction_shaders_are_valid_for_every_number_of_cameras() {
    let templates = Templates::new(reconstruction::SHADERS).expect("templates");
    let keys = reconstruction_keys();
    for key in &keys {
        let text = shader_text(&templates, *key).unwrap_or_else(|error| panic!("{key:?}: {error}"));
        let expected: &[&str] = if key.name == "quads.wgsl" { &["vertex", "fragment"] } else { &["main"] };
        assert_eq!(entries(&format!("{key:?}"), &text), expected, "{key:?}");
    }
    let shaders = keys.iter().map(|key| key.name).collect::<std::collections::BTreeSet<_>>();
    assert!(shaders.len() >= 5 && keys.len() >= shaders.len() * CAMERAS.len(), "{} texts", keys.len());
}

/// What pipelines of [`render::Renderer`] may ask for, with the redundancy tests of all sampling methods.
#[test]
fn every_variant_of_drawing_is_a_valid_shader() {
    let templates = sampling::templates().expect("templates");
    let tests: Vec<_> = SamplingMethod::all().filter_map(SamplingMethod::redundancy_test).collect();
    let mut texts = BTreeMap::<&str, usize>::new();
    for source in render::shader_sources(&templates, &tests) {
        let ShaderSource { name, template, wgsl, traits } = source.expect("a text");
        let entries = entries(&name, &wgsl);
        let expected: &[&str] = match template {
            "raster.wgsl" if entries.len() == 1 => &["vertex"],
            "raster.wgsl" => &["vertex", "fragment"],
            _ => &["main"],
        };
        assert_eq!(entries, expected, "{name}");
        ShaderInterface::of(template, &wgsl, traits).unwrap_or_else(|error| panic!("{name}: {error}"));
        *texts.entry(template).or_default() += 1;
    }
    let shaders = render::SHADERS.iter().filter(|(_, text)| has_entry(text)).map(|(name, _)| *name);
    for shader in shaders {
        assert!(texts.get(shader).is_some_and(|&count| count >= 2), "{shader}: {texts:?}");
    }
}

#[test]
fn every_part_is_part_of_a_shader() {
    for shaders in [reconstruction::SHADERS, render::SHADERS] {
        for (name, _) in shaders.iter().filter(|(_, text)| !has_entry(text)) {
            let include = format!("{{% include \"{name}\" %}}");
            assert!(shaders.iter().any(|(_, text)| text.contains(&include)), "{name} is unused");
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
