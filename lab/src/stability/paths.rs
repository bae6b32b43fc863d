//! Paths of a camera, with the sample set that each frame is made of.

use anyhow::Context as _;
use cluster::Refinement;
use depth_image::{PinholeCamera, ViewGroup, nearest_set};
use glam::Vec2;
use render::Lighting;

use super::subject::{Representation, Subject};

/// The orbits' radius, as a share of the view cell.
const RADIUS: f32 = 0.8;
/// Frames of a second, where the scene moves.
const FRAMES_PER_S: f32 = 30.0;
/// Frames of a full circle where the camera walks around the scene.
const CIRCLE_FRAMES: usize = 180;
/// Sample cameras of a view cell.
pub const CAMERAS: u32 = 4;
/// The representation that replaces the default half-way.
const REPLACEMENT: &str = "hybrid_mesh:0.5";

/// Light, moment and representation of a sample set.
#[derive(Debug, Clone)]
pub struct SetOfPath {
    pub representation: Representation,
    pub time_s: f32,
    pub refinement: Refinement,
}

/// A camera, and the place of its set among those of the path.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub camera: PinholeCamera,
    pub set: usize,
}

/// The difference of a path's frames, beside the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switch {
    None,
    /// The scene moves: each frame has a set of its own.
    Moment,
    /// The camera goes from view cell to view cell.
    Cell,
    /// Half-way another representation takes over.
    Representation,
    /// Each frame's light is refined one step further.
    Light,
}

/// The kind of a path: its subject and its frames.
#[derive(Debug, Clone, Copy)]
pub struct PathKind {
    pub name: &'static str,
    pub scene: &'static str,
    pub lighting: &'static str,
    pub switch: Switch,
    /// The movement of a surface in the middle of the scene from frame to frame, if the camera did not turn, in pixels.
    step_px: f32,
}

impl PathKind {
    const fn new(name: &'static str, scene: &'static str, switch: Switch, step_px: f32) -> Self {
        Self { name, scene, lighting: "phong", switch, step_px }
    }
}

/// All paths.
pub const PATHS: [PathKind; 8] = [
    PathKind::new("slow orbit", "tree-terrain-30k", Switch::None, 0.25),
    PathKind::new("fast orbit", "tree-terrain-30k", Switch::None, 8.0),
    PathKind::new("fast orbit in a city", "urban", Switch::None, 8.0),
    PathKind::new("across cells of a tree", "tree", Switch::Cell, 0.0),
    PathKind::new("across cells", "blocks", Switch::Cell, 0.0),
    PathKind::new("another representation", "tree-terrain-30k", Switch::Representation, 0.25),
    PathKind::new("wind", "tree-terrain-30k-wind", Switch::Moment, 0.0),
    PathKind { lighting: "soft 64", ..PathKind::new("light refined", "courtyard", Switch::Light, 0.0) },
];

/// The frames of a path, and its sets.
pub struct Path {
    pub kind: PathKind,
    pub sets: Vec<SetOfPath>,
    pub frames: Vec<Frame>,
}

impl Path {
    /// `count` frames of a path on its subject.
    ///
    /// # Errors
    /// The scene has no cells.
    pub fn new(kind: PathKind, subject: &Subject, count: usize) -> anyhow::Result<Self> {
        let usual = subject.usual(CAMERAS);
        let still = SetOfPath { representation: usual.clone(), time_s: 0.0, refinement: Refinement::default() };
        let (sets, set_of_frames): (Vec<SetOfPath>, Vec<usize>) = match kind.switch {
            Switch::None => (vec![still], vec![0; count]),
            Switch::Moment => {
                let sets = (0..count).map(|frame| SetOfPath { time_s: frame as f32 / FRAMES_PER_S, ..still.clone() });
                (sets.collect(), (0..count).collect())
            }
            Switch::Cell => {
                let (sets, frames) = across_cells(subject, &usual, count)?;
                return Ok(Self { kind, sets, frames });
            }
            Switch::Representation => {
                let representation = Representation { method: REPLACEMENT.parse()?, ..usual };
                let replacement = SetOfPath { representation, ..still.clone() };
                (vec![still, replacement], (0..count).map(|frame| usize::from(frame >= count / 2)).collect())
            }
            Switch::Light => {
                let steps = kind.lighting.parse::<Lighting>()?.refinement_steps();
                let sets = (0..steps).map(|step| SetOfPath { refinement: Refinement { step, steps }, ..still.clone() });
                (sets.collect(), (0..count).map(|frame| frame.min(steps as usize - 1)).collect())
            }
        };
        let cameras = orbit(subject, kind.step_px, count).into_iter();
        let frames = cameras.zip(set_of_frames).map(|(camera, set)| Frame { camera, set }).collect();
        Ok(Self { kind, sets, frames })
    }

    /// The number of frames that are made of another set than the one before.
    pub fn switches(&self) -> usize {
        (0..self.frames.len()).filter(|&frame| self.is_switch(frame)).count()
    }

    /// Whether a frame is made of another set than the one before.
    pub fn is_switch(&self, frame: usize) -> bool {
        frame > 0 && self.frames[frame].set != self.frames[frame - 1].set
    }
}

/// Views on a circle in the cell. Without a step they all stand in its middle.
fn orbit(subject: &Subject, step_px: f32, count: usize) -> Vec<PinholeCamera> {
    let cell = &subject.cell;
    let view_px = subject.view_px;
    let middle = cell.camera_at(Vec2::ZERO, view_px);
    if step_px == 0.0 {
        return vec![middle; count];
    }
    let distance_m = (subject.volume().center() - middle.eye_in_world).length();
    let half_m = (cell.camera_at(Vec2::X, view_px).eye_in_world - middle.eye_in_world).length();
    let step = step_px * distance_m / (middle.focal_px.x * RADIUS * half_m);
    (0..count).map(|frame| cell.camera_at(Vec2::from_angle(step * frame as f32) * RADIUS, view_px)).collect()
}

/// A walk around the scene, in which view cells follow one another as the coordinator places them.
fn across_cells(
    subject: &Subject,
    usual: &Representation,
    count: usize,
) -> anyhow::Result<(Vec<SetOfPath>, Vec<Frame>)> {
    let volume = subject.volume();
    let circle = subject.cell.around(volume.center(), CIRCLE_FRAMES, subject.view_px);
    let cameras = &circle[..count.min(CIRCLE_FRAMES)];
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, cameras, volume);
    let size_px = usual.cameras.first().context("no sample cameras")?.size_px;
    let cells: Vec<Vec<PinholeCamera>> = groups.iter().map(|group| group.sample_cameras(size_px)).collect();
    let of_frames: Option<Vec<usize>> =
        cameras.iter().map(|camera| nearest_set(camera, cells.clone(), volume)).collect();
    let of_frames = of_frames.context("no view cell")?;
    // Sets follow one another, also where the walk comes back to a cell.
    let visits: Vec<&[usize]> = of_frames.chunk_by(|a, b| a == b).collect();
    let set_of_frames = visits.iter().enumerate().flat_map(|(set, visit)| std::iter::repeat_n(set, visit.len()));
    let frames = cameras.iter().zip(set_of_frames).map(|(&camera, set)| Frame { camera, set });
    let sets = visits.iter().map(|visit| SetOfPath {
        representation: Representation { cameras: cells[visit[0]].clone(), ..usual.clone() },
        time_s: 0.0,
        refinement: Refinement::default(),
    });
    Ok((sets.collect(), frames.collect()))
}
