//! Structs shared with the shaders have the shaders' layout: naga's offsets against Rust's.

use std::mem::offset_of;

use bytemuck::Zeroable as _;
use gpu::Templates;
use naga::TypeInner;

use crate::{
    SHADERS, ShaderKey,
    layout::{GpuCutWork, GpuFillWork, GpuList, GpuQuadWork, GpuSampleCamera, GpuViewCamera, GpuViewWork, GpuVolume},
    shader_text,
};

const CAMERAS: usize = 4;

/// Fields with their offsets, and the size of the whole.
#[derive(Debug, PartialEq, Eq)]
struct Layout {
    fields: Vec<(String, usize)>,
    bytes: usize,
}

impl Layout {
    fn new<const N: usize>(fields: [(&str, usize); N], bytes: usize) -> Self {
        Self { fields: fields.map(|(name, offset)| (name.to_owned(), offset)).to_vec(), bytes }
    }
}

/// A Rust struct's. A field that is not listed does not compile.
macro_rules! host {
    ($host:ident { $($field:ident),+ }) => {{
        let $host { $($field: _),+ } = $host::zeroed();
        Layout::new([$((stringify!($field), offset_of!($host, $field))),+], size_of::<$host>())
    }};
}

fn module(name: &'static str) -> naga::Module {
    let templates = Templates::new(SHADERS).expect("templates");
    let march_camera = if name == "joint_carve.wgsl" { CAMERAS } else { 0 };
    let key = ShaderKey { name, cameras: CAMERAS, march_camera, ..ShaderKey::default() };
    let text = shader_text(&templates, key).expect("a text");
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&text)))
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

fn view_camera() -> Layout {
    host!(GpuViewCamera {
        eye_in_world,
        near_m,
        column_in_world,
        focal_px,
        row_in_world,
        first_pixel,
        corner_in_world,
        first_tile,
        size_px,
        steps,
        number
    })
}

fn sample_camera() -> Layout {
    host!(GpuSampleCamera {
        homogeneous_pixel_from_world,
        eye_in_world,
        code_scale,
        cells,
        code_offset,
        focal_px,
        log2_sides,
        first_node,
        first_cell,
        width_px,
        stretch,
        mask,
        padding
    })
}

/// Of the volume the shader has the fields, not the struct; the cameras follow.
fn view_work() -> Layout {
    let GpuViewWork { view: _, volume: _ } = GpuViewWork::zeroed();
    let GpuVolume { min_in_world: _, background_srgb8: _, max_in_world: _, padding: _ } = GpuVolume::zeroed();
    let volume = offset_of!(GpuViewWork, volume);
    let fields = [
        ("view", offset_of!(GpuViewWork, view)),
        ("volume_min_in_world", volume + offset_of!(GpuVolume, min_in_world)),
        ("background_srgb8", volume + offset_of!(GpuVolume, background_srgb8)),
        ("volume_max_in_world", volume + offset_of!(GpuVolume, max_in_world)),
        ("padding", volume + offset_of!(GpuVolume, padding)),
        ("cameras", size_of::<GpuViewWork>()),
    ];
    Layout::new(fields, size_of::<GpuViewWork>() + CAMERAS * size_of::<GpuSampleCamera>())
}

/// Indirect arguments by name in the shaders, three in a row on the host.
fn list() -> Layout {
    let GpuList { workgroups: _, count: _ } = GpuList::zeroed();
    let first = offset_of!(GpuList, workgroups);
    let fields = [("workgroups", first), ("y", first + 4), ("z", first + 8), ("count", offset_of!(GpuList, count))];
    Layout::new(fields, size_of::<GpuList>())
}

#[test]
fn views_and_sample_cameras_agree_in_every_search() {
    for name in [
        "tile_start.wgsl",
        "march.wgsl",
        "joint_carve.wgsl",
        "light_field_search.wgsl",
        "specular.wgsl",
        "resolve.wgsl",
    ] {
        let module = module(name);
        assert_eq!(shader(&module, "ViewCamera"), view_camera(), "{name}");
        assert_eq!(shader(&module, "SampleCamera"), sample_camera(), "{name}");
        assert_eq!(shader(&module, "ViewWork"), view_work(), "{name}");
    }
}

/// Every struct that begins with indirect arguments, whatever a shader calls it.
fn lists(module: &naga::Module) -> Vec<Layout> {
    let names = module
        .types
        .iter()
        .filter_map(|(_, ty)| ty.name.as_deref().filter(|_| matches!(ty.inner, TypeInner::Struct { .. })));
    names.map(|name| shader(module, name)).filter(|layout| layout.fields[0].0 == "workgroups").collect()
}

#[test]
fn lists_and_the_fill_agree() {
    for name in ["march.wgsl", "joint_carve.wgsl", "light_field_search.wgsl", "fill.wgsl"] {
        let found = lists(&module(name));
        assert!(!found.is_empty() && found.iter().all(|layout| *layout == list()), "{name}: {found:?}");
    }
    let fill = host!(GpuFillWork { size_px, first_pixel, number });
    assert_eq!(shader(&module("fill.wgsl"), "FillWork"), fill);
}

#[test]
fn cutting_and_drawing_quads_agree() {
    let cut = host!(GpuCutWork {
        column_in_world,
        focal_px,
        row_in_world,
        code_scale,
        corner_in_world,
        code_offset,
        size_px,
        first_sample,
        first_corner,
        axis,
        bound_px,
        chunks,
        segment
    });
    let passes =
        ["mesh.wgsl", "hybrid_mesh.wgsl", "merge.wgsl", "quad_count.wgsl", "quad_scan.wgsl", "quad_indices.wgsl"];
    for name in passes {
        assert_eq!(shader(&module(name), "CutWork"), cut, "{name}");
    }
    let quads = host!(GpuQuadWork {
        clip_from_inverse_depth,
        clip_from_column,
        clip_from_row,
        clip_from_corner,
        width_px,
        first_sample,
        padding
    });
    assert_eq!(shader(&module("quads.wgsl"), "QuadWork"), quads);
}

#[test]
fn a_field_out_of_place_is_seen() {
    let other = naga::front::wgsl::parse_str("struct FillWork { first_pixel: u32, size_px: vec2u, number: u32 }")
        .expect("a struct");
    assert_ne!(shader(&other, "FillWork"), host!(GpuFillWork { size_px, first_pixel, number }));
}
