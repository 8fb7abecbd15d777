//! Counts in the text format of Prometheus.

use std::{
    fmt::Write,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

/// Counts since the service was started.
#[derive(Debug, Default)]
pub struct Metrics {
    /// Requests that came.
    pub requests: AtomicU64,
    /// Requests that were answered with 4xx.
    pub refused: AtomicU64,
    /// Requests that were answered with 5xx.
    pub failed: AtomicU64,
    /// Requests that were too many, of those that were refused.
    pub too_many: AtomicU64,
    /// Viewers of live pictures now.
    pub viewers: Arc<AtomicU64>,
    /// Listeners of events now.
    pub listeners: Arc<AtomicU64>,
    /// Connections that are open now.
    pub connections: Arc<AtomicU64>,
    /// Connections that were closed at once, because there were too many.
    pub connections_refused: AtomicU64,
}

/// One more of something, for as long as this lives.
#[derive(Debug)]
pub struct Counted(Arc<AtomicU64>);

impl Counted {
    /// Counts one more, where there are fewer than `most`.
    pub fn within(count: &Arc<AtomicU64>, most: u64) -> Option<Self> {
        let counted = Self(count.clone());
        (count.fetch_add(1, Ordering::Relaxed) < most).then_some(counted)
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Lines of the text, in their order.
#[derive(Default)]
pub struct Lines(String);

impl Lines {
    /// A family of values with one sentence about it.
    pub fn family(&mut self, name: &str, kind: &str, help: &str, values: &[(String, f64)]) -> &mut Self {
        // Writing into a string cannot fail.
        let _ = writeln!(self.0, "# HELP toile_{name} {help}\n# TYPE toile_{name} {kind}");
        values.iter().for_each(|(labels, value)| {
            let _ = writeln!(self.0, "toile_{name}{labels} {value}");
        });
        self
    }

    /// One value.
    pub fn value(&mut self, name: &str, kind: &str, help: &str, value: f64) -> &mut Self {
        self.family(name, kind, help, &[(String::new(), value)])
    }

    /// The text.
    pub fn text(self) -> String {
        self.0
    }
}

impl Metrics {
    /// Its own counts.
    pub fn write(&self, lines: &mut Lines) {
        let value = |count: &AtomicU64| count.load(Ordering::Relaxed) as f64;
        lines
            .value("http_requests_total", "counter", "Requests that came.", value(&self.requests))
            .value("http_refused_total", "counter", "Requests answered with 4xx.", value(&self.refused))
            .value("http_failed_total", "counter", "Requests answered with 5xx.", value(&self.failed))
            .value(
                "http_too_many_total",
                "counter",
                "Requests refused because there were too many.",
                value(&self.too_many),
            )
            .value("connections", "gauge", "Open connections.", value(&self.connections))
            .value(
                "connections_refused_total",
                "counter",
                "Connections closed at once.",
                value(&self.connections_refused),
            )
            .value("live_viewers", "gauge", "Viewers of live pictures.", value(&self.viewers))
            .value("event_listeners", "gauge", "Listeners of events.", value(&self.listeners));
    }
}
