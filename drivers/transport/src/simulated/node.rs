//! A video node of a simulated bus. Waiting for a picture lets the bus run until it is there or the time limit has passed
//! on the bus, so a run is the same every time.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use super::{
    device::{Answer, Packet},
    flow::{BULK_ROOM, Flow, MAX_ROOM},
    plugged::Plugged,
    uvc::{Assembler, Function, Streaming},
};
use crate::{
    Setup, TransportError,
    video::{FourCc, NodeInfo, PictureLayout, VideoBuffer, VideoNode},
};

/// Microframes a second.
const MICROFRAMES: f64 = 8000.0;
/// Nanoseconds of a microframe.
const MICROFRAME_NS: i64 = 125_000;
/// How long one bulk read takes on the bus.
const BULK_MICROFRAMES: u64 = 4;
/// The kernel gives up waiting for an answer after this (`UVC_CTRL_CONTROL_TIMEOUT`).
const CONTROL_LIMIT: Duration = Duration::from_secs(5);
/// Requests of the UVC specification 1.1, tables; bytes of its probe control (§4.3.1.1).
const SET_CUR: u8 = 0x01;
const GET_CUR: u8 = 0x81;
const GET_LENGTH: u8 = 0x85;
const PROBE: u16 = 0x0100;
const COMMIT: u16 = 0x0200;
const PROBE_BYTES: usize = 34;

/// An open node of a simulated stream; see [`VideoNode`].
pub(super) struct SimulatedNode {
    info: NodeInfo,
    plugged: Plugged,
    function: Function,
    stream: Streaming,
    is_metadata: bool,
    flow: Arc<Mutex<Flow>>,
    /// The request: format, size, frame index, interval.
    asked: Option<Asked>,
    whole_headers: bool,
}

#[derive(Debug, Clone, Copy)]
struct Asked {
    layout: PictureLayout,
    format: u8,
    size: u8,
    intervals: [u32; 8],
    interval: u32,
}

impl SimulatedNode {
    /// The node of a stream, for pictures or for their metadata.
    pub(super) fn new(
        info: NodeInfo,
        plugged: Plugged,
        (function, stream): (Function, Streaming),
        is_metadata: bool,
        whole_headers: bool,
    ) -> Self {
        let flow = plugged.flow(stream.interface);
        Self { info, plugged, function, stream, is_metadata, flow, asked: None, whole_headers }
    }

    fn flow(&self) -> MutexGuard<'_, Flow> {
        self.flow.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self, action: &'static str) -> TransportError {
        TransportError::from_video(&self.info.node, action, std::io::ErrorKind::InvalidInput.into())
    }

    fn ask(&self, setup: Setup, data: &[u8]) -> Result<Vec<u8>, TransportError> {
        let what = format!("request {:#04x} to control {:#06x}", setup.request, setup.value);
        self.plugged.ask(&what, CONTROL_LIMIT, |device| device.control(setup, data))
    }

    fn extension(&self, unit: u8, selector: u8, request: u8, length: usize) -> Result<Setup, TransportError> {
        if !self.function.extensions.contains(&unit) {
            return Err(self.failed("ask an extension unit that it has not"));
        }
        let request_type = if request == SET_CUR { 0x21 } else { 0xa1 };
        let index = u16::from(unit) << 8 | u16::from(self.function.interface);
        let length = u16::try_from(length).unwrap_or(u16::MAX);
        Ok(Setup { request_type, request, value: u16::from(selector) << 8, index, length })
    }

    /// The kernel refuses requests of another length than the device states.
    fn check_length(&self, unit: u8, selector: u8, length: usize) -> Result<(), TransportError> {
        let stated = self.ask(self.extension(unit, selector, GET_LENGTH, 2)?, &[])?;
        let stated = stated.first_chunk().map_or(0, |bytes| usize::from(u16::from_le_bytes(*bytes)));
        if stated == length {
            Ok(())
        } else {
            Err(self.failed("ask its extension unit with another length than it has"))
        }
    }

    fn probe(&self, request: u8, value: u16, data: &[u8]) -> Result<Vec<u8>, TransportError> {
        let request_type = if request == SET_CUR { 0x21 } else { 0xa1 };
        let index = u16::from(self.stream.interface);
        self.ask(Setup { request_type, request, value, index, length: PROBE_BYTES as u16 }, data)
    }

    /// Probe and commit (UVC 1.1 §4.3.1.1), then the alternate setting that has the room.
    fn commit(&self, asked: &Asked) -> Result<(), TransportError> {
        let mut wish = vec![0; PROBE_BYTES];
        (wish[0], wish[2], wish[3]) = (1, asked.format, asked.size);
        wish[4..8].copy_from_slice(&asked.interval.to_le_bytes());
        self.probe(SET_CUR, PROBE, &wish)?;
        let agreed = self.probe(GET_CUR, PROBE, &[])?;
        let word = |at: usize| agreed.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
        let short = || self.failed("agree on a format with it (its answer is short)");
        let (size, payload) = (word(18).ok_or_else(short)?, word(22).ok_or_else(short)?);
        self.probe(SET_CUR, COMMIT, &agreed)?;
        let fits = |room: usize| room >= payload;
        if !self.stream.alternates.is_empty() {
            let found = self.stream.alternates.iter().filter(|(_, room)| fits(*room)).min_by_key(|(_, room)| *room);
            let (alternate, _) = found.ok_or_else(|| self.failed("find the bandwidth for it"))?;
            let index = u16::from(self.stream.interface);
            let value = u16::from(*alternate);
            self.ask(Setup { request_type: 0x01, request: 0x0b, value, index, length: 0 }, &[])?;
        }
        let is_fixed = asked.layout.format != FourCc::MJPG;
        let mut flow = self.flow();
        let assembler = Assembler::new(if is_fixed { size } else { 0 }, size.min(MAX_ROOM), flow.is_whole);
        let start = self.plugged.clock();
        *flow = Flow {
            assembler: Some(assembler),
            payload_size: payload,
            room: flow.room,
            is_whole: flow.is_whole,
            microframe: start,
            ..Flow::default()
        };
        Ok(())
    }

    /// Lets the bus run for a moment; how many microframes passed.
    fn run(&self, flow: &mut Flow) -> Result<u64, TransportError> {
        let gone = || {
            self.plugged.leave();
            Err(TransportError::Unplugged)
        };
        self.plugged.check_here()?;
        let now_ns = flow.microframe as i64 * MICROFRAME_NS;
        let passed = if let Some((_, room)) = self.stream.alternates.iter().max_by_key(|(_, room)| *room) {
            match self.plugged.device().isochronous(self.stream.endpoint, flow.microframe, *room) {
                Packet::Data(mut data) => {
                    data.truncate(*room);
                    flow.take(&data, now_ns);
                }
                Packet::Damaged => flow.assembler.iter_mut().for_each(Assembler::damage),
                Packet::Gone => return gone(),
            }
            1
        } else {
            match self.plugged.device().bulk_in(self.stream.endpoint, BULK_ROOM) {
                Answer::Data(data) => flow.take_bulk(&data, now_ns),
                Answer::Stall | Answer::Silence => {}
                Answer::Gone => return gone(),
            }
            BULK_MICROFRAMES
        };
        flow.microframe += passed;
        self.plugged.advance(flow.microframe);
        Ok(passed)
    }
}

impl VideoNode for SimulatedNode {
    fn is_metadata(&self) -> bool {
        self.is_metadata
    }

    fn name(&self) -> &str {
        &self.info.name
    }

    fn formats(&self) -> Result<Vec<FourCc>, TransportError> {
        let formats = self.stream.formats.iter().map(|f| f.code);
        Ok(if self.is_metadata { Vec::new() } else { formats.collect() })
    }

    fn sizes(&self, format: FourCc) -> Result<Vec<(u32, u32)>, TransportError> {
        let formats = self.stream.formats.iter().filter(|f| f.code == format && !self.is_metadata);
        Ok(formats.flat_map(|f| f.sizes.iter().map(|s| (s.width, s.height))).collect())
    }

    /// As `uvc_v4l2_try_format`: the format asked for or the first one, and the size that is nearest.
    fn set_format(&mut self, format: FourCc, width: u32, height: u32) -> Result<PictureLayout, TransportError> {
        if self.is_metadata {
            let is_whole = self.whole_headers && format == FourCc::D4XX;
            self.flow().is_whole = is_whole;
            let format = if is_whole { FourCc::D4XX } else { FourCc::UVC_HEADER };
            return Ok(PictureLayout { format, width: 0, height: 0, stride: 0 });
        }
        let formats = &self.stream.formats;
        let found = formats.iter().find(|f| f.code == format).or(formats.first());
        let found = found.ok_or_else(|| self.failed("set its format"))?;
        let area = |w: u32, h: u32| u64::from(w.min(width)) * u64::from(h.min(height));
        let distance = |w: u32, h: u32| {
            (u64::from(w) * u64::from(h) + u64::from(width) * u64::from(height)).saturating_sub(2 * area(w, h))
        };
        let nearest = found.sizes.iter().min_by_key(|s| distance(s.width, s.height));
        let size = *nearest.ok_or_else(|| self.failed("set its format"))?;
        let stride = match found.code {
            FourCc::MJPG => 0,
            FourCc::GREY => size.width,
            _ => 2 * size.width,
        };
        let layout = PictureLayout { format: found.code, width: size.width, height: size.height, stride };
        let (format, interval) = (found.index, size.intervals[0]);
        self.asked = Some(Asked { layout, format, size: size.index, intervals: size.intervals, interval });
        Ok(layout)
    }

    fn set_rate(&mut self, fps: u32) -> Result<f64, TransportError> {
        let wanted = 10_000_000 / fps.max(1);
        let failed = self.failed("set its rate");
        let asked = self.asked.as_mut().ok_or(failed)?;
        let offered = asked.intervals.into_iter().filter(|i| *i > 0);
        asked.interval = offered.min_by_key(|i| i.abs_diff(wanted)).unwrap_or(asked.interval);
        Ok(1e7 / f64::from(asked.interval.max(1)))
    }

    fn start(&mut self, buffers: u32) -> Result<(), TransportError> {
        self.flow().room[usize::from(self.is_metadata)] = buffers as usize;
        match (self.is_metadata, self.asked) {
            (true, _) => Ok(()),
            (false, Some(asked)) => self.commit(&asked),
            (false, None) => Err(self.failed("start it before a format is set")),
        }
    }

    fn next_buffer(&mut self, limit: Duration) -> Result<VideoBuffer, TransportError> {
        let mut flow = self.flow();
        let mut left = (limit.as_secs_f64() * MICROFRAMES) as u64;
        loop {
            if let Some(buffer) = flow.queue(self.is_metadata).pop_front() {
                return Ok(buffer);
            }
            if left == 0 || flow.assembler.is_none() {
                let what = format!("waiting for a picture of {}", self.info.node.display());
                return Err(TransportError::TimedOut { what, waited: limit });
            }
            left = left.saturating_sub(self.run(&mut flow)?);
        }
    }

    fn stop(&mut self) {
        let mut flow = self.flow();
        flow.queue(self.is_metadata).clear();
        flow.room[usize::from(self.is_metadata)] = 0;
        if self.is_metadata || flow.assembler.take().is_none() {
            return;
        }
        drop(flow);
        // Off: the alternate setting without bandwidth (bulk: the same request halts nothing). It cannot be refused here.
        let index = u16::from(self.stream.interface);
        let _ = self.ask(Setup { request_type: 0x01, request: 0x0b, value: 0, index, length: 0 }, &[]);
    }

    fn control(&self, _id: u32) -> Result<i64, TransportError> {
        Err(self.failed("read a control"))
    }

    fn set_control(&mut self, _id: u32, _value: i64) -> Result<(), TransportError> {
        Err(self.failed("set a control"))
    }

    fn extension_get(&mut self, unit: u8, selector: u8, data: &mut [u8]) -> Result<(), TransportError> {
        self.check_length(unit, selector, data.len())?;
        let came = self.ask(self.extension(unit, selector, GET_CUR, data.len())?, &[])?;
        if came.len() != data.len() {
            return Err(self.failed("ask its extension unit (its answer is short)"));
        }
        data.copy_from_slice(&came);
        Ok(())
    }

    fn extension_set(&mut self, unit: u8, selector: u8, data: &[u8]) -> Result<(), TransportError> {
        self.check_length(unit, selector, data.len())?;
        self.ask(self.extension(unit, selector, SET_CUR, data.len())?, data).map(drop)
    }
}

impl Drop for SimulatedNode {
    fn drop(&mut self) {
        self.stop();
    }
}
