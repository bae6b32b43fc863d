use cluster::Costs;

use super::*;
use crate::schedule::test_support::{COSTS, Random, nodes};

fn unequal(random: &mut Random, count: usize) -> Vec<NodeCosts> {
    let node = |random: &mut Random| NodeCosts {
        costs: Costs {
            sample_image_s: random.between(0.02, 0.5),
            reconstruct_view_s: random.between(0.002, 0.05),
            load_set_s: random.between(0.001, 0.02),
            encode_view_s: random.between(0.0005, 0.005),
            ..Costs::default()
        },
        transfer_image_s: Some(random.between(1e-5, 1e-3)),
    };
    (0..count).map(|_| node(random)).collect()
}

/// All divisions that leave a node for each kind of work.
fn brute_force_s(load: &Load, nodes: &[NodeCosts]) -> f64 {
    let divisions = (1u32..1 << nodes.len()).map(|bits| (0..nodes.len()).map(|i| bits >> i & 1 == 1).collect());
    let possible = divisions.map(|samples| Division::new(load, nodes, samples));
    let most = load.most_samplers(nodes.len());
    possible.filter(|d| (1..=most).contains(&d.sampler_count())).map(|d| d.time_s).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_search_is_within_a_hundredth_of_the_best_of_all_divisions() {
    let mut worst = 1.0f64;
    let mut sum = 0.0;
    let mut off = 0;
    for seed in 0..1000 {
        let mut random = Random(seed);
        let count = 2 + random.below(7) as usize;
        let nodes = unequal(&mut random, count);
        let load = Load {
            images: 1 + random.below(16) as usize,
            views: random.between(1.0, 1000.0) as usize,
            ..Load::default()
        };
        let found = enumerate(&load, &nodes, &order(&nodes, &[]), true);
        let best_s = brute_force_s(&load, &nodes);
        let ratio = found.time_s / best_s;
        (worst, sum) = (worst.max(ratio), sum + ratio);
        off += usize::from(ratio > 1.01);
        assert!(ratio <= 1.01, "seed {seed}: {} s, best {best_s} s", found.time_s);
    }
    println!("1000 clusters: worst {worst:.4}, mean {:.5}, {off} off by more than a hundredth", sum / 1000.0);
}

#[test]
fn divisions_of_k_and_the_next_k_differ_by_one_role() {
    let nodes = nodes(8, COSTS);
    let load = Load { images: 6, views: 50, ..Load::default() };
    let sampled = [false, false, true, false, true, true, false, false];
    let order = order(&nodes, &sampled);
    assert_eq!(first(&load, &nodes, &order, 3).samples, sampled);
    for k in 1..6 {
        let a = first(&load, &nodes, &order, k);
        let b = first(&load, &nodes, &order, k + 1);
        assert_eq!(a.samples.iter().zip(&b.samples).filter(|(a, b)| a != b).count(), 1);
    }
}

#[test]
fn a_step_changes_two_roles_and_gives_new_nodes_theirs() {
    let nodes = nodes(8, COSTS);
    let load = Load { images: 6, views: 4, ..Load::default() };
    let target = first(&load, &nodes, &[0, 1, 2, 3, 4, 5, 6, 7], 6);
    let mut present = vec![false; 8];
    present[0] = true;
    let step = towards(&load, &nodes, &present, &target, &[true; 8], 2);
    assert_eq!(step.sampler_count(), 3);
    let mut has_role = [true; 8];
    has_role[5] = false;
    let step = towards(&load, &nodes, &present, &target, &has_role, 2);
    assert!(step.samples[5] && step.sampler_count() == 4);
    assert_eq!(towards(&load, &nodes, &present, &target, &[true; 8], 9), target);
}
