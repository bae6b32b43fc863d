//! Sampled sets, kept while they are of use: rows of a ladder differ in reconstruction, and share sets.

use std::sync::Arc;

use cluster::SamplePlanes;
use depth_image::{Camera, DepthImage};
use node::depth_images_bytes;

use crate::subject::Light;

/// The most bytes of sets in memory, beside the newest.
const MAX_BYTES: usize = 256 << 20;

/// A sampled set.
#[derive(Debug)]
pub(crate) struct SampledSet {
    /// The images as compositors decode them.
    pub(crate) images: Vec<DepthImage>,
    /// Encoded bytes of each image.
    pub(crate) encoded_bytes: Vec<usize>,
    /// g_s: the time of an image, encoded.
    pub(crate) sample_image_s: f64,
}

/// What a set depends on, beside its cameras.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SetKey {
    pub(crate) sampling: String,
    pub(crate) planes: SamplePlanes,
    pub(crate) light: Light,
}

/// The newest sets.
#[derive(Debug, Default)]
pub(crate) struct Sets {
    newest_last: Vec<(SetKey, Arc<SampledSet>)>,
}

impl Sets {
    /// The set of these cameras; of images that do not depend on each other also a larger set that begins with them.
    pub(crate) fn find(&self, key: &SetKey, cameras: &[Camera], is_independent: bool) -> Option<Arc<SampledSet>> {
        let found = self.newest_last.iter().find(|(other, set)| {
            let count = set.images.len();
            let has_all = count == cameras.len() || (is_independent && count > cameras.len());
            other == key && has_all && set.images.iter().zip(cameras).all(|(image, camera)| image.camera == *camera)
        });
        found.map(|(_, set)| set.clone())
    }

    pub(crate) fn keep(&mut self, key: SetKey, set: Arc<SampledSet>) {
        self.newest_last.push((key, set));
        let mut bytes: usize = self.newest_last.iter().map(|(_, set)| depth_images_bytes(&set.images)).sum();
        while self.newest_last.len() > 1 && bytes > MAX_BYTES {
            bytes -= depth_images_bytes(&self.newest_last.remove(0).1.images);
        }
    }
}
