//! Views that can go to the device together.

use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, DIRECT, RenderViews, RequestedView, SetContent};
use codec::{FrameCodec, SampleSetId};
use depth_image::ViewPlanes;
use glam::UVec2;

use crate::outbox::Reply;
use crate::quota::Credit;
use crate::sets::ViewSets;
use crate::view_times::ViewKind;

/// Views of one call to the device.
pub(crate) const MAX_BATCH: usize = 64;

/// The kind of views that are drawn with few rays until their set is there.
const PREVIEW: &str = "preview";

/// Views with equal keys can be made in one call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BatchKey {
    /// Sets of two workloads may have the same epoch and index.
    pub(crate) workload_number: u64,
    pub(crate) sample_set_id: SampleSetId,
    /// `None` for views that are drawn from the scene.
    pub(crate) content: Option<SetContent>,
    pub(crate) method: String,
    pub(crate) planes: ViewPlanes,
    pub(crate) size_px: UVec2,
    pub(crate) is_preview: bool,
}

impl BatchKey {
    /// The kind of these views.
    pub(crate) fn kind(&self) -> ViewKind {
        let method = match self.content {
            Some(_) => &self.method,
            None if self.is_preview => PREVIEW,
            None => DIRECT,
        };
        let antialias = self.planes.antialias;
        ViewKind { workload_number: self.workload_number, method: method.to_owned(), antialias }
    }
}

/// The source of views.
#[derive(Clone)]
pub(crate) enum Source {
    /// Complete sample sets.
    Sets(ViewSets),
    /// The scene itself.
    Scene { plan: Arc<Assignment>, scene_time_s: f32 },
}

/// The name of a view's source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) id: SampleSetId,
    /// The view cell whose set it is.
    pub(crate) cell: u32,
    /// Whether the view is in another cell, or drawn from the scene until its set is there.
    pub(crate) is_neighbour: bool,
    /// The set; `None` for the scene itself.
    pub(crate) content: Option<SetContent>,
}

impl Place {
    /// Whether views are drawn from the scene with few rays, because no set is there yet.
    pub(crate) fn is_preview(&self) -> bool {
        self.is_neighbour && self.content.is_none()
    }
}

/// The source of the views of a set that are in one view cell.
#[derive(Clone)]
pub(crate) struct Loaded {
    pub(crate) source: Source,
    pub(crate) place: Place,
    /// The wait for it.
    pub(crate) wait_s: f64,
}

/// A view that waits for the device, with the way back to its client.
pub(crate) struct Waiting {
    pub(crate) key: BatchKey,
    pub(crate) set: Loaded,
    pub(crate) view: RequestedView,
    pub(crate) codec: FrameCodec,
    pub(crate) arrived: Instant,
    /// The time at which it was ready for the device.
    pub(crate) queued: Instant,
    pub(crate) reply: Reply,
    pub(crate) credit: Credit,
}

impl Waiting {
    /// A view of a request that is ready for the device now.
    pub(crate) fn new(
        request: &RenderViews,
        view: RequestedView,
        arrived: Instant,
        set: &Loaded,
        reply: Reply,
        credit: Credit,
    ) -> Self {
        let key = BatchKey {
            workload_number: request.workload_number,
            sample_set_id: set.place.id,
            content: set.place.content,
            method: request.method.clone(),
            planes: request.planes,
            size_px: view.camera.size_px,
            is_preview: set.place.is_preview(),
        };
        Self { key, set: set.clone(), view, codec: request.codec, arrived, queued: Instant::now(), reply, credit }
    }
}
