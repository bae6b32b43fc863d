//! `myriorama study layered`: views from layered depth cubes.

pub mod command;
mod cubes;
mod mirrors;
mod subject;
mod viewpoints;
mod views;
