//! `myriorama-lab study shadows`: soft shadows from samples of what a lamp sees (Xie et al. 2016, §5 and §6.2), with the paper's Tables 3, 4
//! and 5 and Figs 8 and 9.

pub mod command;
mod errors;
mod measure;
mod paper;
mod report;
mod subject;
