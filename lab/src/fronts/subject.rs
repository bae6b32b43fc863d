//! Scenes with the views that rows of the ladder are measured on.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::{PAPER_VIEWS, VIEW_SIZE_PX};
use app_core::planning::{PlannedViews, Planning, one_node};
use app_core::setup::{SceneArgs, Setup};
use codec::FrameCodec;
use coordinator::schedule::EqualNodes;
use depth_image::{Antialias, PinholeCamera, ViewCell, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec2};
use node::{Turn, WorkClass};
use planner::Ladder;
use probe::Prober;

/// The side of sample images that `--sample-size auto` chooses.
const DEFAULT_SIDE_RATIO: f64 = 1.0;

/// A scene, and the views that rows are measured on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// The name in the report.
    pub name: &'static str,
    /// As for `--scene`.
    pub scene: &'static str,
    /// The side of the view cell, over that of the scene's own sample cameras.
    pub cell_ratio: f32,
    pub size_px: UVec2,
    /// As for `--lighting`.
    pub lighting: &'static str,
    /// V: the views that share the cost of a sample set.
    pub views: usize,
    /// Whether the quick form measures the subject.
    pub is_quick: bool,
}

/// The subjects of `study fronts`.
pub const SUBJECTS: [Conditions; 14] = [
    Conditions::of_scene("tree-terrain-125k").in_quick_runs(),
    Conditions::of_scene("urban").in_quick_runs(),
    Conditions::of_scene("courtyard").in_quick_runs(),
    Conditions { name: "grass", ..Conditions::of_scene("grass:0.2").in_quick_runs() },
    Conditions::of_scene("tree-terrain-30k"),
    Conditions::of_scene("tree-terrain-500k"),
    Conditions { name: "wind, 20 views a set", views: 20, ..Conditions::of_scene("tree-terrain-125k-wind") },
    Conditions::of_scene("bird-nest"),
    Conditions::of_scene("tree"),
    Conditions::of_scene("poles"),
    Conditions::of_scene("blocks"),
    Conditions { name: "urban, wide cell", cell_ratio: 2.0, ..Conditions::of_scene("urban") },
    Conditions { name: "courtyard, soft light", lighting: "soft 4, occlusion 4", ..Conditions::of_scene("courtyard") },
    Conditions { name: "blocks, large views", size_px: UVec2::new(640, 360), ..Conditions::of_scene("blocks") },
];

impl Conditions {
    /// A scene with the defaults of all else.
    pub const fn of_scene(scene: &'static str) -> Self {
        Self {
            name: scene,
            scene,
            cell_ratio: 1.0,
            size_px: VIEW_SIZE_PX,
            lighting: "phong",
            views: PAPER_VIEWS,
            is_quick: false,
        }
    }

    const fn in_quick_runs(self) -> Self {
        Self { is_quick: true, ..self }
    }
}

/// A loaded subject.
pub struct Subject {
    pub conditions: Conditions,
    engine: Arc<GpuEngine>,
    setup: Setup,
    args: SceneArgs,
}

impl Subject {
    /// Loads the scene, and widens or narrows its view cell.
    ///
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn load(engine: &Arc<GpuEngine>, conditions: &Conditions) -> anyhow::Result<Self> {
        let args =
            SceneArgs { lighting: conditions.lighting.parse()?, ..SceneArgs::new(fixtures::spec(conditions.scene)?) };
        let setup = args.load()?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let around = scaled(&setup.around, conditions.cell_ratio);
        Ok(Self { conditions: *conditions, engine: engine.clone(), setup: Setup { around, ..setup }, args })
    }

    /// The ladder, for views with `antialias` samples a pixel.
    ///
    /// # Errors
    /// The subject has no ladder.
    pub fn planning(&self, antialias: Antialias) -> anyhow::Result<Planning> {
        let views = PlannedViews {
            size_px: self.conditions.size_px,
            planes: ViewPlanes { antialias, ..ViewPlanes::COLOR },
            codec: FrameCodec::default(),
            scene_time_s: 0.0,
            seed: 0,
        };
        Planning::new(&self.setup, &self.args, &views)
    }

    /// Measures rows of a ladder of this subject.
    pub fn prober(&self, planning: &Planning) -> Prober {
        Prober::new(self.engine.clone(), planning.subject.clone(), Turn::of(WorkClass::Batch))
    }

    /// Prices on one node.
    ///
    /// # Errors
    /// The device fails.
    pub fn pricing(&self, prober: &mut Prober, planning: &Planning) -> anyhow::Result<EqualNodes> {
        let direct = prober.direct_costs(&planning.viewpoints, planning.codec)?;
        Ok(one_node(self.conditions.views, direct))
    }
}

/// The place of the row with the default methods, the largest images and this number of cameras.
///
/// # Errors
/// The ladder lacks it.
pub fn default_place(ladder: &Ladder, camera_count: u32) -> anyhow::Result<usize> {
    let place = ladder.rows().iter().position(|row| {
        row.sampling == sampling::METHODS[0].name
            && row.method == reconstruction::METHODS[0].name
            && row.side_ratio == DEFAULT_SIDE_RATIO
            && row.camera_count == camera_count
    });
    place.context("the ladder lacks the default row")
}

/// The corner cameras of a cell with a side `scale` times as long.
fn scaled(around: &[PinholeCamera], scale: f32) -> Vec<PinholeCamera> {
    let Some((cell, first)) = ViewCell::between(around).zip(around.first()) else { return Vec::new() };
    if scale == 1.0 {
        return around.to_vec();
    }
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    corners.map(|(x, y)| cell.camera_at(Vec2::new(x, y) * scale, first.size_px)).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_can_be_loaded_and_four_are_quick() {
        assert_eq!(SUBJECTS.iter().filter(|subject| subject.is_quick).count(), 4);
        for subject in &SUBJECTS {
            let spec = fixtures::spec(subject.scene).unwrap();
            assert!(!matches!(spec, scene::SceneSpec::File(_)), "{spec} is no file");
            subject.lighting.parse::<render::Lighting>().unwrap();
        }
    }
}
