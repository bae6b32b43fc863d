//! Bounds on the views in flight, of each stream and of all together.

use std::sync::Arc;

use depth_image::PinholeCamera;
use node::Quotas;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::Status;

/// The room that a view takes until its frame has been sent.
#[derive(Debug)]
pub(crate) struct Credit {
    /// Room in its stream; that of a live stream is held until its client acknowledges the frame.
    pub(crate) stream: OwnedSemaphorePermit,
    /// Room on the node.
    pub(crate) _node: NodeCredit,
}

/// Dropped when the frame has been sent.
#[derive(Debug)]
pub(crate) struct NodeCredit {
    _pixels: OwnedSemaphorePermit,
    /// `None` for live streams: these are bounded by their number, as each has two views in flight at most.
    _view: Option<OwnedSemaphorePermit>,
}

/// The room that a node has.
pub(crate) struct NodeQuota {
    limits: Quotas,
    streams: Arc<Semaphore>,
    views: Arc<Semaphore>,
    pixels: Arc<Semaphore>,
    /// Pixels of live streams: views of batches do not keep a viewer waiting.
    live_pixels: Arc<Semaphore>,
}

impl NodeQuota {
    pub(crate) fn new(limits: Quotas) -> Self {
        let room = |count: usize| Arc::new(Semaphore::new(count.clamp(1, u32::MAX as usize)));
        Self {
            limits,
            streams: room(limits.streams),
            views: room(limits.views),
            pixels: room(limits.pixels),
            live_pixels: room(limits.pixels),
        }
    }

    /// Room for one more stream.
    pub(crate) fn stream(&self) -> Result<OwnedSemaphorePermit, Status> {
        let refused = |_| self.exceeded("streams", self.limits.streams, "streams are open");
        self.streams.clone().try_acquire_owned().map_err(refused)
    }

    /// Room for a view of a batch; an error while all room is taken.
    pub(crate) fn try_view(&self, camera: &PinholeCamera) -> Result<NodeCredit, Status> {
        let few = |_| self.exceeded("views", self.limits.views, "views are in flight");
        let small = |_| self.exceeded("pixels", self.limits.pixels, "pixels of views are in flight");
        let view = self.views.clone().try_acquire_owned().map_err(few)?;
        let pixels = self.pixels.clone().try_acquire_many_owned(self.price(camera)).map_err(small)?;
        Ok(NodeCredit { _pixels: pixels, _view: Some(view) })
    }

    /// Waits for room for a view of a batch.
    pub(crate) async fn view(&self, camera: &PinholeCamera) -> Result<NodeCredit, Status> {
        let view = self.views.clone().acquire_owned().await.map_err(closed)?;
        let pixels = self.pixels.clone().acquire_many_owned(self.price(camera)).await.map_err(closed)?;
        Ok(NodeCredit { _pixels: pixels, _view: Some(view) })
    }

    /// Waits for room for a view of a live stream.
    pub(crate) async fn live_view(&self, camera: &PinholeCamera) -> Result<NodeCredit, Status> {
        let pixels = self.live_pixels.clone().acquire_many_owned(self.price(camera)).await.map_err(closed)?;
        Ok(NodeCredit { _pixels: pixels, _view: None })
    }

    /// At most all pixels: one view larger than the bound still passes, alone.
    fn price(&self, camera: &PinholeCamera) -> u32 {
        u32::try_from(camera.pixel_count().min(self.limits.pixels.max(1))).unwrap_or(u32::MAX)
    }

    fn exceeded(&self, quota: &str, limit: usize, what: &str) -> Status {
        Status::resource_exhausted(format!("quota {quota}: {limit} {what} on this node"))
    }
}

pub(crate) fn closed<E>(_: E) -> Status {
    Status::internal("credits are closed")
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};
    use tonic::Code;

    use super::*;

    fn camera(side_px: u32) -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(side_px))
    }

    fn quota() -> NodeQuota {
        NodeQuota::new(Quotas { streams: 1, views: 2, pixels: 200 })
    }

    #[test]
    fn a_request_beyond_a_quota_is_refused_by_its_name() {
        let quota = quota();
        let stream = quota.stream().unwrap();
        let refused = quota.stream().unwrap_err();
        assert_eq!(
            (refused.code(), refused.message()),
            (Code::ResourceExhausted, "quota streams: 1 streams are open on this node")
        );
        drop(stream);
        assert!(quota.stream().is_ok());
        let first = quota.try_view(&camera(10)).unwrap();
        assert!(quota.try_view(&camera(11)).unwrap_err().message().starts_with("quota pixels: 200 "));
        let second = quota.try_view(&camera(10)).unwrap();
        assert!(quota.try_view(&camera(1)).unwrap_err().message().starts_with("quota views: 2 "));
        drop((first, second));
        assert!(quota.try_view(&camera(1000)).is_ok(), "larger than all, alone");
    }

    #[tokio::test]
    async fn live_views_wait_for_other_live_views_alone() {
        let quota = quota();
        let _views = [quota.try_view(&camera(10)).unwrap(), quota.try_view(&camera(10)).unwrap()];
        assert!(quota.try_view(&camera(1)).is_err());
        let live = quota.live_view(&camera(12)).await.unwrap();
        let next = camera(10);
        let mut waits = Box::pin(quota.live_view(&next));
        assert!(at_once(&mut waits).await.is_none());
        drop(live);
        assert!(waits.await.is_ok());
    }

    async fn at_once<T>(future: &mut (impl Future<Output = T> + Unpin)) -> Option<T> {
        tokio::time::timeout(std::time::Duration::from_millis(5), future).await.ok()
    }
}
