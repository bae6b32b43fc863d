//! Tests of the device behind a node and in a cluster, against views drawn from the scene.

mod device_faults;
mod planning;
mod reference_views;
