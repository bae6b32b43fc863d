//! Bounds on the views in flight, of each stream and of all together.

use std::sync::Arc;

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
    _bytes: OwnedSemaphorePermit,
    /// `None` for live streams: these are bounded by their number, as each has two views in flight at most.
    _view: Option<OwnedSemaphorePermit>,
}

/// A part of the node's memory for views, in units of 1,024 bytes: a permit of many counts to 2³².
struct Pool {
    units: usize,
    free: Arc<Semaphore>,
}

/// The room that a node has. The memory of all views has one bound: a part is for live views alone, a small part for
/// batches alone, and the rest for both. Neither can starve the other.
pub(crate) struct NodeQuota {
    pub(crate) limits: Quotas,
    streams: Arc<Semaphore>,
    views: Arc<Semaphore>,
    common: Pool,
    live: Pool,
    batches: Pool,
}

/// The share of memory for live views alone, and for batches alone.
const LIVE_SHARE: f64 = 1.0 / 4.0;
const BATCH_SHARE: f64 = 1.0 / 16.0;

/// Bytes of a unit.
const UNIT: usize = 1 << 10;

impl Pool {
    fn new(units: usize) -> Self {
        Self { units, free: room(units) }
    }

    /// The units that a view takes of it; `None` where the view is larger than the pool.
    fn price(&self, bytes: usize) -> Option<u32> {
        let units = bytes.div_ceil(UNIT);
        u32::try_from(units).ok().filter(|_| units <= self.units)
    }

    /// The units that a view takes of the largest pool, at most all: one view larger than the pool still passes, alone.
    fn price_at_most(&self, bytes: usize) -> u32 {
        u32::try_from(bytes.div_ceil(UNIT).min(self.units.max(1))).unwrap_or(u32::MAX)
    }
}

impl NodeQuota {
    pub(crate) fn new(limits: Quotas) -> Self {
        let units = limits.view_bytes / UNIT;
        let live = (units as f64 * LIVE_SHARE) as usize;
        let batches = (units as f64 * BATCH_SHARE) as usize;
        Self {
            limits,
            streams: room(limits.streams),
            views: room(limits.views),
            common: Pool::new(units - live - batches),
            live: Pool::new(live),
            batches: Pool::new(batches),
        }
    }

    /// Room for one more stream.
    pub(crate) fn stream(&self) -> Result<OwnedSemaphorePermit, Status> {
        let place = self.streams.clone().try_acquire_owned();
        place.map_err(|_| self.exceeded("streams", self.limits.streams, "streams are open"))
    }

    /// Room for a view of a batch; an error while all room is taken.
    pub(crate) fn try_view(&self, bytes: usize) -> Result<NodeCredit, Status> {
        let Ok(view) = self.views.clone().try_acquire_owned() else {
            return Err(self.exceeded("views", self.limits.views, "views are in flight"));
        };
        match self.try_bytes(&self.batches, bytes) {
            Some(bytes) => Ok(NodeCredit { _bytes: bytes, _view: Some(view) }),
            None => Err(self.exceeded("view-memory", self.limits.view_bytes, "bytes of views are in flight")),
        }
    }

    /// Waits for room for a view of a batch.
    pub(crate) async fn view(&self, bytes: usize) -> Result<NodeCredit, Status> {
        let view = self.views.clone().acquire_owned().await.map_err(closed)?;
        Ok(NodeCredit { _bytes: self.bytes(&self.batches, bytes).await?, _view: Some(view) })
    }

    /// Room for a view of a live stream, if it need not wait.
    pub(crate) fn try_live_view(&self, bytes: usize) -> Option<NodeCredit> {
        Some(NodeCredit { _bytes: self.try_bytes(&self.live, bytes)?, _view: None })
    }

    /// Waits for room for a view of a live stream.
    pub(crate) async fn live_view(&self, bytes: usize) -> Result<NodeCredit, Status> {
        Ok(NodeCredit { _bytes: self.bytes(&self.live, bytes).await?, _view: None })
    }

    fn try_bytes(&self, own: &Pool, bytes: usize) -> Option<OwnedSemaphorePermit> {
        let of_own = own.price(bytes).and_then(|price| own.free.clone().try_acquire_many_owned(price).ok());
        let price = self.common.price_at_most(bytes);
        of_own.or_else(|| self.common.free.clone().try_acquire_many_owned(price).ok())
    }

    /// Waits for bytes of `own` or of all, whichever are free first.
    async fn bytes(&self, own: &Pool, bytes: usize) -> Result<OwnedSemaphorePermit, Status> {
        let of_own = wait_for(own.price(bytes).map(|price| own.free.clone().acquire_many_owned(price)));
        let of_all = self.common.free.clone().acquire_many_owned(self.common.price_at_most(bytes));
        tokio::select! {
            biased;
            permit = of_own => permit.map_err(closed),
            permit = of_all => permit.map_err(closed),
        }
    }

    fn exceeded(&self, quota: &str, limit: usize, what: &str) -> Status {
        Status::resource_exhausted(format!("quota {quota}: {limit} {what} on this node"))
    }
}

fn room(count: usize) -> Arc<Semaphore> {
    Arc::new(Semaphore::new(count.clamp(1, u32::MAX as usize)))
}

/// Waits for the work; without any, waits for ever.
pub(crate) async fn wait_for<F: Future>(work: Option<F>) -> F::Output {
    match work {
        Some(work) => work.await,
        None => std::future::pending().await,
    }
}

pub(crate) fn closed<E>(_: E) -> Status {
    Status::internal("credits are closed")
}

#[cfg(test)]
mod tests {
    use depth_image::{PinholeCamera, ViewPlanes};
    use glam::{UVec2, Vec3};
    use tonic::Code;

    use super::*;

    /// 40 units for live views, 10 for batches, 110 for both.
    fn quota() -> NodeQuota {
        NodeQuota::new(Quotas { streams: 1, views: 2, view_bytes: 160 * UNIT })
    }

    #[test]
    fn a_view_beyond_all_memory_is_refused_with_its_size() {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::new(160, 170));
        let limits = quota().limits;
        assert!(limits.check_views(&[camera], ViewPlanes::COLOR).is_ok());
        let refused = limits.check_views(&[camera], ViewPlanes::WITH_DEPTH).unwrap_err();
        assert_eq!(refused.code(), Code::InvalidArgument);
        assert!(refused.message().contains("a view of 160×170 takes 380800 bytes"), "{refused}");
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
        let first = quota.try_view(100 * UNIT).unwrap();
        assert!(quota.try_view(16 * UNIT).unwrap_err().message().starts_with("quota view-memory: 163840 "));
        let second = quota.try_view(9 * UNIT).unwrap();
        assert!(quota.try_view(UNIT).unwrap_err().message().starts_with("quota views: 2 "));
        drop((first, second));
        assert!(quota.try_view(1000 * UNIT).is_ok(), "larger than all, alone");
    }

    #[tokio::test]
    async fn batches_leave_room_for_live_views() {
        let quota = quota();
        let batch = quota.try_view(100 * UNIT).unwrap();
        let live = quota.live_view(36 * UNIT).await.unwrap();
        let mut waits = Box::pin(quota.live_view(25 * UNIT));
        assert!(at_once(&mut waits).await.is_none(), "36 of 40 units are taken, and 100 of 110");
        drop(batch);
        assert!(waits.await.is_ok(), "memory of both counts for either");
        drop(live);
    }

    #[tokio::test]
    async fn live_views_leave_room_for_batches() {
        let quota = quota();
        let _live = [quota.live_view(36 * UNIT).await.unwrap(), quota.live_view(100 * UNIT).await.unwrap()];
        assert!(at_once(&mut Box::pin(quota.live_view(16 * UNIT))).await.is_none());
        let small = quota.try_view(9 * UNIT).unwrap();
        assert!(quota.try_view(16 * UNIT).is_err());
        let mut waits = Box::pin(quota.view(9 * UNIT));
        assert!(at_once(&mut waits).await.is_some(), "memory of both counts for either");
        drop(small);
    }

    async fn at_once<T>(future: &mut (impl Future<Output = T> + Unpin)) -> Option<T> {
        tokio::time::timeout(std::time::Duration::from_millis(5), future).await.ok()
    }
}
