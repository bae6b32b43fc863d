//! The representations among which budgets choose, from the methods that are known.

use std::mem::discriminant;

use planner::Row;
use reconstruction::ReconstructionMethod;
use sampling::SamplingMethod;

use crate::setup::SceneArgs;

/// Numbers of sample cameras.
pub(crate) const CAMERA_COUNTS: [u32; 4] = [1, 2, 4, 8];
/// Sides of sample images, as shares of the side that `--sample-size auto` chooses.
const SIDE_RATIOS: [f64; 3] = [0.5, 0.71, 1.0];

impl SceneArgs {
    /// The rows that a user's choices leave, for a scene with `cameras` sample cameras: a named choice is the same in all rows.
    /// Budgets do not choose cubes.
    #[must_use]
    pub fn rows(&self, cameras: u32) -> Vec<Row> {
        if self.sampling.is_some_and(|sampling| sampling.layer_selection().is_some()) {
            return Vec::new();
        }
        let samplings: Vec<(String, u32)> = match self.sampling {
            Some(sampling) => vec![(sampling.to_string(), 1)],
            None => SamplingMethod::ladder().map(|(name, images)| (name.to_owned(), images)).collect(),
        };
        let methods: Vec<ReconstructionMethod> = match self.method {
            Some(method) => vec![method],
            None => ReconstructionMethod::ladder().collect(),
        };
        let own_count = self.sampling.and_then(SamplingMethod::own_image_count);
        let count = own_count.or(self.samples.is_some().then_some(cameras));
        let counts = count.map_or_else(|| CAMERA_COUNTS.to_vec(), |count| vec![count]);
        let sides = if self.sample_size.fixed_px().is_some() { &SIDE_RATIOS[2..] } else { &SIDE_RATIOS[..] };
        let mut rows = Vec::new();
        for (sampling, least_images) in &samplings {
            let is_of_layers = sampling.parse().is_ok_and(|method: SamplingMethod| method.own_image_count().is_some());
            for &camera_count in counts.iter().filter(|&count| count >= least_images) {
                for &side_ratio in sides {
                    rows.extend(methods.iter().enumerate().map(|(place, method)| Row {
                        sampling: sampling.clone(),
                        method: method.to_string(),
                        camera_count,
                        place_count: if is_of_layers { 1 } else { camera_count },
                        side_ratio,
                        kind: format!("{} {}", without_setting(sampling), without_setting(&method.to_string())),
                        // The place of a setting among those of its method.
                        rank:
                            methods[..place].iter().filter(|other| discriminant(*other) == discriminant(method)).count()
                                as u32,
                    }));
                }
            }
        }
        rows
    }
}

fn without_setting(method: &str) -> &str {
    method.split(':').next().unwrap_or(method)
}
