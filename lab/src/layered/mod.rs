//! `myriorama study layered`: views from layered depth cubes.

mod base;
mod baselines;
pub mod command;
mod cubes;
mod glossy;
mod mirrors;
mod paper;
pub mod pyramid;
mod storage;
mod subject;
mod table_one;
mod triangles;
mod viewpoints;
mod views;
mod warp;
