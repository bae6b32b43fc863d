//! Policies.

use cluster::{Policy, PolicyChoice};

use crate::error::WireError;
use crate::proto;

pub(crate) fn policy_from(value: i32) -> Result<Policy, WireError> {
    match proto::Policy::try_from(value) {
        Ok(proto::Policy::Pipeline) => Ok(Policy::Pipeline),
        Ok(proto::Policy::Direct) => Ok(Policy::Direct),
        Ok(proto::Policy::TimeShare) => Ok(Policy::TimeShare),
        _ => Err(WireError::UnknownEnum { field: "policy", value }),
    }
}

pub(crate) fn policy_to(policy: Policy) -> i32 {
    match policy {
        Policy::Pipeline => proto::Policy::Pipeline.into(),
        Policy::Direct => proto::Policy::Direct.into(),
        Policy::TimeShare => proto::Policy::TimeShare.into(),
    }
}

pub(crate) fn choice_from(value: i32) -> Result<PolicyChoice, WireError> {
    match proto::PolicyChoice::try_from(value) {
        Ok(proto::PolicyChoice::Auto) => Ok(PolicyChoice::Auto),
        Ok(proto::PolicyChoice::Pipeline) => Ok(PolicyChoice::Pipeline),
        Ok(proto::PolicyChoice::Direct) => Ok(PolicyChoice::Direct),
        Ok(proto::PolicyChoice::TimeShare) => Ok(PolicyChoice::TimeShare),
        _ => Err(WireError::UnknownEnum { field: "policy_choice", value }),
    }
}

pub(crate) fn choice_to(choice: PolicyChoice) -> i32 {
    match choice {
        PolicyChoice::Auto => proto::PolicyChoice::Auto.into(),
        PolicyChoice::Pipeline => proto::PolicyChoice::Pipeline.into(),
        PolicyChoice::Direct => proto::PolicyChoice::Direct.into(),
        PolicyChoice::TimeShare => proto::PolicyChoice::TimeShare.into(),
    }
}
