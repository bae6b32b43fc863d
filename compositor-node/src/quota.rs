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

/// A part of the node's pixels.
struct Pool {
    pixels: usize,
    free: Arc<Semaphore>,
}

/// The room that a node has. Pixels of all views are in one bound: a part is for live views alone, a small part for batches
/// alone, and the rest for both. Neither can starve the other.
pub(crate) struct NodeQuota {
    limits: Quotas,
    streams: Arc<Semaphore>,
    views: Arc<Semaphore>,
    common: Pool,
    live: Pool,
    batches: Pool,
}

/// The share of pixels for live views alone, and for batches alone.
const LIVE_SHARE: f64 = 1.0 / 4.0;
const BATCH_SHARE: f64 = 1.0 / 16.0;

impl Pool {
    fn new(pixels: usize) -> Self {
        Self { pixels, free: room(pixels) }
    }

    /// The pixels that a view takes of it; `None` where the view is larger than the pool.
    fn price(&self, camera: &PinholeCamera) -> Option<u32> {
        let pixels = camera.pixel_count();
        u32::try_from(pixels).ok().filter(|_| pixels <= self.pixels)
    }

    /// The pixels that a view takes of the largest pool, at most all: one view larger than the bound still passes, alone.
    fn price_at_most(&self, camera: &PinholeCamera) -> u32 {
        u32::try_from(camera.pixel_count().min(self.pixels.max(1))).unwrap_or(u32::MAX)
    }
}

impl NodeQuota {
    pub(crate) fn new(limits: Quotas) -> Self {
        let part = |share: f64| (limits.pixels as f64 * share) as usize;
        let (live, batches) = (part(LIVE_SHARE), part(BATCH_SHARE));
        Self {
            limits,
            streams: room(limits.streams),
            views: room(limits.views),
            common: Pool::new(limits.pixels - live - batches),
            live: Pool::new(live),
            batches: Pool::new(batches),
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
        let view = self.views.clone().try_acquire_owned().map_err(few)?;
        let small = || self.exceeded("pixels", self.limits.pixels, "pixels of views are in flight");
        Ok(NodeCredit { _pixels: self.try_pixels(&self.batches, camera).ok_or_else(small)?, _view: Some(view) })
    }

    /// Waits for room for a view of a batch.
    pub(crate) async fn view(&self, camera: &PinholeCamera) -> Result<NodeCredit, Status> {
        let view = self.views.clone().acquire_owned().await.map_err(closed)?;
        Ok(NodeCredit { _pixels: self.pixels(&self.batches, camera).await?, _view: Some(view) })
    }

    /// Room for a view of a live stream, if it need not wait.
    pub(crate) fn try_live_view(&self, camera: &PinholeCamera) -> Option<NodeCredit> {
        Some(NodeCredit { _pixels: self.try_pixels(&self.live, camera)?, _view: None })
    }

    /// Waits for room for a view of a live stream.
    pub(crate) async fn live_view(&self, camera: &PinholeCamera) -> Result<NodeCredit, Status> {
        Ok(NodeCredit { _pixels: self.pixels(&self.live, camera).await?, _view: None })
    }

    fn try_pixels(&self, own: &Pool, camera: &PinholeCamera) -> Option<OwnedSemaphorePermit> {
        let of_own = own.price(camera).and_then(|price| own.free.clone().try_acquire_many_owned(price).ok());
        let price = self.common.price_at_most(camera);
        of_own.or_else(|| self.common.free.clone().try_acquire_many_owned(price).ok())
    }

    /// Waits for pixels of `own` or of all, whichever are free first.
    async fn pixels(&self, own: &Pool, camera: &PinholeCamera) -> Result<OwnedSemaphorePermit, Status> {
        let of_own = async {
            match own.price(camera) {
                Some(price) => own.free.clone().acquire_many_owned(price).await,
                None => std::future::pending().await,
            }
        };
        let of_all = self.common.free.clone().acquire_many_owned(self.common.price_at_most(camera));
        tokio::select! {
            biased;
            pixels = of_own => pixels.map_err(closed),
            pixels = of_all => pixels.map_err(closed),
        }
    }

    fn exceeded(&self, quota: &str, limit: usize, what: &str) -> Status {
        Status::resource_exhausted(format!("quota {quota}: {limit} {what} on this node"))
    }
}

fn room(count: usize) -> Arc<Semaphore> {
    Arc::new(Semaphore::new(count.clamp(1, u32::MAX as usize)))
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

    /// 40 pixels for live views, 10 for batches, 110 for both.
    fn quota() -> NodeQuota {
        NodeQuota::new(Quotas { streams: 1, views: 2, pixels: 160 })
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
        assert!(quota.try_view(&camera(4)).unwrap_err().message().starts_with("quota pixels: 160 "));
        let second = quota.try_view(&camera(3)).unwrap();
        assert!(quota.try_view(&camera(1)).unwrap_err().message().starts_with("quota views: 2 "));
        drop((first, second));
        assert!(quota.try_view(&camera(1000)).is_ok(), "larger than all, alone");
    }

    #[tokio::test]
    async fn batches_leave_room_for_live_views() {
        let quota = quota();
        let batch = quota.try_view(&camera(10)).unwrap();
        let live = quota.live_view(&camera(6)).await.unwrap();
        let next = camera(5);
        let mut waits = Box::pin(quota.live_view(&next));
        assert!(at_once(&mut waits).await.is_none(), "36 of 40 pixels are taken, and 100 of 110");
        drop(batch);
        assert!(waits.await.is_ok(), "pixels of both count for either");
        drop(live);
    }

    #[tokio::test]
    async fn live_views_leave_room_for_batches() {
        let quota = quota();
        let _live = [quota.live_view(&camera(6)).await.unwrap(), quota.live_view(&camera(10)).await.unwrap()];
        assert!(at_once(&mut Box::pin(quota.live_view(&camera(4)))).await.is_none());
        let small = quota.try_view(&camera(3)).unwrap();
        assert!(quota.try_view(&camera(4)).is_err());
        let next = camera(3);
        let mut waits = Box::pin(quota.view(&next));
        assert!(at_once(&mut waits).await.is_some(), "pixels of both count for either");
        drop(small);
    }

    async fn at_once<T>(future: &mut (impl Future<Output = T> + Unpin)) -> Option<T> {
        tokio::time::timeout(std::time::Duration::from_millis(5), future).await.ok()
    }
}
