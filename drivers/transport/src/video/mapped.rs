//! Buffers that the kernel fills, mapped into this process. `v4l`'s own stream gives a buffer back only when the next
//! one is asked for and cannot be asked again after a time limit; this one copies and gives back at once.
//!
//! Invariants that the SAFETY lines name:
//!
//! - *described*: each structure is of the type that its request was defined with, zeroed, and outlives the call;
//! - *mapped*: a pointer of `maps` is the start of a mapping of its length that only `drop` ends, and the kernel leaves
//!   a buffer alone between dequeuing and queuing it.
#![allow(unsafe_code)]

use std::{
    ffi::c_void,
    io, mem, ptr, slice,
    sync::Arc,
    time::{Duration, Instant},
};

use v4l::{
    device::Handle,
    v4l_sys::{v4l2_buffer, v4l2_requestbuffers},
    v4l2::{self, vidioc},
};

use super::node::VideoBuffer;

/// V4L2_MEMORY_MMAP, V4L2_BUF_FLAG_ERROR (`linux/videodev2.h`).
const MEMORY_MMAP: u32 = 1;
const FLAG_ERROR: u32 = 0x40;
/// PROT_READ, MAP_SHARED, POLLIN of Linux.
const PROT_READ: i32 = 1;
const MAP_SHARED: i32 = 1;
const POLLIN: i16 = 1;

/// A stream of one node, running.
pub(super) struct Mapped {
    handle: Arc<Handle>,
    kind: u32,
    maps: Vec<(*mut c_void, usize)>,
}

// SAFETY: *mapped*: the pointers are only used through `&mut self`, and a mapping belongs to no thread.
unsafe impl Send for Mapped {}

impl Mapped {
    /// Maps `count` buffers of `kind` (V4L2_BUF_TYPE_*), queues them and starts the stream.
    pub(super) fn start(handle: Arc<Handle>, kind: u32, count: u32) -> io::Result<Self> {
        let mut stream = Self { handle, kind, maps: Vec::new() };
        let given = stream.request(count)?;
        for index in 0..given {
            let mut buffer = stream.buffer(index);
            stream.call(vidioc::VIDIOC_QUERYBUF, &mut buffer)?;
            // SAFETY: *described*: `offset` is the member that QUERYBUF fills for mapped memory.
            let offset = i64::from(unsafe { buffer.m.offset });
            let length = buffer.length as usize;
            // SAFETY: a new mapping at an address of the kernel's choice touches no memory of ours.
            let map = unsafe { v4l2::mmap(ptr::null_mut(), length, PROT_READ, MAP_SHARED, stream.handle.fd(), offset) };
            stream.maps.push((map?, length));
            stream.call(vidioc::VIDIOC_QBUF, &mut stream.buffer(index))?;
        }
        stream.call(vidioc::VIDIOC_STREAMON, &mut kind.clone())?;
        Ok(stream)
    }

    /// The next full buffer, copied; its memory is the kernel's again. One that the driver flags as damaged is passed over:
    /// `uvcvideo` gives such pictures where its parameter `nodrop` is set, as newer kernels do by default.
    pub(super) fn next(&mut self, limit: Duration) -> io::Result<VideoBuffer> {
        let start = Instant::now();
        loop {
            let left = limit.saturating_sub(start.elapsed());
            let milliseconds = i32::try_from(left.as_millis()).unwrap_or(i32::MAX);
            match self.handle.poll(POLLIN, milliseconds) {
                Ok(0) => return Err(io::ErrorKind::TimedOut.into()),
                // A signal (Ctrl-C is one) does not end the stream.
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                ready => ready?,
            };
            if let Some(buffer) = self.take()? {
                return Ok(buffer);
            }
        }
    }

    /// Takes a buffer that is full; `None` where it is damaged.
    fn take(&mut self) -> io::Result<Option<VideoBuffer>> {
        let mut buffer = self.buffer(0);
        self.call(vidioc::VIDIOC_DQBUF, &mut buffer)?;
        let (map, length) = *self.maps.get(buffer.index as usize).ok_or(io::ErrorKind::InvalidData)?;
        let is_damaged = buffer.flags & FLAG_ERROR != 0;
        let used = if is_damaged { 0 } else { length.min(buffer.bytesused as usize) };
        // SAFETY: *mapped*: `used` bytes from the start of a mapping, of a buffer that is dequeued.
        let bytes = unsafe { slice::from_raw_parts(map.cast::<u8>(), used) }.to_vec();
        self.call(vidioc::VIDIOC_QBUF, &mut self.buffer(buffer.index))?;
        let time_ns = buffer.timestamp.tv_sec * 1_000_000_000 + buffer.timestamp.tv_usec * 1000;
        Ok((!is_damaged).then_some(VideoBuffer { bytes, sequence: buffer.sequence, time_ns }))
    }

    fn request(&self, count: u32) -> io::Result<u32> {
        // SAFETY: *described*: a structure of numbers, for which zero is a value.
        let zeroed: v4l2_requestbuffers = unsafe { mem::zeroed() };
        let mut request = v4l2_requestbuffers { count, type_: self.kind, memory: MEMORY_MMAP, ..zeroed };
        self.call(vidioc::VIDIOC_REQBUFS, &mut request)?;
        Ok(request.count)
    }

    fn buffer(&self, index: u32) -> v4l2_buffer {
        // SAFETY: *described*: a structure of numbers and unions of numbers and null pointers.
        let zeroed: v4l2_buffer = unsafe { mem::zeroed() };
        v4l2_buffer { index, type_: self.kind, memory: MEMORY_MMAP, ..zeroed }
    }

    fn call<T>(&self, request: vidioc::_IOC_TYPE, argument: &mut T) -> io::Result<()> {
        // SAFETY: *described*.
        unsafe { v4l2::ioctl(self.handle.fd(), request, ptr::from_mut(argument).cast()) }
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // A node that was unplugged refuses all of this, and its memory goes with the mapping.
        let _ = self.call(vidioc::VIDIOC_STREAMOFF, &mut self.kind.clone());
        for (map, length) in self.maps.drain(..) {
            // SAFETY: *mapped*: this is the one place that ends it.
            let _ = unsafe { v4l2::munmap(map, length) };
        }
        let _ = self.request(0);
    }
}
