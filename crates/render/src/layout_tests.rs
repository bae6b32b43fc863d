//! Structs shared with the shader have the shader's layout: naga's offsets against Rust's.

use std::mem::offset_of;

use bytemuck::Zeroable as _;
use gpu::Templates;
use naga::TypeInner;

use crate::gpu_scene::{GpuObject, GpuSurroundings};
use crate::known::KnownCamera;
use crate::pixel_camera::PixelCamera;
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

fn parsed(name: &str, form: minijinja::Value) -> naga::Module {
    let test =
        ("known_test.wgsl", "fn is_known(c: Candidate, number: u32, camera: KnownCamera) -> bool { return false; }");
    let text = Templates::new(&[crate::SHADERS, &[test]].concat())
        .and_then(|templates| templates.render(name, form))
        .expect("a text");
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
    let form = minijinja::context! {
        wind => true, shading => "ggx", surface_id => false, double_sided => true, alpha_tested => true,
        textured => true, coat_textured => true, unlit => false, specular => true, leave_out => (), depth_only => false,
        test_traces_rays => false, settled => true, earlier => 0, known_group => 3,
    };
    let raster = parsed("raster.wgsl", form);
    let camera = parsed("camera.wgsl", minijinja::context! {});
    let test = minijinja::context! {
        leave_out => "known_test.wgsl", depth_only => false, test_traces_rays => false, settled => true, earlier => 2, known_group => 3,
    };
    let known = parsed("known.wgsl", test);
    let shared = [
        (
            &raster,
            "RasterCamera",
            host!(RasterCamera {
                clip_from_world,
                eye_in_world,
                scene_time_s,
                near_m,
                footprint,
                padding_0,
                padding_1
            }),
        ),
        (
            &raster,
            "Object",
            host!(GpuObject {
                world_from_mesh,
                normal_from_mesh,
                base_color_linear,
                emissive_linear,
                alpha_cutoff,
                metallic,
                roughness,
                phong_reflector,
                instance
            }),
        ),
        (
            &known,
            "KnownCamera",
            host!(KnownCamera {
                homogeneous_pixel_from_own,
                eye_in_world,
                footprint,
                column_in_world,
                columns,
                row_in_world,
                rows,
                near_m,
                padding_0,
                padding_1,
                padding_2
            }),
        ),
        (
            &raster,
            "Surroundings",
            host!(GpuSurroundings { wind_direction, wind_amplitude_m, wind_waves_per_m, wind_frequency_hz }),
        ),
        (
            &camera,
            "PixelCamera",
            host!(PixelCamera {
                eye_in_world,
                near_m,
                column_in_world,
                footprint,
                row_in_world,
                first_word,
                corner_in_world,
                first_sum,
                size_px,
                pixel_count,
                seed,
                first_shadow_ray,
                shadow_rays,
                first_occlusion_ray,
                occlusion_rays,
                shadow_rays_in_sum,
                occlusion_rays_in_sum,
                occlusion_radius_m,
                tolerance,
                first_from_axis,
                padding
            }),
        ),
    ];
    for (module, name, host) in shared {
        assert_eq!(shader(module, name), host, "{name}");
    }
}

#[test]
fn a_field_out_of_place_is_seen() {
    let other = naga::front::wgsl::parse_str("struct Other { b: vec4f, a: vec4f }").expect("a struct");
    #[derive(bytemuck::Zeroable, Clone, Copy)]
    #[repr(C)]
    struct Other {
        a: [f32; 4],
        b: [f32; 4],
    }
    assert_ne!(shader(&other, "Other"), host!(Other { a, b }));
}
