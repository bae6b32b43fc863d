use super::*;
use crate::schedule::test_support::Random;

fn live(live_nodes: f64) -> Need {
    Need { live_nodes, ..Need::default() }
}

const BATCH: Need = Need { live_nodes: 0.0, has_batch: true, is_idle: false };

/// Each workload holds these nodes.
fn shares(nodes: usize, claims: &[(f64, &[usize])]) -> NodeShares {
    let tie = |held: &[usize], node: usize| Tie { is_usable: true, is_held: held.contains(&node), worth: 1.0 };
    let claim = |(weight, held): &(f64, &[usize])| Claim {
        weight: *weight,
        ties: (0..nodes).map(|node| tie(held, node)).collect(),
    };
    NodeShares::new(claims.iter().map(claim).collect(), nodes)
}

fn held(shares: &NodeShares) -> Vec<Vec<usize>> {
    let held = |claim: &Claim| (0..shares.nodes).filter(|&node| claim.holds(node)).collect();
    shares.claims.iter().map(held).collect()
}

/// Steps as long as the division is uneven.
fn settle(shares: &mut NodeShares) -> usize {
    (0..1000).take_while(|_| shares.is_uneven() && shares.step()).count()
}

#[test]
fn batches_take_equal_shares_of_what_live_sessions_leave_and_a_twentieth_at_least() {
    assert_eq!(weights(&[live(1.0), BATCH, BATCH], 5), [1.0, 2.0, 2.0]);
    let both = Need { live_nodes: 0.5, ..BATCH };
    assert_eq!(weights(&[live(1.0), both, BATCH], 5), [1.0, 2.25, 1.75]);
    assert_eq!(weights(&[live(19.9), BATCH], 20), [19.9, 1.0]);
    assert_eq!(weights(&[BATCH], 3), [3.0]);
    let idle = Need { is_idle: true, ..both };
    assert_eq!(weights(&[idle, BATCH, live(0.0)], 4), [0.0, 4.0, LEAST_WEIGHT], "idle ones need nothing");
}

#[test]
fn nodes_are_counted_out_in_proportion_with_one_for_each_workload() {
    assert_eq!(even_counts(&[3.0, 1.0], 4), [3, 1]);
    assert_eq!(even_counts(&[1.0, 1.0, 1.0], 8), [3, 3, 2], "remainders in order");
    assert_eq!(even_counts(&[0.01, 7.0, 3.0], 11), [1, 7, 3], "the rest is shared by the others");
    assert_eq!(even_counts(&[0.0, 5.0], 4), [0, 4], "an idle one needs none");
    assert_eq!(even_counts(&[1.0, 2.0, 9.0], 2), [1, 1, 1], "nodes carry several");
    assert_eq!(even_counts(&[0.0, 0.0], 3), [0, 0]);
}

#[test]
fn even_counts_are_within_rounding_of_the_weights() {
    let mut random = Random(3);
    for _ in 0..2000 {
        let nodes = 1 + random.below(40) as usize;
        let weights: Vec<f64> = (0..1 + random.below(6)).map(|_| random.between(0.01, 100.0)).collect();
        let counts = even_counts(&weights, nodes);
        if weights.len() > nodes {
            assert!(counts.iter().all(|&count| count == 1));
            continue;
        }
        assert_eq!(counts.iter().sum::<usize>(), nodes, "{weights:?}");
        assert!(counts.iter().all(|&count| count >= 1));
        let large = |i: &usize| counts[*i] > 1;
        let all: f64 = (0..weights.len()).filter(large).map(|i| weights[i]).sum();
        let shared: usize = (0..weights.len()).filter(large).map(|i| counts[i]).sum();
        for i in (0..weights.len()).filter(large) {
            let quota = weights[i] / all * shared as f64;
            assert!((counts[i] as f64 - quota).abs() < 2.0, "{weights:?} {counts:?}");
        }
    }
}

#[test]
fn a_single_workload_has_all_nodes_that_can_serve_it() {
    let mut alone = shares(4, &[(1.0, &[])]);
    alone.claims[0].ties[2].is_usable = false;
    alone.give_free();
    assert_eq!(held(&alone), [vec![0, 1, 3]]);
    assert!(!alone.house(true) && !alone.step());
}

#[test]
fn a_new_workload_takes_its_share_of_those_with_most_nodes_for_their_work() {
    let mut three = shares(8, &[(1.0, &[0, 1, 2, 3, 4]), (2.0, &[5, 6, 7]), (1.0, &[])]);
    three.claims[0].ties[1].worth = 0.0;
    assert!(three.house(true));
    assert_eq!(held(&three), [vec![2, 3, 4], vec![5, 6, 7], vec![0, 1]], "1 first, which has no role");
    let mut idle = shares(3, &[(0.0, &[0, 1, 2]), (2.0, &[])]);
    assert!(idle.house(true));
    assert_eq!(held(&idle), [vec![2], vec![0, 1, 2]], "an idle one shares its last node");
}

#[test]
fn a_new_workload_shares_the_node_with_the_least_work_while_nodes_may_not_be_taken() {
    let mut two = shares(3, &[(1.0, &[0, 1]), (0.1, &[2]), (3.0, &[])]);
    assert!(!two.house(false));
    assert_eq!(held(&two), [vec![0, 1], vec![2], vec![2]]);
    assert!(two.is_uneven(), "it has no node of its own");
    assert!(two.step());
    assert_eq!(held(&two), [vec![1], vec![0], vec![2]], "the one that it shared with gets another");
}

#[test]
fn free_nodes_go_where_the_most_work_is() {
    let mut two = shares(5, &[(1.0, &[0, 1]), (3.0, &[2]), (0.0, &[0])]);
    two.give_free();
    assert_eq!(held(&two), [vec![0, 1], vec![2, 3, 4], vec![0]]);
    let mut homeless = shares(2, &[(1.0, &[0]), (0.0, &[])]);
    homeless.give_free();
    assert_eq!(held(&homeless), [vec![0], vec![1]], "one without a node comes first, though it is idle");
}

#[test]
fn workloads_that_outnumber_nodes_are_spread_over_them() {
    let mut many = shares(2, &[(1.0, &[0]), (1.0, &[1]), (2.0, &[]), (1.0, &[]), (1.0, &[])]);
    assert!(!many.house(true), "there is none to take");
    assert!(many.claims.iter().all(|claim| claim.held() == 1));
    settle(&mut many);
    assert_eq!(many.work(), [3.0, 3.0]);
}

#[test]
fn any_division_settles_with_a_node_for_each_and_shares_by_weight() {
    let mut random = Random(5);
    for round in 0..2000 {
        let nodes = 1 + random.below(10) as usize;
        let claims: Vec<Claim> = (0..1 + random.below(6))
            .map(|_| Claim {
                weight: if random.below(5) == 0 { 0.0 } else { random.between(0.01, 10.0) },
                ties: (0..nodes)
                    .map(|_| Tie { is_usable: true, is_held: random.below(3) == 0, worth: random.unit() })
                    .collect(),
            })
            .collect();
        let mut all = NodeShares::new(claims, nodes);
        all.give_free();
        all.house(round % 2 == 0);
        assert!(settle(&mut all) < 100, "{all:?}");
        assert!(all.claims.iter().all(|claim| claim.held() > 0), "{all:?}");
        assert!((0..nodes).all(|node| all.claims.iter().any(|claim| claim.holds(node))), "{all:?}");
        if !all.outnumber() {
            let worst = all.work().into_iter().fold(0.0, f64::max);
            assert!(worst <= UNEVEN * all.even_work() && all.awake().all(|i| all.own(i) > 0), "{all:?}");
        }
    }
}
