//! Refusals that name the plan in force: a peer of another plan may be unable to reach the coordinator.

use cluster::Assignment;
use prost::Message as _;
use tonic::metadata::{MetadataMap, MetadataValue};
use tonic::{Code, Status};

use crate::convert::Convert;
use crate::proto;

/// The metadata key of the plan in force.
const PLAN_KEY: &str = "myriorama-plan-bin";
/// In base64 it must fit the 16 KiB of headers that peers take.
const MAX_PLAN_IN_METADATA_BYTES: usize = 8 << 10;

/// Refuses a request under another plan than `in_force`, and names that plan.
#[must_use]
pub fn refuse_plan(in_force: &Assignment, message: String) -> Status {
    let bytes = Convert::<proto::Assignment>::write(in_force.clone()).encode_to_vec();
    let mut metadata = MetadataMap::new();
    // A plan that is too large for metadata is left to the coordinator to tell.
    if bytes.len() <= MAX_PLAN_IN_METADATA_BYTES {
        metadata.insert_bin(PLAN_KEY, MetadataValue::from_bytes(&bytes));
    }
    Status::with_metadata(Code::FailedPrecondition, message, metadata)
}

/// The plan in force that a refusal names; `None` where it names none.
#[must_use]
pub fn plan_in_force(refusal: &Status) -> Option<Assignment> {
    let bytes = refusal.metadata().get_bin(PLAN_KEY)?.to_bytes().ok()?;
    Assignment::read(proto::Assignment::decode(bytes).ok()?, PLAN_KEY).ok()
}
