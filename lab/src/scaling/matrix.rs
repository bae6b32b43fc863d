//! Points to measure, and the time that they take.

use cluster::{Costs, PolicyChoice};
use coordinator::schedule::{Demand, Load, NodeCosts, PolicyOverride, choose};

use super::point::PointSettings;

/// P of the last row of Table 1.
pub const PAPER_NODES: usize = 11;
/// V of Table 1, Fig. 7 and Fig. 8.
pub const PAPER_VIEWS: usize = 1000;
/// P of Fig. 5.
pub const FEW_NODES: usize = 5;
/// V of the paper's headline.
pub const HEADLINE_VIEWS: usize = 290;
/// The fewest sets that count: more of a single set may have been made ahead than of the next one.
const LEAST_SETS: f64 = 2.0;
/// Seconds of opening a session, beside the work.
const SESSION_S: f64 = 1.0;

use PolicyChoice::{Auto, Direct, Pipeline, TimeShare};

/// The points that are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    Full,
    /// A stated subset.
    Quick,
    /// Both policies of Table 1 at each of its numbers of nodes.
    Table1,
}

/// The size of the measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    pub form: Form,
    pub nodes: usize,
    pub views: usize,
    /// Samples hold light.
    pub is_lit: bool,
}

impl Extent {
    /// Whether costs are timed once, before the points of a number of nodes, and not after them or one view at a time.
    pub fn times_once(self) -> bool {
        self.form == Form::Quick && self.is_lit
    }

    /// Seconds that sets are counted for, where one set takes less.
    fn counted_s(self) -> f64 {
        if self.form == Form::Full { 20.0 } else { 12.0 }
    }

    /// The numbers of nodes P, from the greatest down: nodes are only ever ended.
    pub fn node_counts(self) -> Vec<usize> {
        let all: &[usize] = match self.form {
            Form::Full => &[11, 10, 9, 8, 7, 6, 5, 4, 3, 2],
            Form::Quick => &[11, 5],
            Form::Table1 => &[11, 10, 9, 8, 7, 6, 5],
        };
        let smaller = all.iter().copied().filter(|&nodes| nodes < self.nodes);
        [self.nodes].into_iter().chain(smaller).collect()
    }

    /// Policies and numbers of views at a number of nodes.
    pub fn points(self, nodes: usize) -> Vec<(PolicyChoice, usize)> {
        let all = match self.form {
            Form::Full => full_points(nodes),
            Form::Quick => self.quick_points(nodes),
            Form::Table1 => vec![(Pipeline, PAPER_VIEWS), (Auto, PAPER_VIEWS)],
        };
        all.into_iter().filter(|(_, views)| *views <= self.views).collect()
    }

    fn quick_points(self, nodes: usize) -> Vec<(PolicyChoice, usize)> {
        match nodes {
            _ if self.is_lit => vec![(Auto, PAPER_VIEWS)],
            _ if nodes == self.nodes => [10, 100, PAPER_VIEWS]
                .into_iter()
                .flat_map(|views| [(Pipeline, views), (Auto, views), (Direct, views)])
                // Naive at V = 1000 takes as long as all else: its T grows as V.
                .filter(|point| ![(Auto, 10), (Auto, 100), (Direct, PAPER_VIEWS)].contains(point))
                .chain([(TimeShare, 100)])
                .collect(),
            FEW_NODES => vec![(Pipeline, 10), (Pipeline, 100), (Pipeline, HEADLINE_VIEWS), (Direct, 10), (Direct, 100)],
            _ => vec![(Pipeline, 10), (Pipeline, 100), (Direct, 10)],
        }
    }
}

fn full_points(nodes: usize) -> Vec<(PolicyChoice, usize)> {
    let more: &[usize] = if nodes == FEW_NODES { &[20, 50, 200, HEADLINE_VIEWS, 500] } else { &[] };
    let mut counts: Vec<usize> = [10, 100, PAPER_VIEWS].iter().chain(more).copied().collect();
    counts.sort_unstable();
    counts.into_iter().flat_map(|views| [Pipeline, TimeShare, Auto, Direct].map(|policy| (policy, views))).collect()
}

/// The time between two sets that the schedule predicts for P equal nodes.
pub fn predicted_s(costs: &Costs, images: usize, nodes: usize, policy: PolicyChoice, views: usize) -> f64 {
    let nodes = vec![NodeCosts { costs: *costs, transfer_image_s: None }; nodes];
    let load = Load { images, sets: 2, views, images_are_sequential: costs.in_order, ..Load::default() };
    let policy_override = PolicyOverride { policy, ..PolicyOverride::default() };
    choose(&Demand { load, nodes: &nodes, policy_override, current: None }).map_or(f64::NAN, |choice| choice.time_s())
}

/// A point with its sets, and the seconds that it takes, about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    pub settings: PointSettings,
    pub nodes: usize,
    /// Seconds of the wall clock, about.
    pub about_s: f64,
}

/// The sets that count follow from the measured costs.
pub fn planned(
    extent: Extent,
    costs: &Costs,
    images: usize,
    nodes: usize,
    policy: PolicyChoice,
    views: usize,
) -> Planned {
    let period_s = predicted_s(costs, images, nodes, policy, views);
    let most = if extent.form == Form::Full { 8.0 } else { 5.0 };
    let counted_sets = (extent.counted_s() / period_s).ceil().clamp(LEAST_SETS, most) as u32;
    let sampled_s = if policy == Direct { 0.0 } else { costs.sample_image_s * images as f64 };
    // Set 0, the sets that count, and the rest of the next one.
    let about_s = (f64::from(counted_sets) + 1.5) * period_s + sampled_s + SESSION_S;
    Planned { settings: PointSettings { policy, views, counted_sets }, nodes, about_s }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs {
        sample_image_s: 0.45,
        direct_view_s: 0.13,
        reconstruct_view_s: 0.08,
        load_set_s: 0.24,
        encode_view_s: 0.002,
        in_order: false,
        tiles: None,
    };

    fn all(extent: Extent) -> Vec<Planned> {
        let of = |nodes: usize| extent.points(nodes).into_iter().map(move |point| (nodes, point));
        let points = extent.node_counts().into_iter().flat_map(of);
        points.map(|(nodes, (policy, views))| planned(extent, &COSTS, 4, nodes, policy, views)).collect()
    }

    #[test]
    fn the_quick_form_has_table_1s_ends_and_takes_minutes() {
        let quick = all(Extent { form: Form::Quick, nodes: 11, views: 1000, is_lit: false });
        let has = |policy, nodes, views| {
            quick.iter().any(|p| p.settings.policy == policy && p.nodes == nodes && p.settings.views == views)
        };
        assert!(has(Pipeline, 11, 1000) && has(Auto, 11, 1000) && has(Direct, 11, 100) && has(Pipeline, 5, 290));
        let about_s: f64 = quick.iter().map(|planned| planned.about_s).sum();
        assert!((100.0..400.0).contains(&about_s), "{about_s}");
    }

    #[test]
    fn table_1_has_each_number_of_nodes_of_the_papers() {
        let table = all(Extent { form: Form::Table1, nodes: 11, views: 1000, is_lit: false });
        for row in super::super::paper::TABLE_1 {
            let points = table.iter().filter(|point| point.nodes == row.nodes && point.settings.views == PAPER_VIEWS);
            assert_eq!(points.count(), 2, "{}", row.nodes);
        }
    }

    #[test]
    fn the_full_form_has_all_of_table_1() {
        let full = all(Extent { form: Form::Full, nodes: 11, views: 1000, is_lit: false });
        for nodes in 2..=11 {
            let views = |policy| {
                full.iter().any(|p| p.nodes == nodes && p.settings.policy == policy && p.settings.views == 1000)
            };
            assert!([Pipeline, TimeShare, Auto, Direct].into_iter().all(views), "{nodes}");
        }
        let counts = Extent { form: Form::Full, nodes: 6, views: 1000, is_lit: false }.node_counts();
        assert_eq!(counts, [6, 5, 4, 3, 2], "fewer nodes than the paper's");
    }
}
