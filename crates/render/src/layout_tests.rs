//! Structs shared with the shader have the shader's layout: naga's offsets against Rust's.

use std::mem::offset_of;

use bytemuck::Zeroable as _;
use gpu::Templates;
use naga::TypeInner;

use crate::gpu_scene::{GpuLight, GpuObject, GpuSurroundings};
use crate::raster::RasterCamera;

/// Fields with their offsets, and the size of the whole.
#[derive(Debug, PartialEq, Eq)]
struct Layout {
    fields: Vec<(String, usize)>,
    bytes: usize,
}

/// A Rust struct's. A field that is not listed does not compile.
macro_rules! host {
    ($host:ident { $($field:ident),+ }) => {{
        let $host { $($field: _),+ } = $host::zeroed();
        Layout { fields: vec![$((stringify!($field).to_owned(), offset_of!($host, $field))),+], bytes: size_of::<$host>() }
    }};
}

fn module() -> naga::Module {
    let form = minijinja::context! { wind => true, lit => true, lights => 1, samples => true, double_sided => true, alpha_tested => true, textured => true, specular => true, normal => true, surface_id => false, normal_location => 1, id_location => 2 };
    let text =
        Templates::new(crate::SHADERS).and_then(|templates| templates.render("raster.wgsl", form)).expect("a text");
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)))
}

/// A WGSL struct's.
fn shader(module: &naga::Module, name: &str) -> Layout {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, naga::Type { inner: TypeInner::Struct { members, span }, .. })) = found else {
        panic!("no struct {name}")
    };
    let field = |member: &naga::StructMember| (member.name.clone().unwrap_or_default(), member.offset as usize);
    Layout { fields: members.iter().map(field).collect(), bytes: *span as usize }
}

#[test]
fn everything_shared_agrees() {
    let module = module();
    let shared = [
        ("RasterCamera", host!(RasterCamera { clip_from_world, eye_in_world, scene_time_s })),
        (
            "Object",
            host!(GpuObject {
                world_from_mesh,
                normal_from_mesh,
                base_color_linear,
                emissive_linear,
                alpha_cutoff,
                phong_specular,
                phong_exponent,
                instance,
                padding
            }),
        ),
        ("Light", host!(GpuLight { towards_or_position, intensity_linear })),
    ];
    for (name, host) in shared {
        assert_eq!(shader(&module, name), host, "{name}");
    }
    // The lights follow what is fixed.
    let fixed = host!(GpuSurroundings {
        ambient_linear,
        padding,
        wind_direction,
        wind_amplitude_m,
        wind_waves_per_m,
        wind_frequency_hz
    });
    let mut surroundings = shader(&module, "Surroundings");
    assert_eq!(surroundings.fields.pop(), Some(("lights".to_owned(), fixed.bytes)));
    assert_eq!(surroundings.fields, fixed.fields);
}

#[test]
fn a_field_out_of_place_is_seen() {
    let other = naga::front::wgsl::parse_str("struct Light { intensity_linear: vec4f, towards_or_position: vec4f }")
        .expect("a struct");
    assert_ne!(shader(&other, "Light"), host!(GpuLight { towards_or_position, intensity_linear }));
}
