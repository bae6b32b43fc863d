//! One device for many: turns, slices and bounds (docs/device.md, "Sharing the device").

mod fair_order;
mod job_limit;
mod queue;
mod rates;

pub use depth_image::{Turn, WorkClass};
pub use job_limit::{Job, JobLimit};
pub(crate) use queue::Slot;
pub use queue::{DeviceQueue, LiveStream, SLICE_S, waited_s};
pub(crate) use rates::Work;
pub use rates::WorkKind;
