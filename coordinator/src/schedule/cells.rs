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
        let serves = |group: &ViewGroup, views: &[PinholeCamera]| views.iter().any(|view| group.serves(view, scene));
        self.groups.retain(|group| serves(group, declared) || serves(group, live));
        ViewGroup::add(&mut self.groups, declared, scene);
        ViewGroup::add(&mut self.groups, live, scene);
        for i in (0..self.groups.len()).rev() {
            if self.groups.len() > MAX_CELLS && !serves(&self.groups[i], declared) {
                self.groups.remove(i);
            }
        }
    }

    /// Gives the workload the cameras of these cells, up to the limit of a plan. Views of further cells are made from
    /// the nearest.
    pub(super) fn place_cameras(&self, workload: &mut Workload) {
        let cameras = |group: &ViewGroup| group.sample_cameras(self.size_px);
        let usable = |cameras: &Vec<PinholeCamera>| cameras.iter().all(|camera| camera.validate().is_ok());
        let cells: Vec<_> = self.groups.iter().map(cameras).filter(usable).take(MAX_CELLS).collect();
        let cameras = |cell: Vec<PinholeCamera>| cell.into_iter().map(SampleCamera::from).collect();
        *workload = workload.clone().with_view_cells(cells.into_iter().map(cameras).collect());
    }

    /// Whether sessions of two workloads can share cells.
    pub(super) fn are_shareable(&self, own: &Workload, other: &Workload) -> bool {
        let alike = |workload: &Workload| Workload {
            sample_cameras: Vec::new(),
            cell_first_indices: Vec::new(),
            ..workload.clone()
        };
        self.size_px == sample_size_px(other) && alike(own) == alike(other)
    }
}

fn sample_size_px(workload: &Workload) -> UVec2 {
    workload.sample_cameras.first().map_or(UVec2::ONE, SampleCamera::size_px)
}
