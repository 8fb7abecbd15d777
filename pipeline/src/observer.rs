//! The receiver of a run's progress.

/// Hears how far a run is. Costs are expected seconds; only their proportions matter.
///
/// A step that is up to date is skipped; any other begins, is at some fraction of its work, and ends. After an error
/// the running step does not end.
pub trait Observer: Sync {
    /// Steps of this cost lie ahead.
    fn plan(&self, cost: f64);
    /// A planned step of this cost need not run.
    fn skip(&self, cost: f64);
    /// A planned step begins.
    fn begin(&self, label: &str, cost: f64);
    /// The running step is this far, 0 to 1. May come from any thread.
    fn at(&self, fraction: f32);
    /// The running step ends.
    fn end(&self);
    /// Something that the operator should know, in a sentence: a record that was changed by hand.
    fn remark(&self, sentence: &str);
}

/// Listens to nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn plan(&self, _: f64) {}
    fn skip(&self, _: f64) {}
    fn begin(&self, _: &str, _: f64) {}
    fn at(&self, _: f32) {}
    fn end(&self) {}
    fn remark(&self, _: &str) {}
}
