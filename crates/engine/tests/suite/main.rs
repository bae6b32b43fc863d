//! The engine on the software device: cubes, mirrors, environment maps, light of samples, and views in bands.

mod bands;
mod cubes;
mod environment;
mod light_cache;
mod mirrors;
mod stage;
