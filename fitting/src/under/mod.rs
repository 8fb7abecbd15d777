//! A known person inside a more dressed scan: pose, then hands and skin.

mod contain;
mod elsewhere;
mod inside;
mod patches;
mod pose;
mod problem;
mod report;
mod seed;
mod settle;
mod worn;

pub(crate) use {contain::contained, inside::Inside};
pub use {
    pose::pose_under,
    report::{UnderFit, UnderReport},
    settle::{SettleReport, SettledBody, settle_under},
    worn::pose_as_worn,
};
