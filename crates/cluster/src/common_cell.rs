//! Cells that depend on no viewer.

use depth_image::{Aabb, CubeGrid, MAX_MIRROR_CELLS, SampleCamera};
use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, at_most, nonempty};
use crate::limits::{MAX_BLOCKS, MAX_TILES};

/// A cell that depends on no viewer: every view is made from all of these, and from one view cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommonCell {
    /// What its images are for.
    pub kind: CommonKind,
    /// Holds the surfaces of mirrors at all moments; of a base, the scene. Blocks are cells of one grid.
    pub bounds: Aabb,
    /// How its images are sampled.
    pub sampling: String,
}

/// What the images of a common cell are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CommonKind {
    /// They show what mirrors within the bounds show.
    Mirrors,
    /// They are those of a layered depth cube, in which is walked what other images leave unknown.
    Base,
    /// They show a block of the scene: rays are searched in the blocks that they cross, front to back, before the images of view cells.
    Block,
}

impl CommonCell {
    /// Whether its images are those of a block.
    #[must_use]
    pub fn is_block(&self) -> bool {
        self.kind == CommonKind::Block
    }

    /// # Errors
    /// For too many mirrors, bases or blocks, blocks beside others, and values that no peer may send.
    pub(crate) fn check_all(cells: &[Self]) -> Result<(), InvalidField> {
        at_most(count_of(cells, CommonKind::Mirrors), MAX_MIRROR_CELLS, "common_cells of mirrors")?;
        at_most(count_of(cells, CommonKind::Base), 1, "common_cells of a base")?;
        let blocks = count_of(cells, CommonKind::Block);
        at_most(blocks, MAX_BLOCKS, "common_cells of blocks")?;
        if blocks > 0 && blocks < cells.len() {
            let given = format!("{} beside {blocks} of blocks", cells.len() - blocks);
            return Err(InvalidField::out_of_range("common_cells", given, "blocks alone"));
        }
        for Self { bounds, sampling, .. } in cells {
            nonempty(sampling, "common_cells.sampling_method")?;
            if bounds.is_empty() || !bounds.min.is_finite() || !bounds.max.is_finite() {
                return Err(InvalidField::out_of_range("common_cells.bounds", "empty or not finite", "a finite box"));
            }
        }
        Ok(())
    }

    /// The images of mirrors are of one model; those of a base are a cube's.
    pub(crate) fn check_cameras(&self, cameras: &[SampleCamera]) -> Result<(), InvalidField> {
        if self.kind == CommonKind::Base {
            return check_cube(cameras, 0);
        }
        let other = cameras.iter().find(|camera| camera.depth().is_none() || !camera.is_of_model(&cameras[0]));
        other.map_or(Ok(()), |other| {
            let expected = "the model of the mirror cell's first camera";
            Err(InvalidField::out_of_range("sample_cameras.model", other.model_name(), expected))
        })
    }
}

fn count_of(cells: &[CommonCell], kind: CommonKind) -> usize {
    cells.iter().filter(|cell| cell.kind == kind).count()
}

/// Checks that cameras are the three of one layered cube, each with a row for every tile; after them may come some of light fields.
pub(crate) fn check_cube(cameras: &[SampleCamera], most_light_fields: usize) -> Result<(), InvalidField> {
    let parallel: Vec<_> = cameras.iter().map_while(SampleCamera::layered).copied().collect();
    let light_fields = cameras.iter().skip(parallel.len()).map_while(SampleCamera::light_field).count();
    let is_whole = parallel.len() + light_fields == cameras.len() && light_fields <= most_light_fields;
    if !is_whole || CubeGrid::of_cameras(&parallel).is_none() {
        let given = format!("{} parallel and {light_fields} light_field of {}", parallel.len(), cameras.len());
        let allowed = "the three cameras of one layered cube, in one cell, and at most one of a light field";
        return Err(InvalidField::out_of_range("sample_cameras.model", given, allowed));
    }
    let mut fields = cameras.iter().filter_map(SampleCamera::light_field);
    if let Some(part) = fields.find(|field| field.pairs != field.directions.pairs()) {
        let given = format!("{} of {}", part.pairs, part.directions.pairs());
        return Err(InvalidField::out_of_range("sample_cameras.pairs", given, "all of a light field"));
    }
    let short = parallel.iter().find(|camera| camera.size_px.y < MAX_TILES);
    short.map_or(Ok(()), |short| {
        Err(InvalidField::out_of_range("sample_cameras.size", short.size_px, "16 rows and more in a cube"))
    })
}
