//! The commands, a file each: its options, its calls, its answer.

pub mod animate;
pub mod calibrate;
mod calibrate_board;
pub mod capture;
pub mod completions;
pub mod demo;
pub mod devices;
pub mod edit;
pub mod export;
pub mod extract;
pub mod fit;
pub mod fuse;
pub mod import;
pub mod inspect;
pub mod measure;
mod nuisances;
mod output;
mod prior;
pub mod process;
mod reach;
pub mod reorder;
pub mod serve;
pub mod settings;
pub mod synthesize;
