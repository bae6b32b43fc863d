//! `myriorama-lab study impostors`: how well images of a mirror's surroundings answer its rays.

mod candidates;
pub mod command;
mod costs;
mod measure;
mod objects;
mod orders;
mod reflectance;
mod single_rays;

pub use measure::{around, changed, reflecting};
