//! A subject on the device.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::planning::{PlannedViews, Planning, one_node};
use app_core::setup::{SceneArgs, Setup};
use codec::FrameCodec;
use coordinator::schedule::EqualNodes;
use depth_image::{Antialias, PinholeCamera, ViewCell, ViewPlanes};
use engine::GpuEngine;
use glam::Vec2;
use node::{Turn, WorkClass};
use probe::Prober;

use super::conditions::Conditions;

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
        let of = || format!("subject {:?}", conditions.name);
        let args = SceneArgs {
            lighting: conditions.lighting.parse().with_context(of)?,
            ..SceneArgs::new(fixtures::spec(&conditions.scene).with_context(of)?)
        };
        let setup = args.load().with_context(of)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let around = scaled(&setup.around, conditions.cell_ratio);
        Ok(Self { conditions: conditions.clone(), engine: engine.clone(), setup: Setup { around, ..setup }, args })
    }

    /// The ladder, for views with `antialias` samples a pixel. The seed draws the views.
    ///
    /// # Errors
    /// The subject has no ladder.
    pub fn planning(&self, antialias: Antialias, seed: u64) -> anyhow::Result<Planning> {
        let views = PlannedViews {
            size_px: self.conditions.size_px,
            planes: ViewPlanes { antialias, ..ViewPlanes::COLOR },
            codec: FrameCodec::default(),
            scene_time_s: 0.0,
            seed,
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

/// The corner cameras of a cell with a side `scale` times as long.
fn scaled(around: &[PinholeCamera], scale: f32) -> Vec<PinholeCamera> {
    let Some((cell, first)) = ViewCell::between(around).zip(around.first()) else { return Vec::new() };
    if scale == 1.0 {
        return around.to_vec();
    }
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    corners.map(|(x, y)| cell.camera_at(Vec2::new(x, y) * scale, first.size_px)).to_vec()
}
