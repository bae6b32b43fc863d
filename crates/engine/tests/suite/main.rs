//! The engine on the software device: cubes, mirrors, environment maps, light of samples, samples of lamps, and views in bands.

mod bands;
mod cubes;
mod environment;
mod lamp_samples;
mod light_cache;
mod mirrors;
mod stage;
