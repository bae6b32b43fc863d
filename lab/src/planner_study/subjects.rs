//! Subjects that are drawn by a seed: nothing in the planner may depend on them.

use planner::ProbeView;

use crate::fronts::conditions::Conditions;

const SCENES: [&str; 12] = [
    "tree-terrain-30k",
    "tree-terrain-125k",
    "tree-terrain-500k",
    "grass:0.1",
    "grass:0.4",
    "urban",
    "bird-nest",
    "tree",
    "blocks",
    "courtyard",
    "poles",
    "uv-sphere",
];
/// Sides of the cell, over that of the scene's own sample cameras, and views of a set; both in equal ratios.
const CELLS: [f64; 2] = [0.5, 2.0];
const VIEWS: [f64; 2] = [50.0, 1000.0];

/// Different scenes, each with a cell and a number of views.
#[must_use]
pub fn subjects(seed: u64, count: usize) -> Vec<Conditions> {
    let mut scenes: Vec<(usize, f64)> = (0..SCENES.len()).map(|place| (place, draw(seed, place)[0])).collect();
    scenes.sort_by(|a, b| a.1.total_cmp(&b.1));
    scenes.into_iter().take(count).map(|(place, _)| conditions(seed, place)).collect()
}

fn conditions(seed: u64, place: usize) -> Conditions {
    let [_, cell, views] = draw(seed, place);
    let between = |[least, most]: [f64; 2], share: f64| least * (most / least).powf(share);
    Conditions {
        cell_ratio: between(CELLS, cell) as f32,
        views: between(VIEWS, views) as usize,
        seed,
        ..Conditions::of_scene(SCENES[place])
    }
}

fn draw(seed: u64, place: usize) -> [f64; 3] {
    ProbeView::Fresh(place as u64).place(seed)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn seeds_draw_different_subjects_of_valid_scenes() {
        let names = |seed: u64| subjects(seed, 4).into_iter().map(|subject| subject.scene).collect::<Vec<_>>();
        assert_eq!(names(7), names(7));
        assert!((0..20).map(names).collect::<BTreeSet<_>>().len() > 15);
        assert_eq!(subjects(1, 8).iter().map(|subject| &subject.scene).collect::<BTreeSet<_>>().len(), 8);
        SCENES.iter().for_each(|scene| drop(fixtures::spec(scene).unwrap()));
    }
}
