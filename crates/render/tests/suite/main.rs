//! Drawing, rays and light on the software device: closed forms, the scalar reference, and where they fail.

mod closed_forms;
mod environment_map;
mod light_failures;
mod raster;
mod slices;
mod stage;
