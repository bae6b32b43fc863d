//! The five operations whose costs are measured.

use cluster::{Costs, MeasuredCosts};

/// One value for each operation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PerOperation<T> {
    /// g_s
    pub(super) sample_image: T,
    /// g_v
    pub(super) direct_view: T,
    /// c
    pub(super) reconstruct_view: T,
    /// d
    pub(super) load_set: T,
    /// e
    pub(super) encode_view: T,
}

impl<T> PerOperation<T> {
    pub(super) fn as_ref(&self) -> PerOperation<&T> {
        let Self { sample_image, direct_view, reconstruct_view, load_set, encode_view } = self;
        PerOperation { sample_image, direct_view, reconstruct_view, load_set, encode_view }
    }

    pub(super) fn as_mut(&mut self) -> PerOperation<&mut T> {
        let Self { sample_image, direct_view, reconstruct_view, load_set, encode_view } = self;
        PerOperation { sample_image, direct_view, reconstruct_view, load_set, encode_view }
    }

    pub(super) fn map<U>(self, mut f: impl FnMut(T) -> U) -> PerOperation<U> {
        self.zip_with(PerOperation::default(), |own, ()| f(own))
    }

    pub(super) fn zip_with<U, V>(self, other: PerOperation<U>, mut f: impl FnMut(T, U) -> V) -> PerOperation<V> {
        PerOperation {
            sample_image: f(self.sample_image, other.sample_image),
            direct_view: f(self.direct_view, other.direct_view),
            reconstruct_view: f(self.reconstruct_view, other.reconstruct_view),
            load_set: f(self.load_set, other.load_set),
            encode_view: f(self.encode_view, other.encode_view),
        }
    }

    /// Operations of the device alone, which say how fast a node is. Loading a set runs beside views, and the encoding of
    /// a view is too short to be timed well.
    pub(super) fn of_device(self) -> [T; 3] {
        [self.sample_image, self.direct_view, self.reconstruct_view]
    }
}

impl From<&Costs> for PerOperation<f64> {
    fn from(costs: &Costs) -> Self {
        Self {
            sample_image: costs.sample_image_s,
            direct_view: costs.direct_view_s,
            reconstruct_view: costs.reconstruct_view_s,
            load_set: costs.load_set_s,
            encode_view: costs.encode_view_s,
        }
    }
}

impl From<&MeasuredCosts> for PerOperation<Option<f64>> {
    fn from(costs: &MeasuredCosts) -> Self {
        Self {
            sample_image: costs.sample_image_s,
            direct_view: costs.direct_view_s,
            reconstruct_view: costs.reconstruct_view_s,
            load_set: costs.load_set_s,
            encode_view: costs.encode_view_s,
        }
    }
}
