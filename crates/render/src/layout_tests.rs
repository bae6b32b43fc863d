//! Structs shared with the shader have the shader's layout: naga's offsets against Rust's.

use std::collections::BTreeSet;
use std::mem::offset_of;

use bytemuck::Zeroable as _;
use gpu::{GpuTone, ShaderVariant as _, Templates};
use naga::front::wgsl::{Frontend, Options};
use naga::{TypeInner, valid::Capabilities};

use crate::finish::{Finish, GpuFinish};
use crate::gpu_scene::{GpuObject, GpuSurroundings};
use crate::illuminate::Illuminate;
use crate::keep::Keep;
use crate::known_samples::KnownCamera;
use crate::lamp_bits::{GpuLampMaps, GpuLampPoint, LampBits};
use crate::lamp_shares::GpuLampShares;
use crate::layered::{Crossing, GpuLines};
use crate::light_cache::LookUp;
use crate::light_samples::{GpuCache, GpuCacheCamera, LookUpTests};
use crate::pixel_camera::PixelCamera;
use crate::raster::{RasterCamera, RasterVariant};
use crate::redundancy_test::{Evidence, RedundancyTest};
use crate::reflections::{Lobe, Spawn, bounces::GpuBounce, lobe::GpuLobe};
use crate::shaders::templates;

const NEVER: &str = "fn is_redundant_with(c: Candidate, number: u32, camera: KnownCamera) -> bool { return false; }";

/// A test that finds nothing redundant.
const TEST: RedundancyTest =
    RedundancyTest { shader: "never.wgsl", consults: Evidence::Samples, from_one_place: false };

fn test_templates() -> Templates {
    templates(&[(TEST.shader, NEVER)]).expect("templates")
}

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
        let mut fields = vec![$((stringify!($field).to_owned(), offset_of!($host, $field))),+];
        // WGSL pads by itself.
        fields.retain(|(name, _)| name != "padding");
        Layout { fields, bytes: size_of::<$host>() }
    }};
}

fn parsed(variant: &impl gpu::ShaderVariant) -> naga::Module {
    let wgsl = gpu::source(&test_templates(), variant).expect("a text").wgsl;
    let mut options = Options::new();
    options.capabilities = Capabilities::all();
    let parsed = Frontend::new_with_options(options).parse(&wgsl);
    parsed.unwrap_or_else(|error| panic!("{}", error.emit_to_string(&wgsl)))
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

fn raster() -> naga::Module {
    parsed(&RasterVariant::with_tests(&[TEST]).next().expect("a variant"))
}

#[test]
fn structs_of_draws_have_the_wgsl_layout() {
    let camera = host!(RasterCamera { clip_from_world, eye_in_world, scene_time_s, near_m, footprint, padding });
    let object = host!(GpuObject {
        world_from_mesh,
        normal_from_mesh,
        base_color_linear,
        emissive_linear,
        alpha_cutoff,
        metallic,
        roughness,
        phong_reflector,
        instance,
        dielectric_linear,
        normal_scale,
        occlusion_strength,
        second_uv,
        alpha_hashed,
        scale
    });
    let lines = host!(GpuLines { forward_in_world, spacing_m, range_m, columns, least_share, capacity });
    let crossing = host!(Crossing { line, planar_depth_m, plane_normal_oct16, padding, surface });
    let appended = RasterVariant::all().into_iter().find(|variant| variant.appended);
    let appended = parsed(&appended.expect("a variant"));
    assert_eq!(lines, shader(&appended, "Lines"));
    assert_eq!(crossing, shader(&appended, "Crossing"));
    let surroundings = host!(GpuSurroundings { wind_direction, wind_amplitude_m, wind_waves_per_m, wind_frequency_hz });
    for (name, host) in [("RasterCamera", camera), ("Object", object), ("Surroundings", surroundings)] {
        assert_eq!(shader(&raster(), name), host, "{name}");
    }
}

#[test]
fn a_known_camera_has_the_wgsl_layout() {
    let host = host!(KnownCamera { homogeneous_pixel_from_own, eye_in_world, near_m, columns, rows, padding });
    assert_eq!(shader(&raster(), "KnownCamera"), host);
}

#[test]
fn cameras_on_lamps_have_the_wgsl_layout() {
    let maps =
        host!(GpuLampMaps { right_in_world, side_px, down_in_world, focal_x_px, forward_in_world, focal_y_px, points });
    let point = host!(GpuLampPoint { eye_in_world, near_m, principal_px, padding });
    let asked = LampBits::all().into_iter().find(|variant| variant.maps).expect("a variant");
    let asked = parsed(&asked);
    assert_eq!(shader(&asked, "LampMaps"), maps);
    assert_eq!(shader(&asked, "LampPoint"), point);
}

#[test]
fn a_pixel_camera_has_the_wgsl_layout() {
    let host = host!(PixelCamera {
        eye_in_world,
        near_m,
        column_in_world,
        footprint,
        row_in_world,
        first_word,
        corner_in_world,
        first_sum,
        size_px,
        first_from_axis,
        pixel_count,
        seed,
        first_shadow_ray,
        shadow_rays,
        first_ambient_ray,
        ambient_rays,
        shadow_rays_in_sum,
        ambient_rays_in_sum,
        occlusion_radius_m,
        first_row,
        end_row,
        first_light,
        end_light,
        grid_side,
        grid_count,
        grid_stride,
        first_pixel,
        bend_px_m,
        pole_px,
        farthest_m,
        padding
    });
    let bent = Illuminate::all()
        .into_iter()
        .find(|variant| variant.context().get_attr("single_pole").is_ok_and(|is| is.is_true()));
    assert_eq!(shader(&parsed(&bent.expect("a variant")), "PixelCamera"), host);
    let pinhole = shader(&parsed(&Keep::all().remove(0)), "PixelCamera");
    assert_eq!(pinhole.fields, host.fields[..host.fields.len() - 3], "those of single poles come last");
}

#[test]
fn a_bounce_has_the_wgsl_layout() {
    let host = host!(GpuBounce {
        point_in_world,
        place,
        direction,
        seed,
        throughput_linear,
        side_m,
        surface,
        bias_m,
        spread,
        roughness,
        curvature_per_m,
        met,
        near_m,
        unmirrored,
        padding
    });
    assert_eq!(shader(&parsed(&Spawn::all().remove(0)), "Bounce"), host);
}

#[test]
fn a_lobe_has_the_wgsl_layout() {
    assert_eq!(shader(&parsed(&Lobe::all().remove(0)), "Lobe"), host!(GpuLobe { first_ray, ray, ray_count, whole }));
}

#[test]
fn the_finish_and_its_tone_have_the_wgsl_layout() {
    let finish = host!(GpuFinish { tone, position, position_count, padding, shares });
    let GpuTone { exposure_factor: _, curve: _, padding: _ } = GpuTone::zeroed();
    let offsets = [offset_of!(GpuTone, exposure_factor), offset_of!(GpuTone, curve), offset_of!(GpuTone, padding)];
    for variant in Finish::all() {
        let module = parsed(&variant);
        assert_eq!(shader(&module, "Finish"), finish);
        let tone = shader(&module, "Tone");
        assert_eq!(tone.bytes, size_of::<GpuTone>());
        assert_eq!(tone.fields.iter().map(|(_, offset)| *offset).collect::<Vec<_>>(), offsets);
    }
}

#[test]
fn the_light_cache_has_the_wgsl_layout() {
    let module = parsed(&LookUp::all().remove(0));
    assert_eq!(shader(&module, "LampShares"), host!(GpuLampShares { lamps, lamp_count, padding }));
    let camera = host!(GpuCacheCamera {
        homogeneous_texel_from_offset,
        eye_offset,
        footprint,
        column_in_world,
        first_sample,
        row_in_world,
        half_step_per_m,
        corner_in_world,
        near_m,
        size_px,
        padding
    });
    assert_eq!(shader(&module, "CacheCamera"), camera);
    let cache = host!(GpuCache { shares, tests, camera_count, padding, cameras });
    assert_eq!(shader(&module, "Cache"), cache);
    let tests = host!(LookUpTests { least_coverage, plane_footprints, least_cosine, most_difference });
    assert_eq!(shader(&module, "LookUpTests"), tests);
}

#[test]
fn a_swapped_field_is_detected() {
    let other = naga::front::wgsl::parse_str("struct Other { b: vec4f, a: vec4f }").expect("a struct");
    #[derive(bytemuck::Zeroable, Clone, Copy)]
    #[repr(C)]
    struct Other {
        a: [f32; 4],
        b: [f32; 4],
    }
    assert_ne!(shader(&other, "Other"), host!(Other { a, b }));
}

/// The variables of passes that `Recording::bind` gives resources.
const BOUND: &[&str] = &[
    "asked",
    "asked_pixels",
    "background",
    "bounces",
    "bright_texels",
    "bvh_nodes",
    "cache",
    "camera",
    "cube",
    "cube_bricks",
    "cube_cells",
    "cube_entries",
    "cube_leaves",
    "environment_lobes",
    "environment_texels",
    "finish",
    "first_surfaces",
    "flat_details",
    "flat_triangles",
    "flat_vertices",
    "front_depth",
    "held",
    "illumination",
    "kept",
    "known_cameras",
    "known_samples",
    "lamp_bits",
    "lamp_maps",
    "list",
    "listed_pixels",
    "lobe",
    "maps",
    "materials",
    "next",
    "next_bounces",
    "position_sums",
    "reflected",
    "reversed_depth",
    "samples",
    "sums",
    "surface_ids",
    "surfaces",
    "texels",
    "triangle_corners",
    "triangle_normals",
    "weights",
    "words",
];

#[test]
fn every_variable_of_a_pass_has_a_resource() {
    let templates = test_templates();
    let mut declared = BTreeSet::new();
    for source in crate::shader_sources(&templates, &[TEST]) {
        let source = source.expect("a text");
        for line in source.wgsl.lines().filter_map(|line| line.trim().strip_prefix("@group(")) {
            let name = line.split(':').next().and_then(|named| named.rsplit(' ').next()).unwrap_or_default();
            let is_bound = source.template == "raster.wgsl" || BOUND.contains(&name);
            assert!(is_bound, "{}: {line}", source.name);
            declared.insert(name.to_owned());
        }
    }
    for name in crate::shaders::DYNAMIC_UNIFORMS {
        assert!(declared.contains(*name), "no shader declares {name}, which has a dynamic offset");
    }
}
