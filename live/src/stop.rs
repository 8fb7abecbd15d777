//! When a take ends, and who sets the pace.

/// When the take ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// After one full turn of the subject.
    AfterOneTurn,
    /// After this many seconds of the device's time.
    After(f64),
}

/// Who sets the pace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// The device: frames come when they come, and nothing may hold them up.
    Live,
    /// We: the next frame comes when it is asked for, so the preview can see every one.
    OnDemand,
}
