//! Prices in plain or in expensive light.

use coordinator::schedule::EqualNodes;
use depth_image::{Antialias, ViewPlanes};
use engine::GpuEngine;
use planner::{Price, Pricing, Row, RowCosts};
use probe::Light;
use std::sync::Arc;

use crate::fronts::conditions::Conditions;
use crate::fronts::subject::Subject;

/// The light in which half of the subjects are priced.
pub const EXPENSIVE: &str = "soft 16, occlusion 16";

/// Prices on one node. Where sampling is priced in another light than it is measured in, g_s has a factor.
#[derive(Debug, Clone, Copy)]
pub struct Priced {
    node: EqualNodes,
    sampling_factor: f64,
}

impl Priced {
    /// Prices in the light of the conditions.
    pub fn plain(node: EqualNodes) -> Self {
        Self { node, sampling_factor: 1.0 }
    }

    /// Prices in expensive light. The factor is that of the first row's images; direct drawing is measured.
    pub fn lit(engine: &Arc<GpuEngine>, conditions: &Conditions) -> anyhow::Result<Self> {
        let conditions = Conditions { lighting: EXPENSIVE.to_owned(), ..conditions.clone() };
        let subject = Subject::load(engine, &conditions)?;
        let planning = subject.planning(Antialias::NONE, conditions.seed)?;
        let mut prober = subject.prober(&planning);
        let (of, cameras) = (&planning.representations[0], planning.viewpoints.first(1));
        let mut sample_s =
            |light: Light| anyhow::Ok(prober.measure(of, light, &cameras, ViewPlanes::COLOR)?.costs.sample_image_s);
        let sampling_factor = sample_s(Light::Session)? / sample_s(Light::Screening)?;
        Ok(Self { node: subject.pricing(&mut prober, &planning)?, sampling_factor })
    }
}

impl Pricing for Priced {
    fn row(&self, row: &Row, costs: &RowCosts) -> Price {
        self.node.row(row, &RowCosts { sample_image_s: costs.sample_image_s * self.sampling_factor, ..*costs })
    }

    fn direct(&self) -> Price {
        self.node.direct()
    }
}
