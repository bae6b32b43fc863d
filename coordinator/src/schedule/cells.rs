//! View cells: what is sampled follows from where sessions look.

use cluster::Workload;
use cluster::limits::MAX_CELLS;
use depth_image::{Aabb, Camera, PinholeCamera, ViewGroup};
use glam::UVec2;

/// The cells of one workload. One that is still looked from stays as it is, whatever comes and goes elsewhere: what was
/// sampled for it stays good.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cells {
    groups: Vec<ViewGroup>,
    /// Of sample images.
    size_px: UVec2,
}

impl Cells {
    /// None yet, for a workload of a session that says from where it looks.
    pub(super) fn of(workload: &Workload) -> Self {
        Self { groups: Vec::new(), size_px: sample_size_px(workload) }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// For all viewpoints of all sessions.
    pub(super) fn follow(&mut self, viewpoints: &[PinholeCamera], scene: &Aabb) {
        self.groups.retain(|group| viewpoints.iter().any(|view| group.serves(view, scene)));
        ViewGroup::add(&mut self.groups, viewpoints, scene);
    }

    /// The workload with these cells' cameras; at most so many cells as a plan may have, and views of others are made from
    /// the nearest.
    pub(super) fn put_into(&self, workload: &mut Workload) {
        let cameras = |group: &ViewGroup| group.sample_cameras(self.size_px);
        let usable = |cameras: &Vec<PinholeCamera>| cameras.iter().all(|camera| camera.validate().is_ok());
        let cells: Vec<_> = self.groups.iter().map(cameras).filter(usable).take(MAX_CELLS).collect();
        workload.cell_first_indices = firsts(&cells);
        workload.sample_cameras = cells.into_iter().flatten().map(Camera::Pinhole).collect();
    }

    /// Whether sessions of two workloads can share cells.
    pub(super) fn suit(&self, own: &Workload, other: &Workload) -> bool {
        let alike = |workload: &Workload| Workload {
            sample_cameras: Vec::new(),
            cell_first_indices: Vec::new(),
            ..workload.clone()
        };
        self.size_px == sample_size_px(other) && alike(own) == alike(other)
    }
}

/// Where each cell's cameras begin.
pub(crate) fn firsts<T>(cells: &[Vec<T>]) -> Vec<u32> {
    let first = |next: &mut u32, cameras: &Vec<T>| Some(std::mem::replace(next, *next + cameras.len() as u32));
    cells.iter().scan(0, first).collect()
}

fn sample_size_px(workload: &Workload) -> UVec2 {
    workload.sample_cameras.first().map_or(UVec2::ONE, |Camera::Pinhole(camera)| camera.size_px)
}
