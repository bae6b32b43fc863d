//! Drawing, rays and light on the software device: closed forms, the scalar reference, and where they fail.

mod animation;
mod antialias;
mod closed_forms;
mod environment_map;
mod glass;
mod glossy;
mod indirect;
mod lamp_grid;
mod layered;
mod light_cache;
mod light_failures;
mod light_field;
mod materials;
mod raster;
mod reflections;
mod single_pole;
mod slices;
mod stage;
mod tone;
