//! The samples of light that a session has where nobody names them: the cheapest for its views, by prediction.

use cluster::{Costs, Measured, SessionRequest, SharedLightCosts, TileCosts};

use crate::schedule::STILL_SET_S;

/// Numbers of sample cameras and densities to choose from.
const CAMERA_COUNTS: [usize; 3] = [1, 2, 4];
const DENSITIES: [f32; 3] = [0.25, 0.5, 1.0];
/// The time of points that no sample knows falls with cameras and density by these powers: most lie at edges and contacts, which
/// no camera knows.
const UNKNOWN_OF_CAMERAS: f64 = 0.2;
const UNKNOWN_OF_DENSITY: f64 = 0.2;
/// The longest time of a device for a set, unless the smallest takes longer: the first view waits for it.
const LONGEST_SET_S: f64 = 10.0;

/// The samples of light in one view cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightSamples {
    /// S; `None`: the cameras of the scene's rig.
    pub(crate) camera_count: Option<usize>,
    /// Texels of an image for a pixel of a view, each way. Surfaces come from the scene: they need no finer samples.
    pub(crate) density: f32,
}

/// The work that shares a set of samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SetDemand {
    /// P.
    pub(crate) nodes: usize,
    /// V.
    pub(crate) views: f64,
}

impl LightSamples {
    /// The rig's cameras, as dense as views.
    pub(crate) const FULL: Self = Self { camera_count: None, density: 1.0 };

    /// All samples that a session may have. In view cells the number of cameras follows from the cell's shape.
    pub(crate) fn all(request: &SessionRequest) -> Vec<Self> {
        let in_cells = !request.viewpoints.is_empty();
        let counts = if in_cells { vec![None] } else { CAMERA_COUNTS.map(Some).to_vec() };
        counts.iter().flat_map(|&camera_count| DENSITIES.map(|density| Self { camera_count, density })).collect()
    }

    /// The cheapest of some samples for a demand. `measured` are the costs of full samples of `cameras` cameras. Without the
    /// parts of a view nothing is predicted: full samples stay.
    pub(crate) fn cheapest(all: &[Self], measured: &Measured, cameras: usize, demand: SetDemand) -> Self {
        if measured.shared_light.is_none() {
            return Self::FULL;
        }
        let least_s = all.iter().map(|samples| samples.set_s(measured, cameras)).fold(f64::INFINITY, f64::min);
        let usable = all.iter().filter(|samples| samples.set_s(measured, cameras) <= LONGEST_SET_S.max(least_s));
        let cheapest =
            usable.min_by(|a, b| a.price_s(measured, cameras, demand).total_cmp(&b.price_s(measured, cameras, demand)));
        cheapest.copied().unwrap_or(Self::FULL)
    }

    /// The time to sample a set, in s.
    fn set_s(&self, measured: &Measured, cameras: usize) -> f64 {
        self.camera_count.unwrap_or(cameras) as f64 * self.predicted(measured, cameras).costs.sample_image_s
    }

    /// The nodes' time for a view, in s.
    fn price_s(&self, measured: &Measured, cameras: usize, demand: SetDemand) -> f64 {
        let costs = self.predicted(measured, cameras).costs;
        let set_s = self.set_s(measured, cameras) + demand.nodes as f64 * costs.load_set_s;
        set_s / demand.views.max(1.0) + costs.reconstruct_view_s
    }

    /// The costs of these samples, from those of full samples of `cameras` cameras.
    pub(crate) fn predicted(&self, measured: &Measured, cameras: usize) -> Measured {
        let Some(light) = measured.shared_light else { return measured.clone() };
        let ratio = self.camera_count.unwrap_or(cameras) as f64 / cameras.max(1) as f64;
        let density = f64::from(self.density);
        let texels = density * density;
        let unknown = ratio.powf(-UNKNOWN_OF_CAMERAS) * density.powf(-UNKNOWN_OF_DENSITY);
        let parts = SharedLightCosts {
            known_ratio: (1.0 - (1.0 - light.known_ratio) * unknown).clamp(0.0, 1.0),
            surfaces_s: light.surfaces_s,
            look_up_s: light.look_up_s * ratio,
            unknown_s: light.unknown_s * unknown,
        };
        let sample_image_s = measured.costs.sample_image_s * texels;
        let costs = Costs {
            sample_image_s,
            load_set_s: measured.costs.load_set_s * texels * ratio,
            reconstruct_view_s: parts.surfaces_s + parts.look_up_s + parts.unknown_s,
            tiles: measured.costs.tiles.and_then(|tiles| {
                TileCosts::of_image(sample_image_s, tiles.overhead_s.min(sample_image_s), tiles.row_shares)
            }),
            ..measured.costs
        };
        Measured { costs, shared_light: Some(parts), ..measured.clone() }
    }

    /// What the reason of a plan says of these samples.
    pub(crate) fn in_words(&self, demand: SetDemand) -> String {
        if *self == Self::FULL {
            return String::new();
        }
        let cameras = self.camera_count.map_or_else(String::new, |count| format!(" by {count} cameras"));
        let Self { density, .. } = self;
        format!(
            " Light is sampled{cameras} at {density} times the density of views, which costs least for {:.0} views a set.",
            demand.views
        )
    }
}

impl SetDemand {
    /// Of a session that is alone on this many nodes.
    pub(crate) fn of(request: &SessionRequest, nodes: usize) -> Self {
        let views = f64::from(request.views_per_set);
        let views = match request.frames_per_s {
            None => views,
            Some(rate) if request.timeline.moves() => views * rate * request.timeline.step_s.abs(),
            Some(rate) => views * rate * STILL_SET_S,
        };
        Self { nodes, views }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A city in views of 640×360 under `soft 16, occlusion 16`, four images.
    fn measured(sample_image_s: f64) -> Measured {
        let light = SharedLightCosts { known_ratio: 0.93, surfaces_s: 0.09, look_up_s: 0.028, unknown_s: 0.034 };
        let costs = Costs { sample_image_s, load_set_s: 0.06, reconstruct_view_s: 0.152, ..Costs::default() };
        Measured { costs, shared_light: Some(light), ..Measured::default() }
    }

    fn chosen(sample_image_s: f64, views: f64) -> (usize, f32) {
        let mut all = Vec::new();
        for camera_count in CAMERA_COUNTS.map(Some) {
            all.extend(DENSITIES.map(|density| LightSamples { camera_count, density }));
        }
        let chosen = LightSamples::cheapest(&all, &measured(sample_image_s), 4, SetDemand { nodes: 2, views });
        (chosen.camera_count.unwrap(), chosen.density)
    }

    #[test]
    fn few_views_have_few_samples_and_many_views_have_dense_ones() {
        assert_eq!(chosen(0.2, 1.0), (1, 0.25));
        let (cameras, density) = chosen(0.2, 290.0);
        assert!(cameras <= 2 && density == 1.0, "{cameras} {density}");
        let texels = [1.0, 5.0, 24.0, 100.0, 290.0, 5000.0].map(|views| {
            let (cameras, density) = chosen(0.2, views);
            cameras as f32 * density * density
        });
        assert!(texels.is_sorted(), "{texels:?}");
        assert!(chosen(5.0, 24.0).1 < 1.0, "expensive samples");
        assert_eq!(chosen(100.0, 1e6), (1, 0.25), "no set takes minutes");
    }

    #[test]
    fn full_samples_have_the_measured_costs_and_other_methods_keep_them() {
        let full = LightSamples { camera_count: Some(4), density: 1.0 };
        let predicted = full.predicted(&measured(0.2), 4);
        assert!((predicted.costs.reconstruct_view_s - 0.152).abs() < 1e-12, "{predicted:?}");
        assert_eq!(predicted.costs.sample_image_s, 0.2);
        let plain = Measured { shared_light: None, ..measured(0.2) };
        let demand = SetDemand { nodes: 1, views: 9.0 };
        assert_eq!(LightSamples::cheapest(&[full], &plain, 4, demand), LightSamples::FULL);
    }
}
