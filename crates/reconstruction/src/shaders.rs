//! The shader templates of this crate, the numbers that they share with Rust, and all their variants.

use depth_image::ProvenanceKind;
use gpu::{ShaderError, ShaderSource, Templates, wgsl_constants, wgsl_files};
use minijinja::Value;

use crate::antialias::Shown;
use crate::blocks::ListRays;
use crate::bounce::{
    BOUNCE_LEVEL, BounceMarch, CurvedWalk, EDGE_COSINE, LEAST_RISE, LEAST_WAY, LONGEST_STEP, Land, MARCH_ROUNDS,
    MAX_WALK_STEPS, START_FOOTPRINTS,
};
use crate::cube::{FOOTPRINT_SHARE, LEAST_LOBE_SHARE, MOST_MASKING};
use crate::fill::{DIRECTIONS, Fill, REACH_PX, SAME_SIDE};
use crate::lobes::{Lobe, LobeSum};
use crate::methods::hybrid_mesh::{CutTexels, GREATEST_SLOPE};
use crate::methods::joint_carve::march::{EYE_SHARE, MAX_COARSE_MOVES, MAX_FINE_MOVES, March, NUDGE_PX, START_LEVEL};
use crate::methods::joint_carve::smooth::{FAINT_HIGHLIGHT, OPEN_SHARE, SMOOTH_FOOTPRINTS, Smooth};
use crate::methods::joint_carve::{BLIND_MOVE, Carve, LEAST_MOVE, MAX_MOVES, MAX_MOVES_TO_HIT};
use crate::methods::light_field_search::{BISECTIONS, Search};
use crate::methods::{layered::Walk, mesh::CutBetweenSamples};
use crate::pyramid::{BACKGROUND_CODE, FIRST_SAMPLE, FLAT_FOOTPRINTS, HOLE_CODE, SLOPE_SHARE};
use crate::quads::{CHUNK, Count, DrawQuads, INDICES_A_QUAD, Indices, Merge, Resolve, Scan};
use crate::surface::{
    ANGLE_FLOOR, BORDER_PX, CARVING_SHARE, HALF_CODE, HIDDEN_WEIGHT, LEAST_SHARE, SPLIT_SHIFT, THICKNESS_FOOTPRINTS,
    WHOLE,
};
use crate::tile_start::{GREATEST_TILE_MOVE, HALF_DIAGONAL, LEAST_TILE_MOVE, MAX_TILE_MOVES, TileStart};
use crate::view_work::{CELL_MARGIN_PX, FAR_AWAY, TILE_PX};
use crate::{methods, pixel_list::LIST_WORKGROUP, quads, specular::Specular};

/// Passes over whole views, and templates that several shaders include.
const SHADERS: [(&str, &str); 31] = wgsl_files! {
    "antialias.wgsl", "blocks.wgsl", "tile_start.wgsl", "fill.wgsl", "specular.wgsl", "view_work.wgsl", "cell.wgsl", "surface.wgsl", "found.wgsl", "cube/colors.wgsl", "cube/gather.wgsl", "pixel_list.wgsl", "at_pixel.wgsl",
    "reflection.wgsl", "gathered.wgsl", "gather_at.wgsl", "nearest_at.wgsl", "colors.wgsl", "bounce/ray.wgsl", "bounce/list.wgsl", "bounce/glossy.wgsl", "bounce/list_glossy.wgsl", "bounce/lobe.wgsl", "bounce/lobe_rays.wgsl", "bounce/lobe_sum.wgsl", "bounce/spawn.wgsl", "bounce/march.wgsl", "bounce/curved_search.wgsl", "single_pole.wgsl", "bounce/mips.wgsl", "bounce/land.wgsl"
};

const PROVENANCE_EMPTY: u32 = ProvenanceKind::Empty as u32;
const PROVENANCE_HIT: u32 = ProvenanceKind::Hit as u32;
const PROVENANCE_FILLED: u32 = ProvenanceKind::Filled as u32;
const PROVENANCE_GUESSED: u32 = ProvenanceKind::Guessed as u32;
const PROVENANCE_BASE: u32 = ProvenanceKind::Base as u32;

/// The names and texts of all templates of this crate.
#[must_use]
pub fn shaders() -> Vec<(&'static str, &'static str)> {
    [&SHADERS[..], &quads::SHADERS, &methods::SHADERS].concat()
}

/// All templates of this crate.
///
/// # Errors
/// When a text is not a template.
pub fn templates() -> Result<Templates, ShaderError> {
    let constants = wgsl_constants! {
        ANGLE_FLOOR, BACKGROUND_CODE, BORDER_PX, BOUNCE_LEVEL, CARVING_SHARE, CELL_MARGIN_PX, FAR_AWAY, FIRST_SAMPLE, FLAT_FOOTPRINTS,
        GREATEST_TILE_MOVE, HALF_CODE, HALF_DIAGONAL, HIDDEN_WEIGHT, HOLE_CODE, LEAST_SHARE, LEAST_TILE_MOVE,
        FOOTPRINT_SHARE, LEAST_LOBE_SHARE, MOST_MASKING,
        LIST_WORKGROUP, MAX_TILE_MOVES, PROVENANCE_BASE, PROVENANCE_EMPTY, PROVENANCE_FILLED, PROVENANCE_GUESSED, PROVENANCE_HIT, REACH_PX, SAME_SIDE,
        EDGE_COSINE, LEAST_RISE, LEAST_WAY, LONGEST_STEP, MARCH_ROUNDS, MAX_WALK_STEPS, SLOPE_SHARE, SPLIT_SHIFT, START_FOOTPRINTS, THICKNESS_FOOTPRINTS, TILE_PX, WHOLE,
        BISECTIONS, BLIND_MOVE, CHUNK, EYE_SHARE, FAINT_HIGHLIGHT, GREATEST_SLOPE, INDICES_A_QUAD, LEAST_MOVE, MAX_COARSE_MOVES, MAX_FINE_MOVES,
        MAX_MOVES, MAX_MOVES_TO_HIT, NUDGE_PX, OPEN_SHARE, SMOOTH_FOOTPRINTS, START_LEVEL
    };
    let directions = Value::from_iter(DIRECTIONS.map(Value::from_iter));
    Ok(Templates::new(&shaders())?.with_constants([("DIRECTIONS", directions)]).declaring(constants))
}

/// The texts of all variants of all passes.
pub fn shader_sources(templates: &Templates) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    gpu::shader_sources!(
        templates,
        TileStart,
        Fill,
        ListRays,
        Specular,
        BounceMarch,
        CurvedWalk,
        Land,
        Lobe,
        LobeSum,
        Shown,
        Count,
        Scan,
        Indices,
        Merge,
        DrawQuads,
        Resolve,
        March,
        Smooth,
        Carve,
        Search,
        Walk,
        CutBetweenSamples,
        CutTexels
    )
}
