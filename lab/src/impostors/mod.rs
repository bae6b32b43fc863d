//! `myriorama-lab study impostors`: how well images of a mirror's surroundings answer its rays (Rosen et al.).

pub mod command;
mod glass;
mod horizons;
mod maze;
mod measure;
mod objects;
mod rays;
mod reliefs;
mod single_rays;
mod surfaces;
mod walk;

pub use measure::{around, changed, reflecting};
