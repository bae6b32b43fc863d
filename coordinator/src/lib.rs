//! The coordinator's service, the cluster's state and its pure schedule.
