//! Clusters of the scalar device on real ports, in one process and in many: views, plans, budgets, faults and pages.
#![allow(clippy::unwrap_used)]

mod bases;
mod blocks;
mod cells;
mod cubes;
mod delivery;
mod faults;
mod faulty_requests;
mod live;
mod mirrors;
mod paces;
mod promises;
mod roles;
mod streams;
mod viewer;
mod viewer_http;
mod workloads;
