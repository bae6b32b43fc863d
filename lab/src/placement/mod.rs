//! `myriorama-lab study placement`: what a choice of places for sample cameras would gain over the fixed order.

pub mod command;
mod coverage;
