//! Structs shared with the shaders have the shaders' layout: naga's offsets against Rust's.

use std::{collections::BTreeSet, mem::offset_of, sync::OnceLock};

use bytemuck::Zeroable as _;
use gpu::cube_walk::GpuCube;
use gpu::{GpuTone, ShaderSource};
use naga::{Module, TypeInner};

use crate::cube::GpuLightField;
use crate::{
    bounce::{GpuGlossySurface, GpuMirrorBox, GpuMirroredRay},
    lobes::GpuLobeRays,
    pixel_list::GpuPixelList,
    quads::{GpuCutWork, GpuQuadWork},
    shaders::{shader_sources, templates},
    single_pole::GpuPole,
    view_work::{GpuSampleCamera, GpuViewCamera, GpuViewWork, GpuVolume},
};

/// Fields with their offsets, and the size of the whole.
#[derive(Debug, PartialEq, Eq)]
struct Layout {
    fields: Vec<(String, usize)>,
    bytes: usize,
}

impl Layout {
    fn new<'n>(fields: impl IntoIterator<Item = (&'n str, usize)>, bytes: usize) -> Self {
        Self { fields: fields.into_iter().map(|(name, offset)| (name.to_owned(), offset)).collect(), bytes }
    }
}

/// A Rust struct's. A field that is not listed does not compile.
macro_rules! host {
    ($host:ident { $($field:ident),+ }) => {{
        let $host { $($field: _),+ } = $host::zeroed();
        Layout::new([$((stringify!($field), offset_of!($host, $field))),+], size_of::<$host>())
    }};
}

/// All variants of all passes that declare a struct.
fn modules_with(name: &str) -> impl Iterator<Item = &'static (ShaderSource, Module)> {
    static MODULES: OnceLock<Vec<(ShaderSource, Module)>> = OnceLock::new();
    let modules = MODULES.get_or_init(|| {
        let templates = templates().expect("templates");
        let sources = shader_sources(&templates).map(|source| source.expect("a text"));
        sources.map(|source| (parsed(&source.wgsl), source)).map(|(module, source)| (source, module)).collect()
    });
    modules.iter().filter(move |(_, module)| module.types.iter().any(|(_, ty)| ty.name.as_deref() == Some(name)))
}

fn parsed(wgsl: &str) -> Module {
    naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|error| panic!("{}", error.emit_to_string(wgsl)))
}

/// The templates whose variants declare a struct, which has a host's layout in all of them.
fn templates_that_agree(name: &str, host: &Layout) -> BTreeSet<&'static str> {
    modules_with(name)
        .map(|(source, module)| {
            assert_eq!(shader(module, name), *host, "{}", source.name);
            source.template
        })
        .collect()
}

/// A WGSL struct's.
fn shader(module: &Module, name: &str) -> Layout {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, naga::Type { inner: TypeInner::Struct { members, span }, .. })) = found else {
        panic!("no struct {name}")
    };
    let field = |member: &naga::StructMember| (member.name.clone().unwrap_or_default(), member.offset as usize);
    Layout { fields: members.iter().map(field).collect(), bytes: *span as usize }
}

#[test]
fn views_and_sample_cameras_agree_in_every_pass_over_cameras() {
    let passes = BTreeSet::from([
        "antialias.wgsl",
        "blocks.wgsl",
        "bounce/curved_search.wgsl",
        "bounce/land.wgsl",
        "bounce/march.wgsl",
        "fill.wgsl",
        "joint_carve.wgsl",
        "layered.wgsl",
        "light_field_search.wgsl",
        "joint_carve/march.wgsl",
        "joint_carve/smooth.wgsl",
        "resolve.wgsl",
        "specular.wgsl",
        "tile_start.wgsl",
    ]);
    let view_camera = host!(GpuViewCamera {
        eye_in_world,
        near_m,
        column_in_world,
        focal_px,
        row_in_world,
        first_pixel,
        corner_in_world,
        first_tile,
        size_px,
        number,
        rows
    });
    assert_eq!(templates_that_agree("ViewCamera", &view_camera), passes);
    let sample_camera = host!(GpuSampleCamera {
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
        first_mip
    });
    assert_eq!(templates_that_agree("SampleCamera", &sample_camera), passes);
    let tone = host!(GpuTone { exposure_factor, curve, padding });
    assert_eq!(templates_that_agree("Tone", &tone), passes);
    for (source, module) in modules_with("ViewWork") {
        let found = shader(module, "ViewWork");
        let cameras = (found.bytes - size_of::<GpuViewWork>()) / size_of::<GpuSampleCamera>();
        assert_eq!(found, view_work(cameras), "{}", source.name);
        let is_declared = source.wgsl.contains(&format!("cameras: array<SampleCamera, {cameras}>"));
        assert!(cameras == 0 || is_declared, "{}", source.name);
    }
}

/// The shader has the volume's fields in place of the struct; the cameras follow.
fn view_work(cameras: usize) -> Layout {
    let GpuViewWork { view: _, volume: _, tone: _ } = GpuViewWork::zeroed();
    let GpuVolume { min_in_world: _, position_share: _, max_in_world: _, padding: _ } = GpuVolume::zeroed();
    let volume = offset_of!(GpuViewWork, volume);
    let listed = (cameras > 0).then_some(("cameras", size_of::<GpuViewWork>()));
    let fields = [
        ("view", offset_of!(GpuViewWork, view)),
        ("volume_min_in_world", volume + offset_of!(GpuVolume, min_in_world)),
        ("position_share", volume + offset_of!(GpuVolume, position_share)),
        ("volume_max_in_world", volume + offset_of!(GpuVolume, max_in_world)),
        ("padding", volume + offset_of!(GpuVolume, padding)),
        ("tone", offset_of!(GpuViewWork, tone)),
    ];
    Layout::new(fields.into_iter().chain(listed), size_of::<GpuViewWork>() + cameras * size_of::<GpuSampleCamera>())
}

#[test]
fn lists_of_pixels_agree_where_they_are_written_and_read() {
    let GpuPixelList { workgroups: _, count: _ } = GpuPixelList::zeroed();
    // Indirect arguments by name in the shaders, three in a row on the host.
    let first = offset_of!(GpuPixelList, workgroups);
    let count = offset_of!(GpuPixelList, count);
    let fields = [("workgroups", first), ("y", first + 4), ("z", first + 8), ("count", count)];
    let list = Layout::new(fields, size_of::<GpuPixelList>());
    let searches = [
        "blocks.wgsl",
        "bounce/curved_search.wgsl",
        "joint_carve.wgsl",
        "layered.wgsl",
        "light_field_search.wgsl",
        "resolve.wgsl",
    ];
    let marches = ["bounce/march.wgsl", "joint_carve/march.wgsl", "joint_carve/smooth.wgsl"];
    let written = [&searches[..], &marches].concat();
    assert_eq!(templates_that_agree("UndecidedList", &list), BTreeSet::from_iter(written));
    let read = [
        "antialias.wgsl",
        "bounce/curved_search.wgsl",
        "bounce/land.wgsl",
        "bounce/march.wgsl",
        "fill.wgsl",
        "joint_carve.wgsl",
        "layered.wgsl",
        "light_field_search.wgsl",
        "joint_carve/march.wgsl",
        "specular.wgsl",
    ];
    assert_eq!(templates_that_agree("PixelList", &list), BTreeSet::from(read));
}

#[test]
fn mirrored_rays_and_mirror_boxes_agree_where_they_are_written_and_read() {
    let ray =
        host!(GpuMirroredRay { origin_in_world, pixel, direction, guess, throughput_rgb9e5, near_m, width_m, spread });
    let in_images = [
        "bounce/curved_search.wgsl",
        "bounce/land.wgsl",
        "bounce/lobe.wgsl",
        "bounce/march.wgsl",
        "joint_carve.wgsl",
        "specular.wgsl",
    ];
    let passes = [&in_images[..], &["layered.wgsl"]].concat();
    assert_eq!(templates_that_agree("MirroredRay", &ray), BTreeSet::from_iter(passes));
    let boxes = host!(GpuMirrorBox { min_in_world, first_listed, max_in_world, start_m });
    assert_eq!(
        templates_that_agree("MirrorBox", &boxes),
        BTreeSet::from(["bounce/land.wgsl", "bounce/lobe.wgsl", "layered.wgsl", "specular.wgsl"])
    );
}

#[test]
fn cubes_agree() {
    let cube = host!(GpuCube { cube_from_world, size, columns, rows, start_m, padding });
    assert_eq!(templates_that_agree("Cube", &cube), BTreeSet::from(["layered.wgsl"]));
}

#[test]
fn glossy_surfaces_agree_where_they_are_listed_and_send_rays() {
    let surface = host!(GpuGlossySurface {
        point_in_world,
        pixel,
        towards_eye,
        normal_oct16,
        throughput_linear,
        roughness,
        open,
        is_mirrored,
        padding
    });
    let rays = host!(GpuLobeRays { count, number });
    let passes = ["bounce/lobe.wgsl", "layered.wgsl", "specular.wgsl"];
    let summed = [&["bounce/lobe_sum.wgsl"][..], &passes].concat();
    assert_eq!(templates_that_agree("GlossySurface", &surface), BTreeSet::from_iter(summed));
    assert_eq!(templates_that_agree("LobeRays", &rays), BTreeSet::from(passes));
}

#[test]
fn light_fields_agree() {
    let field = host!(GpuLightField { directions, divisions, side_px, exponent, least_alpha });
    assert_eq!(templates_that_agree("LightField", &field), BTreeSet::from(["layered.wgsl"]));
}

#[test]
fn poles_agree_where_curved_rays_are_followed_and_land() {
    let pole = host!(GpuPole { pole_px, bend_px_m, nearest_per_m, farthest_per_m, padding_0, padding_1, padding_2 });
    let passes = ["bounce/curved_search.wgsl", "bounce/land.wgsl"];
    assert_eq!(templates_that_agree("Pole", &pole), BTreeSet::from(passes));
}

#[test]
fn cutting_and_drawing_agree() {
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
    let passes = ["count.wgsl", "hybrid_mesh.wgsl", "indices.wgsl", "merge.wgsl", "mesh.wgsl", "scan.wgsl"];
    assert_eq!(templates_that_agree("CutWork", &cut), BTreeSet::from(passes));
    let quads = host!(GpuQuadWork {
        clip_from_inverse_depth,
        clip_from_column,
        clip_from_row,
        clip_from_corner,
        width_px,
        first_sample,
        padding
    });
    assert_eq!(templates_that_agree("QuadWork", &quads), BTreeSet::from(["draw.wgsl"]));
}

#[test]
fn a_field_out_of_place_is_seen() {
    let other = parsed("struct PixelList { count: u32, workgroups: array<u32, 3> }");
    assert_ne!(shader(&other, "PixelList"), host!(GpuPixelList { workgroups, count }));
}

#[test]
fn the_uniform_with_a_dynamic_offset_is_declared() {
    for (source, module) in modules_with("ViewWork") {
        let mut variables = module.global_variables.iter();
        assert!(variables.any(|(_, variable)| variable.name.as_deref() == Some("work")), "{}", source.name);
        assert_eq!(source.dynamic_uniforms, ["work"], "{}", source.name);
    }
}
