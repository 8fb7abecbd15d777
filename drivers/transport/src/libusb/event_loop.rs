//! The thread that takes finished transfers from the kernel.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use rusb::{Context, UsbContext};

use crate::TransportError;

/// How often the thread looks whether it should end.
const TICK: Duration = Duration::from_millis(100);

/// A context and its thread; dropping ends the thread.
pub(super) struct EventLoop {
    context: Context,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl EventLoop {
    pub(super) fn start(context: Context) -> Result<Self, TransportError> {
        let ends = Arc::new(AtomicBool::new(false));
        let (its_context, its_end) = (context.clone(), ends.clone());
        let run = move || {
            while !its_end.load(Ordering::Acquire) {
                if let Err(error) = its_context.handle_events(Some(TICK)) {
                    tracing::debug!(%error, "USB events");
                    // Interrupted calls are usual; should every call fail, the thread must not spin.
                    thread::sleep(Duration::from_millis(1));
                }
            }
        };
        let thread = thread::Builder::new().name("usb events".into()).spawn(run).map_err(|_| rusb::Error::NoMem)?;
        Ok(Self { context, ends, thread: Some(thread) })
    }

    pub(super) fn context(&self) -> &Context {
        &self.context
    }
}

impl Drop for EventLoop {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        self.context.interrupt_handle_events();
        if let Some(thread) = self.thread.take() {
            // A transfer that came back late can be the last owner: a thread cannot wait for itself.
            if thread.thread().id() != thread::current().id() {
                drop(thread.join());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_loops_start_and_end() {
        for _ in 0..100 {
            let context = Context::new();
            if !toile_outside::capability(context.is_ok(), "a kernel on which libusb starts") {
                return;
            }
            drop(EventLoop::start(context.unwrap()).unwrap());
        }
    }
}
