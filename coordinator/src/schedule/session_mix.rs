//! The sessions of one workload, and what they ask for together.

use std::array;
use std::sync::Arc;

use cluster::{Costs, Quality, SharedLightCosts};
use depth_image::PinholeCamera;

use super::operations::operations;
use super::{Opening, PolicyOverride};

impl Opening {
    fn views_per_s(&self) -> Option<f64> {
        Some(self.frames_per_s? * self.views_per_set as f64)
    }

    /// Views in the time of a set, at least 1.
    fn weight(&self, set_s: f64) -> f64 {
        self.views_per_s().map_or(self.views_per_set as f64, |rate| rate * set_s).max(1.0)
    }
}

/// Sessions in the order in which they were opened, with the demand that each has now.
#[derive(Debug, Clone, Default)]
pub(super) struct SessionMix(Vec<Arc<Opening>>);

impl SessionMix {
    pub(super) fn add(&mut self, opening: &Opening) {
        self.remove(opening.session);
        self.0.push(Arc::new(opening.clone()));
    }

    pub(super) fn remove(&mut self, number: u64) {
        self.0.retain(|session| session.session != number);
    }

    fn of_number(&mut self, number: u64) -> impl Iterator<Item = &mut Opening> {
        self.0.iter_mut().filter(move |session| session.session == number).map(Arc::make_mut)
    }

    pub(super) fn set_viewpoints(&mut self, number: u64, viewpoints: &[PinholeCamera]) {
        self.of_number(number).for_each(|session| session.viewpoints = viewpoints.to_vec());
    }

    pub(super) fn set_demand(&mut self, number: u64, views: usize, frames_per_s: Option<f64>) {
        self.of_number(number)
            .for_each(|session| (session.views_per_set, session.frames_per_s) = (views, frames_per_s));
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn numbers(&self) -> Vec<u64> {
        self.0.iter().map(|session| session.session).collect()
    }

    pub(super) fn contains(&self, number: u64) -> bool {
        self.0.iter().any(|session| session.session == number)
    }

    pub(super) fn viewpoints(&self) -> Vec<PinholeCamera> {
        self.0.iter().flat_map(|session| session.viewpoints.iter().copied()).collect()
    }

    fn rated(&self) -> impl Iterator<Item = &Arc<Opening>> + Clone {
        self.0.iter().filter(|session| session.frames_per_s.is_some())
    }

    /// Sessions with a rate.
    pub(super) fn viewers(&self) -> usize {
        self.rated().count()
    }

    pub(super) fn has_batch(&self) -> bool {
        self.viewers() < self.0.len()
    }

    /// V of all sessions.
    pub(super) fn views(&self) -> usize {
        self.0.iter().fold(0, |sum, session| sum.saturating_add(session.views_per_set))
    }

    /// Views of sessions without a rate, which ask for all of a set at once.
    pub(super) fn views_at_once(&self) -> usize {
        let batches = self.0.iter().filter(|session| session.frames_per_s.is_none());
        batches.fold(0, |sum, session| sum.saturating_add(session.views_per_set))
    }

    /// Views a second that sessions with a rate ask for, undegraded.
    pub(super) fn views_per_s(&self) -> f64 {
        self.rated().filter_map(|session| session.views_per_s()).sum()
    }

    /// What sessions force: it holds while all of them state the same.
    pub(super) fn policy_override(&self) -> PolicyOverride {
        let first = self.0.first().map(|session| session.policy_override).unwrap_or_default();
        if self.all_force(first) { first } else { PolicyOverride::default() }
    }

    /// Whether every session states this.
    pub(super) fn all_force(&self, policy_override: PolicyOverride) -> bool {
        self.0.iter().all(|session| session.policy_override == policy_override)
    }

    /// The method by which most sessions have their views reconstructed; of several, the first.
    pub(super) fn usual_method(&self) -> Option<&str> {
        let methods = self.0.iter().map(|session| session.method.as_str());
        methods.clone().rev().max_by_key(|method| methods.clone().filter(|other| other == method).count())
    }

    /// Where the time of views goes by the method of most sessions, as measured for the first of them.
    pub(super) fn shared_light(&self) -> Option<SharedLightCosts> {
        let usual_method = self.usual_method()?;
        self.0.iter().find(|session| session.method == usual_method)?.shared_light
    }

    /// The qualities that every session with a rate falls back to, in the same order.
    pub(super) fn fallbacks(&self) -> &[Quality] {
        let Some(first) = self.rated().next().map(|session| &session.fallbacks) else { return &[] };
        let pairs = self.rated().map(|other| first.iter().zip(&other.fallbacks));
        let common = pairs.map(|pairs| pairs.take_while(|(own, other)| own == other).count()).min();
        &first[..common.unwrap_or(0)]
    }

    /// Costs of the mean view, where each is shown for `set_s`; sampling costs are those of the first session. `None`
    /// without sessions.
    pub(super) fn costs(&self, set_s: f64) -> Option<Costs> {
        mean_costs(self.0.iter(), set_s)
    }

    /// The same of sessions with a rate alone.
    pub(super) fn rated_costs(&self, set_s: f64) -> Option<Costs> {
        mean_costs(self.rated(), set_s)
    }
}

fn mean_costs<'a>(sessions: impl Iterator<Item = &'a Arc<Opening>> + Clone, set_s: f64) -> Option<Costs> {
    let first = sessions.clone().next()?.costs;
    // A mean of equal costs would differ from them by rounding.
    if sessions.clone().all(|session| session.costs == first) {
        return Some(first);
    }
    let all: f64 = sessions.clone().map(|session| session.weight(set_s)).sum();
    let [_, direct_view_s, reconstruct_view_s, _, encode_view_s] = array::from_fn(|i| {
        sessions.clone().map(|session| session.weight(set_s) * operations(&session.costs)[i]).sum::<f64>() / all
    });
    Some(Costs { direct_view_s, reconstruct_view_s, encode_view_s, ..first })
}

#[cfg(test)]
mod tests {
    use cluster::PolicyChoice;

    use super::*;
    use crate::schedule::test_support::{COSTS, opening};

    const RATED: Option<f64> = Some(10.0);

    fn quality(lighting: &str) -> Quality {
        Quality {
            lighting: lighting.to_owned(),
            method: "joint_carve".to_owned(),
            sample_side_ratio: 1.0,
            frame_rate_ratio: 1.0,
        }
    }

    fn mix(openings: &[Opening]) -> SessionMix {
        let mut mix = SessionMix::default();
        openings.iter().for_each(|opening| mix.add(opening));
        mix
    }

    #[test]
    fn a_forced_policy_holds_while_all_sessions_force_it() {
        let forced = opening(1, PolicyChoice::Direct, 1);
        let mut sessions = mix(&[forced.clone(), Opening { session: 2, ..forced.clone() }]);
        assert_eq!(sessions.policy_override(), forced.policy_override);
        sessions.add(&opening(3, PolicyChoice::Auto, 1));
        assert_eq!(sessions.policy_override(), PolicyOverride::default());
        sessions.remove(3);
        assert_eq!(sessions.policy_override(), forced.policy_override);
    }

    #[test]
    fn fallbacks_are_those_that_all_rated_sessions_have_in_common() {
        let [a, b, c] = ["a", "b", "c"].map(quality);
        let rated = |session, fallbacks: &[&Quality]| Opening {
            frames_per_s: RATED,
            fallbacks: fallbacks.iter().copied().cloned().collect(),
            ..opening(session, PolicyChoice::Auto, 1)
        };
        let batch = opening(9, PolicyChoice::Auto, 1);
        let mut sessions = mix(&[batch, rated(1, &[&a, &b]), rated(2, &[&a, &b, &c])]);
        assert_eq!(sessions.fallbacks(), [a.clone(), b.clone()]);
        sessions.add(&rated(3, &[&a, &c]));
        assert_eq!(sessions.fallbacks(), std::slice::from_ref(&a));
        sessions.add(&rated(4, &[&b]));
        assert_eq!(sessions.fallbacks(), []);
        assert_eq!(mix(&[opening(1, PolicyChoice::Auto, 1)]).fallbacks(), [], "batches have none");
    }

    #[test]
    fn costs_of_views_are_weighted_by_their_number() {
        let small = opening(1, PolicyChoice::Auto, 30);
        let costs = Costs { reconstruct_view_s: 0.049, sample_image_s: 7.0, ..COSTS };
        let large = Opening { session: 2, views_per_set: 10, costs, ..small.clone() };
        let both = mix(&[small.clone(), large.clone()]).costs(1.0).unwrap();
        assert!((both.reconstruct_view_s - 0.019).abs() < 1e-12, "{both:?}");
        assert_eq!(both.sample_image_s, COSTS.sample_image_s, "of the first");
        let live = Opening { views_per_set: 3, frames_per_s: RATED, ..small.clone() };
        assert_eq!(mix(&[live, large]).costs(1.0), Some(both), "30 views a second");
        assert_eq!(mix(&[small]).costs(1.0), Some(COSTS));
        assert_eq!(SessionMix::default().costs(1.0), None);
    }

    #[test]
    fn the_parts_of_a_view_are_those_of_the_method_that_most_sessions_have() {
        let light =
            |known_ratio| Some(SharedLightCosts { known_ratio, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.3 });
        let of = |session, method: &str, known_ratio| Opening {
            method: method.to_owned(),
            shared_light: light(known_ratio),
            ..opening(session, PolicyChoice::Auto, 1)
        };
        let mut sessions = mix(&[of(1, "fine", 0.8), of(2, "draft", 0.9)]);
        assert_eq!(sessions.shared_light(), light(0.8), "of two methods, the first");
        sessions.add(&of(3, "draft", 0.95));
        assert_eq!(sessions.shared_light(), light(0.9), "of three sessions, two are drafts");
        [4, 5, 6].into_iter().for_each(|session| sessions.add(&opening(session, PolicyChoice::Auto, 1)));
        assert_eq!(sessions.shared_light(), None, "most sessions have views from samples alone");
        assert_eq!(SessionMix::default().shared_light(), None);
    }
}
