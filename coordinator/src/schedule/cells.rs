//! View cells: sample cameras that follow from the viewpoints of sessions.

use cluster::Workload;
use cluster::limits::MAX_CELLS;
use depth_image::{Aabb, PinholeCamera, SampleCamera, ViewCell, ViewGroup};
use glam::UVec2;

/// The cells of one workload. A cell that still has viewpoints stays as it is, whatever changes elsewhere: its samples stay
/// valid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cells {
    groups: Vec<ViewGroup>,
    /// The size of sample images.
    size_px: UVec2,
}

impl Cells {
    /// No cells yet, for a workload whose sample cameras follow viewpoints.
    pub(super) fn of(workload: &Workload) -> Self {
        Self { groups: Vec::new(), size_px: sample_size_px(workload) }
    }

    /// The boxes that the cells may grow to, up to the limit of a plan.
    pub(super) fn grown(&self) -> Vec<ViewCell> {
        self.groups.iter().map(ViewGroup::grown_cell).take(MAX_CELLS).collect()
    }

    /// The number of cells.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// Adapts the cells to the viewpoints that sessions have declared, and to those of live viewers as far as there is room.
    pub(super) fn follow(&mut self, declared: &[PinholeCamera], live: &[PinholeCamera], scene: &Aabb) {
        self.groups.retain(|group| serves_any(group, declared, scene) || serves_any(group, live, scene));
        ViewGroup::add(&mut self.groups, declared, scene);
        ViewGroup::add(&mut self.groups, live, scene);
        for i in (0..self.groups.len()).rev() {
            if self.groups.len() > MAX_CELLS && !serves_any(&self.groups[i], declared, scene) {
                self.groups.remove(i);
            }
        }
    }

    /// Gives the workload the cameras of these cells, up to the limit of a plan. Views of further cells are made from
    /// the nearest.
    pub(super) fn place_cameras(&self, workload: &mut Workload) {
        let cells = self.groups.iter().map(|group| group.sample_cameras(self.size_px));
        let usable = cells.filter(|cameras| cameras.iter().all(|camera| camera.validate().is_ok())).take(MAX_CELLS);
        let cells = usable.map(|cameras| cameras.into_iter().map(SampleCamera::from).collect());
        *workload = workload.clone().with_view_cells(cells.collect());
    }

    /// Whether sessions of two workloads can share cells.
    pub(super) fn are_shareable(&self, own: &Workload, other: &Workload) -> bool {
        let with_own_cameras = Workload {
            sample_cameras: own.sample_cameras.clone(),
            cell_first_indices: own.cell_first_indices.clone(),
            ..other.clone()
        };
        self.size_px == sample_size_px(other) && *own == with_own_cameras
    }
}

fn serves_any(group: &ViewGroup, views: &[PinholeCamera], scene: &Aabb) -> bool {
    views.iter().any(|view| group.serves(view, scene))
}

fn sample_size_px(workload: &Workload) -> UVec2 {
    workload.sample_cameras.first().map_or(UVec2::ONE, SampleCamera::size_px)
}
