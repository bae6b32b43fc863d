//! The five operations whose costs are measured.

use cluster::{Costs, MeasuredCosts};

/// One value for each operation: g_s, g_v, c, d and e.
pub(super) type PerOperation<T> = [T; 5];

/// The place of g_s.
pub(super) const SAMPLE_IMAGE: usize = 0;
/// The first operations are those of the device alone, which say how fast a node is. Loading a set runs beside views, and
/// the encoding of a view is too short to be timed well.
pub(super) const DEVICE_OPERATIONS: usize = 3;

pub(super) fn operations(costs: &Costs) -> PerOperation<f64> {
    [costs.sample_image_s, costs.direct_view_s, costs.reconstruct_view_s, costs.load_set_s, costs.encode_view_s]
}

pub(super) fn timings(costs: &MeasuredCosts) -> PerOperation<Option<f64>> {
    [costs.sample_image_s, costs.direct_view_s, costs.reconstruct_view_s, costs.load_set_s, costs.encode_view_s]
}

/// Costs with other seconds of their operations.
pub(super) fn with_operations(costs: &Costs, seconds: PerOperation<f64>) -> Costs {
    let [sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s] = seconds;
    Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, ..*costs }
}
