//! The rows among which budgets choose, and plans on one device.

use anyhow::Context as _;
use cluster::BudgetRequest;
use coordinator::plan_for_session;
use coordinator::schedule::BudgetPlan;
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, ViewPlanes};
use node::{DirectWork, Engine, Turn, ViewProbes, WorkClass};
use planner::{Budget, Demand, Row};
use reconstruction::ReconstructionMethod;
use render::Lighting;

use crate::delivery::{Terms, request};
use crate::exit::BadInput;
use crate::setup::Setup;

/// Numbers of sample cameras and densities of samples whose light is looked up.
const LIGHT_CAMERAS: [u32; 3] = [1, 2, 4];
const LIGHT_DENSITIES: [f64; 3] = [0.25, 0.5, 1.0];
/// The same of samples that views are made from alone.
const IMAGE_CAMERAS: [u32; 2] = [1, 4];
const IMAGE_DENSITIES: [f64; 2] = [0.5, 1.0];
/// Direct drawing has a sixteenth, an eighth, a quarter, half and all of the rays.
const HALVED_RAYS: [u32; 5] = [4, 3, 2, 1, 0];

/// The rows among which budgets choose in a light, the coarsest samples first and direct drawing in that light last; none in a
/// light that is not known. Light that takes no rays is not looked up: views would be drawn directly.
#[must_use]
pub fn rows(lighting: &str) -> Vec<Row> {
    let Ok(lighting) = lighting.parse::<Lighting>() else { return Vec::new() };
    let mut rows = Vec::new();
    if lighting.is_traced() {
        for density in LIGHT_DENSITIES {
            for camera_count in LIGHT_CAMERAS {
                let qualities =
                    LightCacheQuality::ALL.into_iter().filter(|quality| *quality != LightCacheQuality::Exact);
                rows.extend(qualities.map(|quality| {
                    let method = ReconstructionMethod::from(quality).to_string();
                    Row::Samples { method, camera_count, density }
                }));
            }
        }
    }
    for density in IMAGE_DENSITIES {
        for camera_count in IMAGE_CAMERAS {
            let methods = ReconstructionMethod::planned_from_images().map(|method| method.to_string());
            rows.extend(methods.map(|method| Row::Samples { method, camera_count, density }));
        }
    }
    for times in HALVED_RAYS {
        let fewer = lighting.with_rays_halved(times);
        // Few rays cannot be halved so often.
        if times == 0 || fewer != lighting.with_rays_halved(times - 1) {
            rows.push(Row::Direct { lighting: fewer.to_string(), ray_ratio: 0.5_f64.powi(times as i32) });
        }
    }
    rows
}

/// A plan for views of a scene on one device.
#[derive(Debug, Clone, Copy)]
pub struct PlannedViews {
    /// The budget to keep.
    pub budget: Budget,
    /// A view as all are, but for its place.
    pub typical_view: PinholeCamera,
    /// Samples a pixel.
    pub antialias: Antialias,
    /// The light of the views.
    pub lighting: Lighting,
    /// The work that the views are part of.
    pub demand: Demand,
    /// Chooses the views of the test.
    pub number: u64,
}

impl PlannedViews {
    /// The plan on a device with the scene, which has measured nothing yet.
    ///
    /// # Errors
    /// For a scene or a light whose views no budget is kept for, and where the device fails.
    pub fn begin(&self, setup: &Setup, engine: &dyn Engine) -> anyhow::Result<BudgetPlan> {
        let mut settings = setup.offer.settings.clone();
        (settings.method, settings.lighting) = (None, Some(self.lighting.to_string()));
        let budget = BudgetRequest { budget: Some(self.budget.to_string()), names_method: false };
        let terms = Terms { budget, ..Terms::default() };
        let mut request = request(settings, terms, &[self.typical_view])?;
        request.planes.antialias = self.antialias;
        let plan = plan_for_session(self.number, &request, &setup.offer, rows, self.demand);
        let mut plan = plan.map_err(|status| BadInput(status.message().to_owned()))?;
        let planes = ViewPlanes { antialias: self.antialias, ..ViewPlanes::COLOR };
        let view = DirectWork::of(&plan.workload, vec![self.typical_view], planes);
        plan.workload.traced_pixel_count = engine.traced_pixel_count(&view, Turn::of(WorkClass::Batch))?;
        Ok(plan)
    }
}

/// Measures until the plan is made; `observe` sees the plan after each measurement. A row that cannot be measured is not chosen.
///
/// # Errors
/// The truth cannot be measured: the device or the scene fails.
pub fn measure(
    plan: &mut BudgetPlan,
    probes: &dyn ViewProbes,
    mut observe: impl FnMut(&BudgetPlan),
) -> anyhow::Result<()> {
    while let Some(probe) = plan.planner.next_probe() {
        let request = plan.measurement(&probe).context("there is no such row")?;
        let budget = request.budget.clone().context("no measurement for a budget")?;
        match probes.probe(&request, &budget) {
            Ok(measured) => plan.planner.answer(&measured.probed(probe.id))?,
            Err(status) => {
                let is_truth = plan.planner.request().exact == Some(probe.row);
                anyhow::ensure!(!is_truth, "views cannot be drawn directly: {}", status.message());
                tracing::warn!(method = request.method, reason = status.message(), "not measured");
                plan.planner.fail(probe.id);
            }
        }
        observe(plan);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expensive_light_has_49_valid_rows_and_plain_light_has_those_of_images() {
        let lit = rows("soft 16, occlusion 16");
        assert!(lit.len() == planner::MAX_ROWS && lit.iter().all(|row| row.validate().is_ok()));
        let texts: std::collections::BTreeSet<String> = lit.iter().map(ToString::to_string).collect();
        assert_eq!(texts.len(), lit.len(), "all differ");
        let direct: Vec<&Row> = lit.iter().filter(|row| matches!(row, Row::Direct { .. })).collect();
        let fewest = Row::Direct { lighting: "soft 1, occlusion 1".to_owned(), ray_ratio: 0.0625 };
        let all = Row::Direct { lighting: "soft 16, occlusion 16".to_owned(), ray_ratio: 1.0 };
        assert_eq!((direct.first(), direct.last()), (Some(&&fewest), Some(&&all)));
        assert_eq!(rows("phong").len(), 9, "images, and direct drawing once");
        assert_eq!(rows("soft 4").len(), 36 + 8 + 3, "no fewer rays than one");
        assert!(rows("moonlight").is_empty());
    }
}
