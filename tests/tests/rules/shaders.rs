//! Every variant of every pass is a valid shader.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use gpu::{ShaderError, ShaderInterface, ShaderSource};
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use rayon::prelude::*;
use sampling::SamplingMethod;

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

/// Checks each text once, on all cores: many variants have the same. `expected` are the names of the entry points of a
/// template's variants. Returns how many variants each template has.
fn check_all(
    sources: impl Iterator<Item = Result<ShaderSource, ShaderError>>,
    expected: impl Fn(&str, usize) -> &'static [&'static str] + Sync,
) -> BTreeMap<&'static str, usize> {
    let sources: Vec<ShaderSource> = sources.map(|source| source.expect("a text")).collect();
    let mut variants = BTreeMap::new();
    for source in &sources {
        *variants.entry(source.template).or_default() += 1;
    }
    let mut seen = HashSet::new();
    let different: Vec<&ShaderSource> =
        sources.iter().filter(|source| seen.insert((source.template, source.wgsl.as_str()))).collect();
    different.par_iter().for_each(|ShaderSource { name, template, wgsl, dynamic_uniforms }| {
        let entries = entries(name, wgsl);
        assert_eq!(entries, expected(template, entries.len()), "{name}");
        ShaderInterface::of(template, wgsl, dynamic_uniforms).unwrap_or_else(|error| panic!("{name}: {error}"));
    });
    variants
}

#[test]
fn every_variant_of_reconstruction_is_a_valid_shader() {
    let templates = reconstruction::templates().expect("templates");
    let found = check_all(reconstruction::shader_sources(&templates), |template, entries| match template {
        "draw.wgsl" if entries == 1 => &["vertex"],
        "draw.wgsl" => &["vertex", "fragment"],
        _ => &["main"],
    });
    let shaders = reconstruction::shaders().into_iter().filter(|(_, text)| has_entry(text));
    assert_eq!(found.into_keys().collect::<BTreeSet<_>>(), shaders.map(|(name, _)| name).collect());
}

/// All variants of pipelines of [`render::Renderer`], with the redundancy tests of all sampling methods.
#[test]
fn every_variant_of_drawing_is_a_valid_shader() {
    let templates = sampling::templates().expect("templates");
    let tests: Vec<_> = SamplingMethod::all().filter_map(SamplingMethod::redundancy_test).collect();
    let found = check_all(render::shader_sources(&templates, &tests), |template, entries| match template {
        "raster.wgsl" if entries == 1 => &["vertex"],
        "raster.wgsl" => &["vertex", "fragment"],
        _ => &["main"],
    });
    let shaders = render::SHADERS.iter().filter(|(_, text)| has_entry(text)).map(|(name, _)| *name);
    for shader in shaders {
        assert!(found.get(shader).is_some_and(|&count| count >= 2), "{shader}: {found:?}");
    }
}

#[test]
fn every_part_is_part_of_a_shader() {
    for shaders in [&reconstruction::shaders()[..], render::SHADERS] {
        for (name, _) in shaders.iter().filter(|(_, text)| !has_entry(text)) {
            let include = format!("{{% include \"{name}\" %}}");
            assert!(shaders.iter().any(|(_, text)| text.contains(&include)), "{name} is unused");
        }
    }
}

#[test]
fn faults_of_types_names_and_limits_are_seen() {
    assert!(checked("fn f() -> f32 { return 1.0; }").is_ok());
    assert!(checked("fn f() -> f32 { return 1u; }").is_err(), "types");
    assert!(checked("fn f() -> f32 { return g; }").is_err(), "names");
    assert!(checked("@compute @workgroup_size(0) fn main() {}").is_err(), "limits");
}
