//! `myriorama-lab study compare`: by how much the fronts of one release cost more or less than those of another.

mod bd_time;
pub mod command;
mod fronts;
mod pchip;

pub use bd_time::time_at;
