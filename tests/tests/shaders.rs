//! Every shader is written out in every form that a pipeline may ask for, and validated.

use std::collections::{BTreeMap, BTreeSet};

use gpu::{ShaderInterface, ShaderSource, Templates};
use minijinja::context;
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use render::{Asks, Domain, Form, LeaveOut, Pass, Shading, ShadowRays};
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

#[test]
fn every_variant_of_reconstruction_is_a_valid_shader() {
    let templates = reconstruction::templates().expect("templates");
    let mut found = BTreeSet::new();
    for source in reconstruction::shader_sources(&templates) {
        let ShaderSource { name, template, wgsl, traits } = source.expect("a text");
        let expected: &[&str] = if template == "draw.wgsl" { &["vertex", "fragment"] } else { &["main"] };
        assert_eq!(entries(&name, &wgsl), expected, "{name}");
        ShaderInterface::of(template, &wgsl, traits).unwrap_or_else(|error| panic!("{name}: {error}"));
        found.insert(template);
    }
    let shaders = reconstruction::shaders().into_iter().filter(|(_, text)| has_entry(text));
    assert_eq!(found, shaders.map(|(name, _)| name).collect());
}

#[test]
fn raster_shader_is_valid_in_every_form() {
    let templates = drawing_templates();
    for bits in 0..256u32 {
        let bit = |place: u32| bits >> place & 1 == 1;
        for shading in ["unlit", "blinn_phong", "ggx"] {
            let form = context! {
                shading, surface_id => bit(0), wind => bit(1), double_sided => bit(2), alpha_tested => bit(3),
                textured => bit(4), coat_textured => bit(5), unlit => bit(6), specular => bit(7),
                leave_out => (), depth_only => false, test_traces_rays => false, settled => false, earlier => 0, known_group => 3,
            };
            let text = templates.render("raster.wgsl", form).unwrap_or_else(|error| panic!("{bits:#b}: {error}"));
            assert_eq!(entries("raster.wgsl", &text), ["vertex", "fragment"], "{bits:#b}");
        }
    }
}

#[test]
fn raster_shader_is_valid_for_depth_alone() {
    let templates = drawing_templates();
    for bits in 0..8u32 {
        let bit = |place: u32| bits >> place & 1 == 1;
        let form = context! {
            shading => "ggx", surface_id => true, wind => bit(0), double_sided => true, alpha_tested => bit(1),
            textured => bit(2), coat_textured => true, unlit => false, specular => true,
            leave_out => (), depth_only => true, test_traces_rays => false, settled => false, earlier => 0, known_group => 3,
        };
        let text = templates.render("raster.wgsl", form).unwrap_or_else(|error| panic!("{bits:#b}: {error}"));
        let expected: &[&str] = if bit(1) { &["vertex", "fragment"] } else { &["vertex"] };
        assert_eq!(entries("raster.wgsl", &text), expected, "{bits:#b}");
    }
}

#[test]
fn raster_shader_is_valid_with_every_test_of_what_is_left_out() {
    let templates = drawing_templates();
    for test in leave_outs().into_iter().filter(|test| !test.traces_rays()) {
        for (earlier, wind) in [(1, false), (3, true), (15, false)] {
            let form = context! {
                shading => "ggx", surface_id => true, wind, double_sided => true, alpha_tested => true,
                textured => true, coat_textured => true, unlit => false, specular => true,
                leave_out => test.shader, depth_only => false, test_traces_rays => false, settled => test.settled, earlier,
                known_group => 3,
            };
            let text = templates.render("raster.wgsl", form).unwrap_or_else(|error| panic!("{test:?}: {error}"));
            assert_eq!(entries(test.shader, &text), ["vertex", "fragment"], "{test:?}");
        }
    }
}

fn leave_outs() -> Vec<LeaveOut> {
    let tests = SamplingMethod::ALL.into_iter().filter_map(SamplingMethod::leave_out);
    let both = |test: LeaveOut| [test, LeaveOut { settled: test.asks == Asks::Samples, ..test }];
    tests.flat_map(both).collect()
}

/// What pipelines of [`render::Renderer`] may ask for: every switch of a pass, with none, one and many lamps.
fn render_forms() -> Vec<Form> {
    const SHADING: [Shading; 3] = [Shading::Unlit, Shading::BlinnPhong, Shading::Ggx];
    let mut forms = Vec::new();
    for bits in 0..64u32 {
        let bit = |place: u32| bits >> place & 1 == 1;
        let traced = Form { stack: 16, alpha_tested: bit(0), by_rays: bit(1), ..Form::default() };
        for shading in SHADING {
            let primary = Form { pass: Pass::Primary, shading, surface_id: bit(2), count_visits: bit(3), ..traced };
            forms.push(primary);
            let apart = leave_outs().into_iter().map(Some);
            forms.extend(apart.map(|leave_out| Form { surface_id: true, leave_out, earlier: 3, ..primary }));
        }
        for light_count in [0, 1, 9] {
            let lit = Form { light_count, visibility: bit(2), ..traced };
            for shadow_rays in [ShadowRays::None, ShadowRays::One, ShadowRays::Many] {
                for domain in [Domain::All, Domain::Grid, Domain::List] {
                    let (occluded, continued) = (bit(3), bit(4));
                    forms.push(Form { pass: Pass::Illuminate, shadow_rays, domain, occluded, continued, ..lit });
                }
            }
            forms.push(Form { pass: Pass::Keep, ..traced });
            forms.push(Form { pass: Pass::Interpolate, step_px: 1 + bits % 2, ..lit });
            for shading in SHADING {
                let finish = Form { pass: Pass::Finish, shading, ..lit };
                let highlight = bit(3) && shading != Shading::Unlit;
                forms.push(Form { highlight, ..finish });
                forms.push(Form { samples: true, normal: true, reflector: bit(3), surface_id: bit(4), ..finish });
                forms.push(Form { samples: true, surface_id: bit(3), leave_out: leave_outs().pop(), ..finish });
            }
        }
    }
    forms
}

/// With the tests of what images leave out.
fn drawing_templates() -> Templates {
    Templates::new(&[render::SHADERS, &sampling::shaders()].concat()).expect("templates")
}

#[test]
fn compute_shaders_of_drawing_are_valid_in_every_form() {
    let templates = drawing_templates();
    let forms: BTreeMap<String, Form> = render_forms().into_iter().map(|form| (format!("{form:?}"), form)).collect();
    for (name, form) in forms {
        let text = render::shader_text(&templates, form).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(entries(&name, &text), ["main"], "{name}");
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
fn what_is_wrong_is_seen() {
    assert!(checked("fn f() -> f32 { return 1.0; }").is_ok());
    assert!(checked("fn f() -> f32 { return 1u; }").is_err(), "types");
    assert!(checked("fn f() -> f32 { return g; }").is_err(), "names");
    assert!(checked("@compute @workgroup_size(0) fn main() {}").is_err(), "limits");
}
