//! Messages to types of the domain and back. Numbers that stand for "none" on the wire become `None` here.

mod assignment;
mod frames;
pub(crate) mod geometry;
mod illumination;
mod images;
mod node;
mod offer;
mod policy;
mod report;
mod scene;
mod session;
mod status;
mod views;
mod workload;
