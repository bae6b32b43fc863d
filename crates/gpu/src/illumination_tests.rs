//! light.wgsl and highlight.wgsl have the layout of their structs here, and say what their scalar twins say.

use std::{
    f32::consts::PI,
    mem::offset_of,
    sync::{Arc, OnceLock},
};

use bytemuck::Zeroable as _;
use depth_image::{
    Environment, EnvironmentLight, EnvironmentMap, Highlight, Illumination, Light, Lobe, Reflector, disc_from_square,
    environment_highlight_linear, highlight_linear, tangents_of,
};
use glam::{UVec2, Vec2, Vec3};
use minijinja::context;
use wgpu::BufferUsages;

use crate::{
    Binding, BufferPool, ComputePass, DevicePreference, DispatchSize, Frame, Gpu, GpuEnvironment, Shader, Templates,
    highlight_name,
    illumination::{GpuIllumination, GpuLight},
    illumination_bytes, light_slots,
};

/// One question to the device.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Question {
    point_in_world: [f32; 3],
    light: u32,
    normal: [f32; 3],
    reflector: u32,
    towards_eye: [f32; 3],
    padding: u32,
    place: [f32; 2],
    more_padding: [u32; 2],
    visibility: [u32; 4],
}

const SHADER: &str = "
{% include 'color.wgsl' %}
{% include 'table.wgsl' %}
{% include 'light.wgsl' %}
{% include 'highlight.wgsl' %}
struct Question {
    point_in_world: vec3f, light: u32, normal: vec3f, reflector: u32, towards_eye: vec3f, padding: u32,
    place: vec2f, more_padding: vec2u, visibility: vec4u,
}
@group(0) var<uniform> illumination: Illumination;
@group(0) var<storage, read> questions: array<Question>;
@group(0) var<storage, read_write> answers: array<vec4f>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) { return; }
    let q = questions[id.x];
    let incident = incident_from(illumination.lights[q.light], q.point_in_world, q.place);
    var words = VisibilityWords();
{% for word in range(visibility_words) %}    words[{{ word }}] = q.visibility[{{ word }}];
{% endfor %}
    let tangents = tangents_of(q.normal);
    let first = id.x * 16u;
    answers[first] = vec4f(incident.towards, incident.distance_m);
    answers[first + 1u] = vec4f(incident.irradiance_linear, 0.0);
    answers[first + 2u] = vec4f(environment_radiance(q.normal), 0.0);
    answers[first + 3u] = vec4f(environment_diffuse(q.normal), 0.0);
    answers[first + 4u] = vec4f(tangents.tangent, 0.0);
    answers[first + 5u] = vec4f(tangents.bitangent, 0.0);
    answers[first + 6u] = vec4f(disc_from_square(q.place), 0.0, 0.0);
    answers[first + 7u] = vec4f(highlight(q.point_in_world, q.normal, q.towards_eye, q.reflector, words), 0.0);
{% if environment_map %}
    answers[first + 8u] = vec4f(environment_base(q.normal), 0.0);
    answers[first + 9u] = vec4f(environment_base_diffuse(q.normal), 0.0);
    let bright = incident_from_bright(q.place);
    answers[first + 10u] = vec4f(bright.towards, bright.irradiance_linear.x);
{% endif %}
}
";

/// A power of two, as the sizes of pooled buffers.
type Answer = [[f32; 4]; 16];

fn text(kind: Highlight, lights: usize, visibility_words: usize, environment_map: bool) -> String {
    let highlight = highlight_name(kind);
    let light_slots = light_slots(lights);
    let form = context! { highlight, light_slots, visibility_words, environment_map };
    let templates = Templates::new(&[("test.wgsl", SHADER)]).expect("templates");
    templates.render("test.wgsl", form).expect("a text")
}

fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| Gpu::open(DevicePreference::Software).expect("a software device")).clone()
}

fn answers(kind: Highlight, illumination: &Illumination, words: usize, questions: &[Question]) -> Vec<Answer> {
    answers_under(None, kind, illumination, words, questions)
}

fn answers_under(
    map: Option<&EnvironmentMap>,
    kind: Highlight,
    illumination: &Illumination,
    words: usize,
    questions: &[Question],
) -> Vec<Answer> {
    let gpu = gpu();
    let text = text(kind, illumination.lights.len(), words, map.is_some());
    let shader = Shader::new(&gpu, "test", &text, &[]).expect("a shader");
    let environment = map.map(|map| GpuEnvironment::upload(&gpu, map).expect("a map"));
    let pass = ComputePass::new(&gpu, shader);
    let uniform = gpu.buffer_with("illumination", &illumination_bytes(illumination), BufferUsages::UNIFORM);
    let asked = gpu.buffer_with("questions", questions, BufferUsages::STORAGE);
    let pool = BufferPool::new(&gpu);
    let bytes = size_of_val(questions) as u64 / size_of::<Question>() as u64 * size_of::<Answer>() as u64;
    let out = pool.lend_storage("answers", bytes);
    let bindings = [("illumination", &uniform), ("questions", &asked), ("answers", &*out)];
    let mut bindings = bindings.map(|(name, buffer)| Binding::buffer(name, buffer)).to_vec();
    bindings.extend(environment.iter().flat_map(GpuEnvironment::bindings));
    let bound = pass.bind(0, bindings).expect("all names");
    let mut frame = Frame::begin(&gpu, "test", crate::Turn::default());
    pass.dispatch(&mut frame, &[&bound], DispatchSize::Invocations([questions.len() as u32, 1, 1]));
    let read = frame.read_back(&out, 0..bytes, pool.lend_host("answers", bytes));
    let result = frame.submit().and_then(crate::Submitted::wait).expect("a result");
    result.with(read, |answers: &[Answer]| answers[..questions.len()].to_vec()).expect("answers")
}

fn illumination() -> Illumination {
    let lights = vec![
        Light::Directional {
            towards_light_in_world: Vec3::new(0.36, 0.8, 0.48),
            irradiance_linear: Vec3::new(1.0, 0.9, 0.8),
            angular_radius_rad: 0.05,
        },
        Light::Point {
            position_in_world: Vec3::new(1.0, 2.0, 0.5),
            intensity_linear: Vec3::new(3.0, 2.0, 1.0),
            radius_m: 0.2,
        },
        Light::Spot {
            position_in_world: Vec3::new(-1.0, 2.0, 0.0),
            forward_in_world: Vec3::new(0.6, -0.8, 0.0),
            intensity_linear: Vec3::splat(4.0),
            inner_cone_rad: 0.3,
            outer_cone_rad: 0.7,
            radius_m: 0.05,
        },
        Light::Rectangle {
            center_in_world: Vec3::new(0.0, 3.0, 0.0),
            half_edges_in_world: [Vec3::X * 0.5, Vec3::Z * 0.8],
            radiance_linear: Vec3::new(1.0, 2.0, 3.0),
        },
    ];
    let environment = Environment::gradient(Vec3::new(0.3, 0.5, 0.9), Vec3::splat(0.1));
    Illumination { lights, environment }
}

/// Spread over what may be asked; the same every time.
fn questions() -> Vec<Question> {
    let random = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
    let direction = |i: u32| {
        let z = 2.0 * random(i) - 1.0;
        let turn = 2.0 * PI * random(i + 7);
        (Vec2::from_angle(turn) * (1.0 - z * z).sqrt()).extend(z)
    };
    (0..4000u32)
        .map(|i| Question {
            point_in_world: (Vec3::new(random(5 * i), random(5 * i + 1), random(5 * i + 2)) * 3.0 - 1.5).to_array(),
            light: i % 4,
            normal: direction(3 * i + 1).to_array(),
            reflector: i.wrapping_mul(747_796_405) | 0x2000_0000,
            towards_eye: direction(11 * i + 5).to_array(),
            padding: 0,
            place: [random(13 * i), random(17 * i + 3)],
            more_padding: [0; 2],
            visibility: [2_891_336_453, 22_695_477, 747_796_405, 1].map(|factor| i.wrapping_mul(factor)),
        })
        .collect()
}

fn share(words: usize, visibility: [u32; 4], place: usize) -> f32 {
    if words == 0 { 1.0 } else { (visibility[place / 4] >> (8 * (place % 4)) & 0xff) as f32 / 255.0 }
}

fn close(found: [f32; 4], expected: Vec3, slack: f32) -> bool {
    let found = Vec3::from_slice(&found[..3]);
    (found - expected).abs().max_element() <= slack * (1.0 + expected.abs().max_element())
}

#[test]
fn incident_light_equals_the_scalar_twins() {
    let illumination = illumination();
    let questions = questions();
    for (q, answer) in questions.iter().zip(answers(Highlight::Ggx, &illumination, 0, &questions)) {
        let place = Vec2::from(q.place);
        let incident = illumination.lights[q.light as usize].from_sample(q.point_in_world.into(), place);
        assert!(close(answer[0], incident.towards_light_in_world, 1e-4), "{q:?} {answer:?} {incident:?}");
        let distance_m = incident.distance_m.min(1e30);
        assert!((answer[0][3] / distance_m - 1.0).abs() < 1e-4, "{q:?} {answer:?} {incident:?}");
        assert!(close(answer[1], incident.irradiance_linear, 2e-3), "{q:?} {answer:?} {incident:?}");
        let normal = Vec3::from(q.normal);
        assert!(close(answer[2], illumination.environment.radiance_linear(normal), 1e-5));
        assert!(close(answer[3], illumination.environment.diffuse_linear(normal), 1e-5));
        let [tangent, bitangent] = tangents_of(normal);
        assert!(close(answer[4], tangent, 1e-4) && close(answer[5], bitangent, 1e-4), "{q:?} {answer:?}");
        assert!(close(answer[6], disc_from_square(place).extend(0.0), 1e-4), "{q:?} {answer:?}");
    }
}

/// Noise of every brightness, and suns.
fn noisy_map() -> EnvironmentMap {
    let size_px = UVec2::new(200, 90);
    let random = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
    let texel = |i: u32| {
        let color = Vec3::new(random(3 * i), random(3 * i + 1), random(3 * i + 2));
        if i % 997 == 5 { color * 900.0 } else { color }
    };
    let radiances: Vec<Vec3> = (0..size_px.element_product()).map(texel).collect();
    EnvironmentMap::new(size_px, &radiances).expect("a map")
}

#[test]
fn an_environment_maps_light_equals_the_scalar_twins() {
    let map = noisy_map();
    let questions = questions();
    let light = EnvironmentLight::of(&map);
    let lit = Illumination { environment: Environment::mapped(), ..illumination() };
    assert!(light.bright_texels.len() > 10);
    let found = answers_under(Some(&map), Highlight::Ggx, &lit, 2, &questions);
    // Rounding takes a direction or a point across the edge of a texel now and then.
    let mut other = [0; 5];
    for (q, answer) in questions.iter().zip(&found) {
        let [normal, eye] = [q.normal, q.towards_eye].map(Vec3::from);
        let reflector = Reflector::unpack(q.reflector).expect("a reflector");
        let visible = |place| share(2, q.visibility, place);
        let lamps = highlight_linear(Highlight::Ggx, &lit, &visible, q.point_in_world.into(), normal, eye, &reflector);
        let mirrored = environment_highlight_linear(&light, &map, normal, eye, &reflector) * visible(0);
        let bright = light.bright_incident(&map, q.place.into()).expect("bright texels");
        let checks = [
            close(answer[2], map.radiance_linear(normal), 5e-3),
            close(answer[3], light.lobe_linear(Lobe::Diffuse, normal), 1e-3)
                && close(answer[9], light.lobe_linear(Lobe::DiffuseBase, normal), 1e-3),
            close(answer[7], lamps + mirrored, 1e-2),
            close(answer[8], light.base_linear(&map, normal), 1e-5),
            close(answer[10], bright.towards_light_in_world, 1e-3)
                && (answer[10][3] / bright.irradiance_linear.x - 1.0).abs() < 1e-4,
        ];
        other.iter_mut().zip(checks).for_each(|(other, is_close)| *other += usize::from(!is_close));
    }
    assert!(other.iter().all(|&other| other <= questions.len() / 200), "{other:?} of {}", questions.len());
    assert!(found.iter().any(|answer| answer[7][0] > 0.1), "highlights");
}

#[test]
fn highlights_equal_the_scalar_twins() {
    let questions = questions();
    for kind in [Highlight::BlinnPhong, Highlight::Ggx] {
        // Unrolled, and as loops.
        for (lights, words) in [(4, 0), (3, 1), (4, 2), (11, 0), (11, 3)] {
            let four = illumination();
            let lights = four.lights.iter().copied().cycle().take(lights).collect();
            let illumination = Illumination { lights, ..four };
            let asked: Vec<Question> = questions.iter().map(|q| Question { light: 0, ..*q }).collect();
            let mut bright = 0;
            for (q, answer) in asked.iter().zip(answers(kind, &illumination, words, &asked)) {
                let reflector = Reflector::unpack(q.reflector).expect("a reflector");
                let expected = highlight_linear(
                    kind,
                    &illumination,
                    &|place| share(words, q.visibility, place),
                    q.point_in_world.into(),
                    q.normal.into(),
                    q.towards_eye.into(),
                    &reflector,
                );
                bright += usize::from(expected.max_element() > 0.01);
                assert!(close(answer[7], expected, 3e-3), "{kind:?}, {words} words: {q:?} {answer:?} {expected}");
            }
            assert!(bright > 500, "{kind:?}, {words} words: {bright} highlights");
        }
    }
}

#[test]
fn a_shifted_visibility_byte_is_detected() {
    let illumination = illumination();
    let questions = questions();
    let found = answers(Highlight::BlinnPhong, &illumination, 2, &questions);
    let differ = questions.iter().zip(found).filter(|(q, answer)| {
        let reflector = Reflector::unpack(q.reflector).expect("a reflector");
        let [point, normal, eye] = [q.point_in_world, q.normal, q.towards_eye].map(Vec3::from);
        let shifted = |place: usize| share(2, q.visibility, place - 1);
        let other = highlight_linear(Highlight::BlinnPhong, &illumination, &shifted, point, normal, eye, &reflector);
        !close(answer[7], other, 3e-3)
    });
    assert!(differ.count() > 500);
}

#[test]
fn degenerate_inputs_give_finite_light() {
    let mut illumination = illumination();
    illumination.lights[1] = Light::Point { position_in_world: Vec3::ZERO, intensity_linear: Vec3::ONE, radius_m: 0.1 };
    let directions = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0; 3]];
    let points = [[0.0; 3], [0.0, 3.0, 0.0], [-1.0, 2.0, 0.0], [1e6; 3]];
    let ways = directions.into_iter().flat_map(|n| directions.map(|e| (n, e)));
    let asked: Vec<Question> = (0..)
        .zip(ways.flat_map(|way| points.map(|point| (way, point))))
        .map(|(i, ((normal, towards_eye), point_in_world))| Question {
            point_in_world,
            light: i % 4,
            normal,
            reflector: 0x00ff_ffff,
            towards_eye,
            place: [0.5; 2],
            visibility: [!0; 4],
            ..Question::zeroed()
        })
        .collect();
    for kind in [Highlight::BlinnPhong, Highlight::Ggx] {
        for (q, answer) in asked.iter().zip(answers(kind, &illumination, 2, &asked)) {
            assert!(answer.as_flattened().iter().all(|v| v.is_finite()), "{kind:?}: {q:?} {answer:?}");
        }
    }
}

#[test]
fn highlights_are_black_without_reflector_or_light() {
    let asked: Vec<Question> = questions().iter().map(|q| Question { light: 0, reflector: 0, ..*q }).collect();
    let dark = Illumination::default();
    assert_eq!(illumination_bytes(&dark).len(), size_of::<GpuIllumination>() + size_of::<GpuLight>());
    for (lit, asked) in [(illumination(), asked), (dark, questions())] {
        let asked: Vec<Question> = asked.iter().map(|q| Question { light: 0, ..*q }).collect();
        assert!(answers(Highlight::Ggx, &lit, 0, &asked).iter().all(|answer| answer[7] == [0.0; 4]));
    }
}

/// Fields with their offsets, and the size of the whole.
type Layout = (Vec<(String, usize)>, usize);

/// A WGSL struct's.
fn shader(module: &naga::Module, name: &str) -> Layout {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
        panic!("no struct {name}")
    };
    let field = |member: &naga::StructMember| (member.name.clone().unwrap_or_default(), member.offset as usize);
    (members.iter().map(field).collect(), *span as usize)
}

/// A Rust struct's. A field that is not listed does not compile.
macro_rules! host {
    ($host:ident { $($field:ident),+ }) => {{
        let $host { $($field: _),+ } = $host::zeroed();
        (vec![$((stringify!($field).to_owned(), offset_of!($host, $field))),+], size_of::<$host>())
    }};
}

#[test]
fn host_structs_have_the_wgsl_layout() {
    for (lights, slots) in [(0, 1), (3, 3)] {
        let text = text(Highlight::Ggx, lights, 1, false);
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let light: Layout = host!(GpuLight {
            middle_in_world,
            kind,
            color_linear,
            extent,
            axis_in_world,
            outer_cosine,
            next_edge_in_world,
            cone_scale
        });
        assert_eq!(shader(&module, "Light"), light);
        let (mut fields, bytes) = host!(GpuIllumination { zenith_linear, light_count, nadir_linear, padding });
        fields.push(("lights".to_owned(), bytes));
        assert_eq!(shader(&module, "Illumination"), (fields, bytes + slots * light.1));
    }
}
