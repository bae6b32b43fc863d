//! `myriorama study layered`: views from layered depth cubes.

mod base;
mod baselines;
pub mod command;
mod cubes;
mod glossy;
mod mirrors;
pub mod pyramid;
mod subject;
mod triangles;
mod viewpoints;
mod views;
mod warp;
