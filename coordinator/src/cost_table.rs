//! Measured costs, kept for sessions that ask for the same, and predicted for other sizes of views.

use cluster::{Costs, MeasureCosts, Measured, SharedLightCosts, TileCosts, TimedSize};
use depth_image::{Camera, SampleCamera, ViewPlanes};
use glam::UVec2;
use parking_lot::Mutex;

use crate::measuring_queue::{MeasuringQueue, cache_key};

/// The number of measurements that are kept.
const CAPACITY: usize = 64;
/// Costs are predicted for views of at most this many times the pixels of a measured view, or of this share of them.
const FARTHEST: f64 = 16.0;

/// All costs that the coordinator knows, by device and measurement; and what is to be measured once nodes are idle.
#[derive(Default)]
pub(crate) struct CostTable {
    /// The oldest first.
    entries: Mutex<Vec<Entry>>,
    pub(crate) wanted: Mutex<MeasuringQueue>,
}

struct Entry {
    device: String,
    key: MeasureCosts,
    known: Known,
}

/// Costs of a device.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    pub(crate) measured: Measured,
    /// They were measured on an idle node: neither predicted, nor measured beside other work.
    pub(crate) is_settled: bool,
}

impl CostTable {
    /// Costs as measured, else as predicted. Those that are not settled are measured later.
    pub(crate) fn find(&self, device: &str, measurement: &MeasureCosts) -> Option<Measured> {
        let known = self.get(device, measurement);
        let is_settled = known.as_ref().is_some_and(|known| known.is_settled);
        let measured = known.map(|known| known.measured).or_else(|| self.predict(device, measurement))?;
        if !is_settled {
            self.wanted.lock().add(device, measurement);
        }
        Some(measured)
    }

    fn get(&self, device: &str, measurement: &MeasureCosts) -> Option<Known> {
        let key = cache_key(measurement);
        self.entries
            .lock()
            .iter()
            .find(|entry| entry.device == device && entry.key == key)
            .map(|entry| entry.known.clone())
    }

    /// Costs from measurements that differ in the view's size alone, or, where light is shared, in the quality of views and the
    /// density of samples; `None` without any of a size near it.
    fn predict(&self, device: &str, measurement: &MeasureCosts) -> Option<Measured> {
        let key = cache_key(measurement);
        let entries = self.entries.lock();
        let of_device: Vec<&Entry> = entries.iter().filter(|entry| entry.device == device).collect();
        let sized = sizeless(&key);
        let sizes = of_device.iter().filter(|entry| sizeless(&entry.key) == sized);
        let sizes = sizes.map(|entry| (pixels_of(&entry.key), entry.known.measured.clone())).collect();
        Self::predict_size(sizes, pixels_of(&key)).or_else(|| {
            let shared = qualityless(&key);
            let others: Vec<&Entry> = of_device.into_iter().filter(|entry| qualityless(&entry.key) == shared).collect();
            // Sizes are compared in one quality.
            let latest = &others.last()?.key;
            let alike = others.iter().filter(|entry| {
                entry.key.method == latest.method && entry.key.planes.antialias == latest.planes.antialias
            });
            let sizes = alike.filter_map(|entry| Some((pixels_of(&entry.key), in_quality(entry, &key)?))).collect();
            Self::predict_size(sizes, pixels_of(&key))
        })
    }

    /// Costs from those of views of other sizes, each with its number of pixels.
    fn predict_size(mut sizes: Vec<(f64, Measured)>, pixels: f64) -> Option<Measured> {
        // The nearest first.
        sizes.sort_by(|(a, _), (b, _)| ratio_above_one(*a, pixels).total_cmp(&ratio_above_one(*b, pixels)));
        let nearest = sizes.first().filter(|(of_px, _)| ratio_above_one(*of_px, pixels) <= FARTHEST)?;
        let other = sizes.iter().find(|(other, _)| *other != nearest.0);
        Some(at_size(nearest, other, pixels))
    }

    /// Keeps costs in place of earlier ones. Settled costs are replaced by settled ones alone. The oldest are evicted.
    pub(crate) fn insert(&self, device: &str, measurement: &MeasureCosts, known: Known) {
        let key = cache_key(measurement);
        let mut entries = self.entries.lock();
        if let Some(at) = entries.iter().position(|entry| entry.device == device && entry.key == key) {
            if entries[at].known.is_settled && !known.is_settled {
                return;
            }
            entries.remove(at);
        } else if entries.len() >= CAPACITY {
            entries.remove(0);
        }
        entries.push(Entry { device: device.to_owned(), key, known });
    }
}

/// How many times the larger of two sizes is the smaller.
fn ratio_above_one(a_px: f64, b_px: f64) -> f64 {
    (a_px / b_px).max(b_px / a_px)
}

/// The key without what a prediction accounts for: the size and the number of views. Fields of view matter little.
fn sizeless(key: &MeasureCosts) -> MeasureCosts {
    let mut key = key.clone();
    key.typical_views.truncate(1);
    for view in &mut key.typical_views {
        *view = view.resized(UVec2::ONE);
        (view.focal_px, view.principal_px) = Default::default();
    }
    key.batch_count = 1;
    key
}

/// The sizeless key without what changes costs little, or as predicted, where light is shared: quality, planes, codec, and the size
/// of samples.
fn qualityless(key: &MeasureCosts) -> MeasureCosts {
    let mut key = sizeless(key);
    key.method = key.method.split(':').next().unwrap_or_default().to_owned();
    key.codec.clear();
    key.planes = ViewPlanes::default();
    for camera in &mut key.workload.sample_cameras {
        *camera = camera.resized(UVec2::ONE);
        if let SampleCamera::Depth(Camera::Pinhole(pinhole)) = camera {
            (pinhole.focal_px, pinhole.principal_px) = Default::default();
        }
    }
    key
}

/// Costs of a measurement in another quality: surfaces and look-ups are for each position within a pixel, rays for each pixel,
/// and samples for each texel. Points that no sample knows, and encoding, take as long as in the quality that was measured. `None`
/// where no light is shared.
fn in_quality(entry: &Entry, wanted: &MeasureCosts) -> Option<Measured> {
    let Measured { costs, shared_light, .. } = entry.known.measured.clone();
    let light = shared_light?;
    let [wanted_positions, positions] = [wanted, &entry.key].map(|key| f64::from(key.planes.antialias.samples()));
    let [wanted_texels, texels] = [wanted, &entry.key]
        .map(|key| key.workload.sample_cameras.iter().map(SampleCamera::pixel_count).sum::<usize>());
    let positions_ratio = wanted_positions / positions;
    let texels_ratio = wanted_texels as f64 / texels.max(1) as f64;
    let light = SharedLightCosts {
        surfaces_s: light.surfaces_s * positions_ratio,
        look_up_s: light.look_up_s * positions_ratio,
        ..light
    };
    let direct_light_s = (costs.direct_view_s - light.surfaces_s / positions_ratio).max(0.0);
    let sample_image_s = costs.sample_image_s * texels_ratio;
    let costs = Costs {
        sample_image_s,
        direct_view_s: direct_light_s + light.surfaces_s,
        reconstruct_view_s: light.surfaces_s + light.look_up_s + light.unknown_s,
        load_set_s: costs.load_set_s * texels_ratio,
        tiles: costs.tiles.and_then(|tiles| TileCosts::of_image(sample_image_s, tiles.overhead_s, tiles.row_shares)),
        ..costs
    };
    Some(Measured { costs, shared_light: Some(light), ..entry.known.measured.clone() })
}

fn pixels_of(measurement: &MeasureCosts) -> f64 {
    measurement.typical_views.first().map_or(1.0, |view| view.pixel_count().max(1) as f64)
}

/// Costs of views of `pixels`, from those of one or two other sizes.
fn at_size((near_px, near): &(f64, Measured), other: Option<&(f64, Measured)>, pixels: f64) -> Measured {
    let at = |of: fn(&Costs) -> f64| {
        let other = other.map(|(pixels, other)| TimedSize { pixels: *pixels, seconds: of(&other.costs) });
        TimedSize { pixels: *near_px, seconds: of(&near.costs) }.at_size(other, pixels)
    };
    let costs = Costs {
        reconstruct_view_s: at(|costs| costs.reconstruct_view_s),
        direct_view_s: at(|costs| costs.direct_view_s),
        encode_view_s: at(|costs| costs.encode_view_s),
        ..near.costs
    };
    let view_ratio = costs.reconstruct_view_s / near.costs.reconstruct_view_s;
    let shared_light = near.shared_light.filter(|_| view_ratio.is_finite()).map(|light| light.scaled(view_ratio));
    Measured { costs, shared_light, ..near.clone() }
}

#[cfg(test)]
pub(crate) mod tests {
    use depth_image::{Antialias, PinholeCamera};
    use glam::Vec3;

    use super::*;
    use crate::schedule::workload_for_tests as workload;

    pub(crate) fn measurement(size_px: UVec2) -> MeasureCosts {
        MeasureCosts {
            workload: workload(2),
            method: "joint_carve".to_owned(),
            codec: "lz4".to_owned(),
            typical_views: vec![PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, size_px)],
            batch_count: 32,
            planes: ViewPlanes::default(),
            in_background: false,
            budget: None,
        }
    }

    fn measured(reconstruct_view_s: f64) -> Known {
        let costs = Costs { sample_image_s: 3.0, reconstruct_view_s, encode_view_s: 0.001, ..Costs::default() };
        Known { measured: Measured { costs, ..Measured::default() }, is_settled: true }
    }

    fn predicted_s(cache: &CostTable, size_px: UVec2) -> Option<f64> {
        Some(cache.predict("d", &measurement(size_px))?.costs.reconstruct_view_s)
    }

    #[test]
    fn one_size_predicts_in_proportion_and_two_find_the_part_that_every_view_has() {
        let cache = CostTable::default();
        assert_eq!(predicted_s(&cache, UVec2::new(100, 100)), None);
        cache.insert("d", &measurement(UVec2::new(100, 100)), measured(0.03));
        assert!((predicted_s(&cache, UVec2::new(200, 100)).unwrap() - 0.06).abs() < 1e-12);
        assert!((predicted_s(&cache, UVec2::new(50, 100)).unwrap() - 0.015).abs() < 1e-12);
        // 0.01 s a view, and 2 µs a pixel.
        cache.insert("d", &measurement(UVec2::new(300, 100)), measured(0.07));
        assert!((predicted_s(&cache, UVec2::new(200, 100)).unwrap() - 0.05).abs() < 1e-12);
        assert!((predicted_s(&cache, UVec2::new(50, 100)).unwrap() - 0.02).abs() < 1e-12);
        assert_eq!(cache.predict("d", &measurement(UVec2::splat(50))).unwrap().costs.sample_image_s, 3.0);
        assert_eq!(cache.predict("other", &measurement(UVec2::splat(50))), None);
    }

    #[test]
    fn sizes_far_from_those_measured_are_not_predicted() {
        let cache = CostTable::default();
        cache.insert("d", &measurement(UVec2::ONE), measured(0.005));
        cache.insert("d", &measurement(UVec2::splat(16_384)), measured(900.0));
        for side in [5, 320, 1280, 4000] {
            assert_eq!(predicted_s(&cache, UVec2::splat(side)), None, "{side}");
        }
        cache.insert("d", &measurement(UVec2::splat(400)), measured(0.05));
        let at = |side| predicted_s(&cache, UVec2::splat(side)).unwrap();
        assert!(at(100) > 0.001 && at(400) > 0.04 && at(1600) < 1.0, "{} {} {}", at(100), at(400), at(1600));
        assert_eq!((predicted_s(&cache, UVec2::splat(99)), predicted_s(&cache, UVec2::splat(1601))), (None, None));
    }

    #[test]
    fn costs_are_settled_once_they_were_measured_on_an_idle_node() {
        let cache = CostTable::default();
        let size = measurement(UVec2::splat(8));
        cache.insert("d", &size, Known { is_settled: false, ..measured(0.09) });
        assert_eq!(cache.get("d", &size), Some(Known { is_settled: false, ..measured(0.09) }));
        assert_eq!(cache.find("d", &size), Some(measured(0.09).measured));
        assert!(cache.find("d", &measurement(UVec2::splat(9))).is_some(), "predicted");
        let wanted = std::iter::from_fn(|| cache.wanted.lock().take(|_| true));
        let sizes: Vec<u32> = wanted.map(|wanted| wanted.measurement.typical_views[0].size_px.x).collect();
        assert_eq!(sizes, [8, 9], "both are measured later");
        cache.insert("d", &size, measured(0.03));
        cache.insert("d", &size, Known { is_settled: false, ..measured(0.2) });
        assert_eq!(cache.find("d", &size), Some(measured(0.03).measured), "measured once more, beside other work");
        assert_eq!(cache.wanted.lock().take(|_| true), None);
    }

    #[test]
    fn a_larger_size_that_was_timed_faster_predicts_no_negative_cost() {
        let cache = CostTable::default();
        cache.insert("d", &measurement(UVec2::new(100, 100)), measured(0.03));
        cache.insert("d", &measurement(UVec2::new(200, 100)), measured(0.01));
        for side in [30, 50, 100, 200, 400] {
            let seconds = predicted_s(&cache, UVec2::splat(side)).unwrap();
            assert!((0.01..=0.03).contains(&seconds), "{side}: {seconds}");
        }
    }

    #[test]
    fn another_method_or_workload_is_not_predicted() {
        let cache = CostTable::default();
        cache.insert("d", &measurement(UVec2::splat(8)), measured(0.03));
        let wanted = measurement(UVec2::splat(9));
        assert!(cache.predict("d", &wanted).is_some());
        let method = MeasureCosts { method: "mesh".to_owned(), ..wanted.clone() };
        let images = MeasureCosts { workload: workload(3), ..wanted };
        assert!(cache.predict("d", &method).is_none() && cache.predict("d", &images).is_none());
    }

    #[test]
    fn other_qualities_and_densities_of_shared_light_are_predicted_from_the_parts_of_a_view() {
        let light = SharedLightCosts { known_ratio: 0.9, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.28 };
        let mut known = measured(0.4);
        known.measured.shared_light = Some(light);
        known.measured.costs.direct_view_s = 2.1;
        let in_motion = MeasureCosts { method: "light_cache:fast".to_owned(), ..measurement(UVec2::new(64, 48)) };
        let mut still =
            MeasureCosts { method: "light_cache:fine".to_owned(), codec: "png".to_owned(), ..in_motion.clone() };
        still.planes.antialias = Antialias::of(4).unwrap();
        for camera in &mut still.workload.sample_cameras {
            *camera = camera.resized(camera.size_px() / 2);
        }
        let cache = CostTable::default();
        cache.insert("d", &in_motion, measured(0.4));
        assert_eq!(cache.predict("d", &still), None, "no light is shared");
        cache.insert("d", &in_motion, known.clone());
        let Measured { costs, shared_light, .. } = cache.predict("d", &still).unwrap();
        let seconds = [costs.sample_image_s, costs.direct_view_s, costs.reconstruct_view_s];
        let expected = [3.0 / 4.0, 2.0 + 0.4, 0.4 + 0.08 + 0.28];
        assert!(seconds.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{seconds:?}");
        assert_eq!(shared_light.unwrap().unknown_s, 0.28);
        let other = MeasureCosts { workload: workload(3), ..still };
        assert_eq!(cache.predict("d", &other), None, "other cameras");
    }

    #[test]
    fn parts_of_a_view_are_predicted_with_its_time() {
        let cache = CostTable::default();
        let size_px = UVec2::new(64, 48);
        let light = SharedLightCosts { known_ratio: 0.9, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.28 };
        let mut known = measured(0.4);
        known.measured.shared_light = Some(light);
        cache.insert("d", &measurement(size_px), known.clone());
        let predicted = cache.predict("d", &measurement(size_px * UVec2::new(2, 1))).unwrap();
        let SharedLightCosts { known_ratio, surfaces_s, look_up_s, unknown_s } = predicted.shared_light.unwrap();
        assert_eq!(known_ratio, 0.9);
        let differences = [surfaces_s - 0.2, look_up_s - 0.04, unknown_s - 0.56];
        assert!(differences.iter().all(|difference| difference.abs() < 1e-12), "{predicted:?}");
        known.measured.costs.reconstruct_view_s = 0.0;
        cache.insert("d", &measurement(size_px), known);
        let predicted = cache.predict("d", &measurement(size_px * 2)).unwrap();
        assert_eq!(predicted.shared_light, None, "of no time");
    }
}
