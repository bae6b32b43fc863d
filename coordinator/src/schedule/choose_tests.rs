use cluster::Costs;

use super::*;
use crate::schedule::demand::{CurrentRoles, PolicyOverride};
use crate::schedule::test_support::{COSTS, nodes};

fn load(views: usize) -> Load {
    Load { images: 4, views, ..Load::default() }
}

fn choice_for(
    costs: Costs,
    load: Load,
    count: usize,
    policy: PolicyChoice,
    forced: Option<usize>,
) -> Result<Choice, ChoiceError> {
    let policy_override = PolicyOverride { policy, forced_samplers: forced, forced_tiles: None };
    choose(&Demand { load, nodes: &nodes(count, costs), policy_override, current: None })
}

fn auto(views: usize, count: usize) -> Choice {
    choice_for(COSTS, load(views), count, PolicyChoice::Auto, None).unwrap()
}

fn pipeline(costs: Costs, load: Load, count: usize) -> Choice {
    choice_for(costs, load, count, PolicyChoice::Pipeline, None).unwrap()
}

#[test]
fn many_views_are_reconstructed_and_few_views_are_drawn() {
    let many = auto(1000, 5);
    assert_eq!((many.policy, many.predicted.k_fd, many.division.sampler_count()), (Policy::TimeShare, 1, 1));
    assert!((many.predicted.pipeline_s - 2.505).abs() < 1e-9);
    assert!((many.predicted.direct_s - 20.2).abs() < 1e-9);
    assert!(many.time_s() < many.predicted.pipeline_s);
    let few = auto(3, 3);
    assert_eq!(few.policy, Policy::Direct);
    assert!(few.reason.starts_with("direct, predicted to be faster"), "{}", few.reason);
    for part in ["100.000 ms", "Pipeline: ", "Time-share: ", "Direct: ", "K_fd = 2"] {
        assert!(few.reason.contains(part), "{}", few.reason);
    }
}

#[test]
fn a_session_may_override_policy_and_k() {
    let policies = [PolicyChoice::Pipeline, PolicyChoice::Direct, PolicyChoice::TimeShare];
    for (choice, policy) in policies.into_iter().zip([Policy::Pipeline, Policy::Direct, Policy::TimeShare]) {
        assert_eq!(choice_for(COSTS, load(5), 5, choice, None).unwrap().policy, policy);
    }
    assert_eq!(choice_for(COSTS, load(5), 5, PolicyChoice::Pipeline, Some(3)).unwrap().division.sampler_count(), 3);
    for forced in [0, 5, 9] {
        let refused = choice_for(COSTS, load(5), 5, PolicyChoice::Pipeline, Some(forced));
        assert!(matches!(refused, Err(ChoiceError::ForcedSamplers { most: 4, .. })));
    }
    assert_eq!(choice_for(COSTS, load(1), 0, PolicyChoice::Auto, None), Err(ChoiceError::NoNodes));
}

#[test]
fn images_bound_the_number_of_samplers_and_one_node_makes_views() {
    for count in 1..30 {
        for views in [1, 10, 1000] {
            let samplers = pipeline(COSTS, load(views), count).division.sampler_count();
            assert!((1..=4).contains(&samplers) && (count == 1 || samplers < count));
        }
    }
}

#[test]
fn the_search_decides_where_whole_images_make_the_formula_clearly_worse() {
    // 4 images by 3 nodes take as long as by 2, which leave one more for views.
    let choice = pipeline(Costs { reconstruct_view_s: 0.049, ..COSTS }, load(5), 5);
    assert_eq!((choice.predicted.k_fd, choice.predicted.enumerated), (3, 2));
    assert!(choice.predicted.k_fd_s <= choice.predicted.enumerated_s * WORTH);
    assert_eq!(choice.division.sampler_count(), 3, "without a clear difference the formula decides");
    let choice = pipeline(Costs { reconstruct_view_s: 0.119, ..COSTS }, load(4), 6);
    assert!(choice.time_s() <= choice.predicted.enumerated_s * WORTH, "{}", choice.reason);
}

#[test]
fn sequential_images_of_a_set_stay_on_one_node() {
    let sequential = |sets, views| Load { sets, images_are_sequential: true, ..load(views) };
    assert_eq!(pipeline(COSTS, sequential(1, 20), 5).division.sampler_count(), 1, "one set, one node");
    let choice = pipeline(COSTS, sequential(30, 20), 5);
    assert!(choice.division.sampler_count() > 1 && choice.reason.contains("whole sets in turn"), "{choice:?}");
}

#[test]
fn unequal_nodes_get_the_role_that_they_are_fast_at() {
    let mut nodes = nodes(4, COSTS);
    // A slow sampler that reconstructs as fast as any, behind the others in name.
    nodes[0].costs.sample_image_s = 1.0;
    let policy_override = PolicyOverride { policy: PolicyChoice::Pipeline, forced_samplers: None, forced_tiles: None };
    for views in [1, 10, 100, 1000] {
        let choice = choose(&Demand { load: load(views), nodes: &nodes, policy_override, current: None }).unwrap();
        assert!(!choice.division.samples[0] && choice.reason.contains("unequal"), "{choice:?}");
        assert!(choice.predicted.pipeline_s <= choice.predicted.k_fd_s);
    }
}

#[test]
fn roles_stay_where_nothing_is_clearly_better() {
    let nodes = nodes(5, COSTS);
    let samples = vec![false, false, false, true, false];
    let current = CurrentRoles { policy: Policy::Pipeline, samples: samples.clone(), tiles: 1, relay_fanout: None };
    let policy_override = PolicyOverride { policy: PolicyChoice::Pipeline, forced_samplers: None, forced_tiles: None };
    let demand = Demand { load: load(1000), nodes: &nodes, policy_override, current: Some(&current) };
    assert_eq!(choose(&demand).unwrap().division.samples, samples);
    let few = choose(&Demand { load: load(5), ..demand }).unwrap();
    assert!(few.division.samples[3] && few.division.sampler_count() > 1, "{few:?}");
    let any = PolicyOverride::default();
    let near = CurrentRoles { policy: Policy::Direct, samples, tiles: 1, relay_fanout: None };
    let views = 4;
    let kept = choose(&Demand { load: load(views), policy_override: any, current: Some(&near), ..demand }).unwrap();
    assert_eq!(kept.policy, Policy::Direct);
}
