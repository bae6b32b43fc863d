//! The engine on the software device: cubes, mirrors, environment maps, and views in bands.

mod bands;
mod cubes;
mod environment;
mod mirrors;
mod stage;
