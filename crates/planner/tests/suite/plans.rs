//! Plans for made-up scenes.

use planner::{Budget, Demand, PlanRequest, Planner, Probed, Row, RowCosts, ViewErrors};

use super::made_up::{Random, Scene};

/// The bars of real scenes, on 400 made-up ones.
#[test]
fn budgets_are_kept_at_about_the_price_of_the_cheapest_row() {
    let mut ratios = Vec::new();
    let mut kept = 0;
    let mut measurements = 0;
    let count = 400;
    for seed in 0..count {
        let mut random = Random(seed ^ 0xfeed);
        let mut scene = Scene::new(seed);
        let budget: Budget = format!("flip {:.4}", random.between(0.008, 0.15)).parse().unwrap();
        let views_a_set = random.between(10.0, 600.0) as usize;
        let planner = scene.plan(budget, views_a_set, seed + 1);
        let chosen = planner.outcome().unwrap().kept[0];
        kept += u32::from(scene.errors[chosen] <= budget.most_ratio());
        let keeping = (0..scene.rows.len()).filter(|&row| scene.errors[row] <= budget.most_ratio());
        let cheapest_s = keeping.map(|row| scene.price_s(row, views_a_set)).fold(f64::INFINITY, f64::min);
        ratios.push(scene.price_s(chosen, views_a_set) / cheapest_s);
        measurements += planner.spent().1;
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    let p90 = ratios[ratios.len() * 9 / 10];
    println!("kept {kept} of {count}, price {median:.3}, 90 % {p90:.3}, {} measurements each", measurements / count);
    assert!(f64::from(kept) >= 0.95 * count as f64, "{kept} of {count}");
    assert!(median <= 1.10 && p90 < 2.5, "{median} {p90}");
    assert!(measurements / count <= 40);
}

#[test]
fn equal_answers_give_equal_plans_and_no_measurement_is_asked_for_twice() {
    let budget: Budget = "flip 0.03".parse().unwrap();
    let run = || {
        let mut scene = Scene::new(3);
        let mut planner = Planner::new(scene.request(budget, 100, 1)).unwrap();
        let mut asked = Vec::new();
        while let Some(probe) = planner.next_probe() {
            assert_eq!(planner.next_probe().as_ref(), Some(&probe), "the same until it is answered");
            assert!(!asked.contains(&(probe.row, probe.views.clone())), "{probe:?}");
            asked.push((probe.row, probe.views.clone()));
            planner.answer(&scene.answer(&probe)).unwrap();
        }
        (asked, planner.outcome().cloned())
    };
    assert_eq!(run(), run());
}

#[test]
fn a_budget_that_nothing_cheaper_keeps_is_kept_by_direct_drawing_if_that_is_allowed() {
    let mut scene = Scene::new(5);
    let strict: Budget = "psnr 90".parse().unwrap();
    let planner = scene.plan(strict, 100, 1);
    let outcome = planner.outcome().unwrap();
    assert_eq!(outcome.kept, [scene.rows.len() - 1]);
    assert!(outcome.reason.contains("Drawing directly with all rays keeps psnr 90"), "{}", outcome.reason);
    let request = PlanRequest { exact: None, ..scene.request(strict, 100, 1) };
    let mut planner = Planner::new(request).unwrap();
    while let Some(probe) = planner.next_probe() {
        let mut probed = scene.answer(&probe);
        // Nothing has the truth.
        probed.views.iter_mut().for_each(|view| view.mean_square = view.mean_square.max(1e-4));
        planner.answer(&probed).unwrap();
    }
    let outcome = planner.outcome().unwrap();
    assert!(
        outcome.kept.is_empty() && outcome.reason.contains("Nothing is known to keep psnr 90"),
        "{}",
        outcome.reason
    );
    assert!(outcome.reason.contains("comes nearest with"), "{}", outcome.reason);
}

#[test]
fn rows_that_cannot_be_measured_are_not_chosen_and_impossible_answers_are_refused_by_field() {
    let budget: Budget = "flip 0.05".parse().unwrap();
    let mut scene = Scene::new(7);
    let best = scene.plan(budget, 100, 1).outcome().unwrap().kept[0];
    let mut planner = Planner::new(scene.request(budget, 100, 1)).unwrap();
    while let Some(probe) = planner.next_probe() {
        if probe.row == best {
            planner.fail(probe.id);
        } else {
            planner.answer(&scene.answer(&probe)).unwrap();
        }
    }
    assert_ne!(planner.outcome().unwrap().kept.first(), Some(&best));

    let mut planner = Planner::new(scene.request(budget, 100, 1)).unwrap();
    type Spoil = fn(&mut Probed);
    let spoilt: [(&str, Spoil); 5] = [
        ("views", |probed| probed.views.clear()),
        ("views", |probed| probed.views.push(ViewErrors::NONE)),
        ("flip_ratio", |probed| probed.views[0].flip = f64::NAN),
        ("view_s", |probed| probed.costs.view_s = -1.0),
        ("busy_s", |probed| probed.busy_s = f64::INFINITY),
    ];
    for (field, spoil) in spoilt {
        let probe = planner.next_probe().unwrap();
        let mut probed = scene.answer(&probe);
        spoil(&mut probed);
        assert_eq!(planner.answer(&probed).unwrap_err().field, field);
        assert_ne!(planner.next_probe().unwrap().row, probe.row, "the row has failed");
    }
    let probe = planner.next_probe().unwrap();
    let mut foreign = scene.answer(&probe);
    foreign.id.number += 1;
    planner.answer(&foreign).unwrap();
    assert_eq!(planner.next_probe(), Some(probe), "nobody waits for that answer");
    for rows in [Vec::new(), vec![scene.rows[0].clone(); 50]] {
        let request = PlanRequest { rows, exact: None, ..scene.request(budget, 1, 1) };
        assert_eq!(Planner::new(request).unwrap_err().field, "rows");
    }
}

#[test]
fn the_price_of_a_view_has_its_part_of_the_set_that_every_node_loads() {
    let row = Row::Samples { method: "m".to_owned(), camera_count: 4, density: 1.0 };
    let costs = RowCosts { sample_image_s: 0.02, load_set_s: 0.01, view_s: 0.003 };
    let price = |nodes, cells, views_a_set| Demand { nodes, cells, views_a_set }.price_s(&row, &costs);
    assert!((price(1, 1, 10) - ((4.0 * 0.02 + 0.01) / 10.0 + 0.003)).abs() < 1e-12);
    assert!((price(3, 2, 10) - (2.0 * (4.0 * 0.02 + 3.0 * 0.01) / 10.0 + 0.003)).abs() < 1e-12);
    let direct = Row::Direct { lighting: "phong".to_owned(), ray_ratio: 1.0 };
    assert_eq!(Demand { nodes: 3, cells: 2, views_a_set: 1 }.price_s(&direct, &costs), 0.003);
}
