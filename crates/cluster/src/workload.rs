//! The workload of a session, and the content of its sample sets.

use std::ops::Range;

use depth_image::{
    Aabb, Environment, Illumination, MAX_LIGHTS, PinholeCamera, Refinement, SampleCamera, ViewGroup, nearest_set,
};
use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, at_most, nonempty, pinholes, within};
use crate::common_cell::{CommonCell, CommonKind, check_cube};
use crate::limits::{MAX_CELLS, MAX_COMMON_CELLS, MAX_REFINEMENT_STEPS, MAX_SAMPLE_CAMERAS};
use crate::scene::SceneRef;
use crate::timeline::Timeline;

/// Everything that samples depend on. Methods are text, as on the command line: nodes parse them, so that a new method
/// changes nothing here. The reconstruction method, the codec, planes, sizes and rate of views belong to requests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Workload {
    /// The scene.
    pub scene: SceneRef,
    /// Every set has one image for each; cameras of a view cell stand next to each other. Those of a layered depth cube are the three
    /// of its grid, and serve views from anywhere.
    pub sample_cameras: Vec<SampleCamera>,
    /// Where each cell's cameras begin, the first's at 0; empty: one view cell has all.
    pub cell_first_indices: Vec<u32>,
    /// The last cells are these: they depend on no viewer, and every view is made from all of them and from one view
    /// cell.
    pub common_cells: Vec<CommonCell>,
    /// How images are sampled.
    pub sampling: String,
    /// How samples are lit.
    pub lighting: String,
    /// The planes of images beside inverse depth and colour, or light in place of colour. Views may be made by every method that needs no others.
    pub planes: SamplePlanes,
    /// The bounds of reconstruction.
    pub volume: Aabb,
    /// Radiance of rays that leave the scene, by their direction.
    pub background: Environment,
    /// Scene times.
    pub timeline: Timeline,
    /// The scene's lamps and environment: compositors add what depends on the viewer.
    pub illumination: Illumination,
    /// Steps in which a still picture is refined: from 1, finished at once, to [`MAX_REFINEMENT_STEPS`].
    pub refinement_steps: u32,
    /// Pictures of at most so many pixels find surfaces by rays, larger ones by drawing triangles: which is faster was measured
    /// when the workload was opened, and is the same on every node, so that two nodes make equal pictures. `None`: not measured.
    pub traced_pixel_count: Option<u32>,
}

/// Planes of sample images that not every reconstruction method needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct SamplePlanes {
    /// Normals of surfaces.
    pub normals: bool,
    /// Inverse depth at the corners of texels.
    pub corner_inverse_depths: bool,
    /// Light in place of colour, for views that take surfaces from the scene.
    pub light: bool,
}

impl SamplePlanes {
    /// Whether images with these planes have all of `needed`. Images with light have no colour, and serve only methods that
    /// need light.
    #[must_use]
    pub fn contain(self, needed: Self) -> bool {
        self.light == needed.light
            && (self.normals || !needed.normals)
            && (self.corner_inverse_depths || !needed.corner_inverse_depths)
    }
}

/// Whether a lighting has indirect light. Its rays are noisy, and samples of it are smoothed: a view that is drawn directly has more
/// noise than one with light from samples.
#[must_use]
pub fn has_indirect_light(lighting: &str) -> bool {
    lighting.split(',').any(|term| term.split_whitespace().next() == Some("indirect"))
}

impl Workload {
    /// The step of refinement that a set shows. In a static scene every set is one step further, up to the last; sets beyond
    /// it are equal and are not sampled again. A timeline that ends before shows no finished set. A scene that moves has no
    /// time for steps: each set shows the last. So do views drawn directly.
    #[must_use]
    pub fn refinement(&self, set_index: u32) -> Refinement {
        let last_step = self.refinement_steps.saturating_sub(1);
        let step = if self.timeline.moves() { last_step } else { set_index.min(last_step) };
        Refinement { step, steps: last_step + 1 }
    }

    /// Whether pictures of so many pixels find surfaces by rays; `None` where that was not measured.
    #[must_use]
    pub fn finds_surfaces_by_rays(&self, pixels: usize) -> Option<bool> {
        self.traced_pixel_count.map(|most| pixels <= most as usize)
    }

    /// All cells: view cells, and after them common cells.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        self.cell_first_indices.len().max(1)
    }

    /// View cells: each view is made from the images of one of them.
    #[must_use]
    pub fn view_cell_count(&self) -> usize {
        self.cell_count().saturating_sub(self.common_cells.len()).max(1)
    }

    /// Sample cameras of view cells; those of common cells come after them.
    #[must_use]
    pub fn view_camera_count(&self) -> usize {
        let first_of_common = self.cell_first_indices.get(self.view_cell_count());
        first_of_common.map_or(self.sample_cameras.len(), |&first| first as usize)
    }

    /// The common cell of a cell's number; `None` for a view cell, and beyond the last.
    #[must_use]
    pub fn common_cell(&self, cell: usize) -> Option<&CommonCell> {
        self.common_cells.get(cell.checked_sub(self.view_cell_count())?)
    }

    /// The range of sample cameras of a cell; `None` beyond the last cell.
    #[must_use]
    pub fn cameras_of_cell(&self, cell: usize) -> Option<Range<usize>> {
        let firsts = if self.cell_first_indices.is_empty() { &[0][..] } else { &self.cell_first_indices };
        let end = firsts.get(cell + 1).map_or(self.sample_cameras.len(), |&next| next as usize);
        Some(*firsts.get(cell)? as usize..end)
    }

    /// The workload of one cell alone, without common cells; `None` beyond the last.
    #[must_use]
    pub fn of_cell(&self, cell: usize) -> Option<Self> {
        Some(Self {
            // Not `..self.clone()`: a workload may have a thousand cameras, and a live view asks for its cell.
            scene: self.scene.clone(),
            sample_cameras: self.sample_cameras.get(self.cameras_of_cell(cell)?)?.to_vec(),
            cell_first_indices: Vec::new(),
            common_cells: Vec::new(),
            sampling: self.common_cell(cell).map_or(&self.sampling, |common| &common.sampling).clone(),
            lighting: self.lighting.clone(),
            // What is found in them needs no planes of its own.
            planes: self.common_cell(cell).map_or(self.planes, |_| SamplePlanes::default()),
            volume: self.common_cell(cell).filter(|common| common.is_block()).map_or(self.volume, |block| block.bounds),
            background: self.background,
            timeline: self.timeline,
            illumination: self.illumination.clone(),
            refinement_steps: self.refinement_steps,
            traced_pixel_count: self.traced_pixel_count,
        })
    }

    /// The workloads of all cells: view cells first, then common cells.
    #[must_use]
    pub fn cells(&self) -> Vec<Self> {
        (0..self.cell_count()).filter_map(|cell| self.of_cell(cell)).collect()
    }

    /// The workload with other view cells, the cameras of each, and its own common cells.
    #[must_use]
    pub fn with_view_cells(self, cells: Vec<Vec<SampleCamera>>) -> Self {
        let common = (self.view_cell_count()..self.cell_count())
            .filter_map(|cell| Some((self.common_cell(cell)?.clone(), self.of_cell(cell)?.sample_cameras)))
            .collect();
        let mut cell_first_indices = Vec::new();
        let mut sample_cameras = Vec::new();
        for cameras in cells {
            cell_first_indices.push(sample_cameras.len() as u32);
            sample_cameras.extend(cameras);
        }
        Self { sample_cameras, cell_first_indices, common_cells: Vec::new(), ..self }.with_common_cells(common)
    }

    /// The workload with further common cells, and the cameras of each.
    #[must_use]
    pub fn with_common_cells(mut self, common: Vec<(CommonCell, Vec<SampleCamera>)>) -> Self {
        if self.cell_first_indices.is_empty() && !common.is_empty() {
            self.cell_first_indices.push(0);
        }
        for (cell, cameras) in common {
            self.cell_first_indices.push(self.sample_cameras.len() as u32);
            self.sample_cameras.extend(cameras);
            self.common_cells.push(cell);
        }
        self
    }

    /// The workload without common cells.
    #[must_use]
    pub fn without_common_cells(mut self) -> Self {
        let cells = self.view_cell_count();
        let cameras = self.view_camera_count();
        self.sample_cameras.truncate(cameras);
        self.cell_first_indices.truncate(cells);
        self.common_cells.clear();
        self
    }

    /// The workload of one view, which stands for others: the first view cell and the common cells.
    #[must_use]
    pub fn of_one_view(&self) -> Self {
        match self.of_cell(0) {
            None => self.clone(),
            Some(first) if self.common_cells.is_empty() => first,
            Some(first) => self.clone().with_view_cells(vec![first.sample_cameras]),
        }
    }

    /// The view cell that a view is in, or else nearest to.
    #[must_use]
    pub fn cell_of(&self, view: &PinholeCamera) -> u32 {
        if self.view_cell_count() == 1 {
            return 0;
        }
        let cells = (0..self.view_cell_count()).map(|cell| self.pinholes_of_cell(cell));
        nearest_set(view, cells, &self.volume).unwrap_or(0) as u32
    }

    /// Whether views are made from a layered depth cube, which serves views from anywhere.
    #[must_use]
    pub fn samples_cube(&self) -> bool {
        self.sample_cameras.iter().take(self.view_camera_count()).any(|camera| camera.depth().is_none())
    }

    /// Whether the view cell nearest to a view serves it, or would with a small step.
    #[must_use]
    pub fn has_cell_near(&self, view: &PinholeCamera) -> bool {
        if self.samples_cube() {
            return true;
        }
        let cameras = self.pinholes_of_cell(self.cell_of(view) as usize);
        let mut groups = Vec::new();
        ViewGroup::add(&mut groups, &cameras, &self.volume);
        let before = groups.len();
        ViewGroup::add(&mut groups, &[*view], &self.volume);
        groups.len() == before
    }

    fn pinholes_of_cell(&self, cell: usize) -> Vec<PinholeCamera> {
        let range = self.cameras_of_cell(cell).unwrap_or_default();
        SampleCamera::references(&self.sample_cameras[range])
    }

    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.scene.validate()?;
        self.check_cells()?;
        CommonCell::check_all(&self.common_cells)?;
        let common = self.common_cells.len();
        if common > 0 && common >= self.cell_first_indices.len() {
            let allowed = "fewer than cells: views have one at least";
            return Err(InvalidField::out_of_range("common_cells", common, allowed));
        }
        self.check_models()?;
        for camera in &self.sample_cameras {
            camera.validate().map_err(|source| InvalidField::Camera { field: "sample_cameras", source })?;
        }
        nonempty(&self.sampling, "sampling_method")?;
        nonempty(&self.lighting, "lighting")?;
        if self.volume.is_empty() {
            return Err(InvalidField::out_of_range("bounds", "empty", "min <= max on every axis"));
        }
        self.timeline.validate()?;
        self.background.validate().map_err(|source| InvalidField::Light { field: "background", source })?;
        if self.background.is_mapped {
            return Err(InvalidField::out_of_range("background", "a map", "a gradient"));
        }
        at_most(self.illumination.lights.len(), MAX_LIGHTS, "illumination.lights")?;
        for light in &self.illumination.lights {
            light.validate().map_err(|source| InvalidField::Light { field: "illumination.lights", source })?;
        }
        let environment = self.illumination.environment.validate();
        environment.map_err(|source| InvalidField::Light { field: "illumination.environment", source })?;
        within(self.refinement_steps, 1..=MAX_REFINEMENT_STEPS, "refinement_step_count", "from 1 to 64")
    }

    fn check_cells(&self) -> Result<(), InvalidField> {
        let firsts = &self.cell_first_indices;
        at_most(self.common_cells.len(), MAX_COMMON_CELLS, "common_cells")?;
        at_most(firsts.len(), MAX_CELLS + self.common_cells.len(), "cell_first_indices")?;
        at_most(self.sample_cameras.len(), MAX_SAMPLE_CAMERAS * self.cell_count(), "sample_cameras")?;
        let ends = firsts.iter().skip(1).copied().chain([self.sample_cameras.len() as u32]);
        let most = MAX_SAMPLE_CAMERAS as u32;
        let are_cells = firsts.iter().zip(ends).all(|(&first, end)| first < end && end - first <= most);
        if firsts.first().is_some_and(|&first| first > 0) || !are_cells {
            let given = format!("{firsts:?} of {} sample_cameras", self.sample_cameras.len());
            let allowed = "rising from 0, by 1 to 16 cameras each";
            return Err(InvalidField::out_of_range("cell_first_indices", given, allowed));
        }
        Ok(())
    }

    /// Views are made from pinholes, or from the cameras of one cube.
    fn check_models(&self) -> Result<(), InvalidField> {
        if self.samples_cube() {
            if self.cell_count() > 1 {
                return Err(InvalidField::out_of_range("cells of a layered cube", self.cell_count(), "1"));
            }
            return check_cube(&self.sample_cameras, 1).and_then(|()| self.check_still());
        }
        let (of_views, _) = self.sample_cameras.split_at_checked(self.view_camera_count()).unwrap_or_default();
        pinholes(of_views.iter().filter_map(SampleCamera::depth))?;
        for (number, cell) in (self.view_cell_count()..).zip(&self.common_cells) {
            let range = self.cameras_of_cell(number).unwrap_or_default();
            cell.check_cameras(self.sample_cameras.get(range).unwrap_or(&[]))?;
        }
        let has_base = self.common_cells.iter().any(|cell| cell.kind == CommonKind::Base);
        if has_base { self.check_still() } else { Ok(()) }
    }

    /// A cube is of one moment.
    fn check_still(&self) -> Result<(), InvalidField> {
        match self.timeline.moves() {
            true => Err(InvalidField::out_of_range("timeline", "of a scene that moves", "still for a layered cube")),
            false => Ok(()),
        }
    }
}

/// The name of a sample set's content, of one cell. It is equal for equal scene, time, cameras, sampling, lighting,
/// step of refinement, lights and volume, under any plan. Sets of equal content are not sampled again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SetContent([u8; 32]);

impl SetContent {
    /// The content of a set; `None` beyond the timeline.
    #[must_use]
    pub fn of(workload: &Workload, set_index: u32) -> Option<Self> {
        let time_s = workload.timeline.time_s(set_index)?;
        let refinement = workload.refinement(set_index);
        // Everything that the content of a set depends on.
        let shown = (
            workload.scene.hash.as_str(),
            time_s,
            &workload.sampling,
            &workload.lighting,
            workload.planes,
            workload.volume,
            workload.background,
            [refinement.step, refinement.steps],
            workload.traced_pixel_count,
            &workload.illumination,
            &workload.sample_cameras,
        );
        // Postcard prefixes lengths, so that no two sets have the same bytes. Writing to a hasher does not fail.
        let hash = postcard::to_io(&shown, blake3::Hasher::new()).ok()?;
        Some(Self(hash.finalize().into()))
    }
}
