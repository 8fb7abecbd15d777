//! The camera's commands: a request goes out by one control request, its answer is fetched by another.

use std::collections::BTreeMap;

use toile_driver_transport::simulated::Answer;

use super::{
    CommandFault, Optics,
    optics::{CONST_SHIFT, EMITTER_CM, PIXEL, REFERENCE, TOLD_COLOR_CM},
};

/// Registers and the answer that waits.
#[derive(Default)]
pub(super) struct Commands {
    registers: BTreeMap<u16, u16>,
    answer: Vec<u8>,
    empty_answers: u32,
    pub(super) fault: Option<CommandFault>,
}

impl Commands {
    /// A register's value; 0 where it was never written.
    pub(super) fn register(&self, number: u16) -> u16 {
        self.registers.get(&number).copied().unwrap_or(0)
    }

    /// Takes a request: "GM", length in words, command, tag, then words (libfreenect `src/flags.c`).
    pub(super) fn take(&mut self, bytes: &[u8], optics: &Optics) -> Answer {
        match self.fault {
            Some(CommandFault::Stall) => return Answer::Stall,
            Some(CommandFault::Silence) => return Answer::Silence,
            Some(CommandFault::Slow(times)) => self.empty_answers = times,
            _ => {}
        }
        let word = |i: usize| bytes.get(2 * i..2 * i + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
        let is_request = bytes.len() >= 8 && bytes[..2] == *b"GM" && bytes.len() == 8 + 2 * usize::from(word(1));
        if !is_request {
            return Answer::Stall;
        }
        let (command, tag) = (word(2), word(3));
        let data = match command {
            0x02 => [word(4), self.register(word(4))].map(u16::to_le_bytes).concat(),
            0x03 => {
                self.registers.insert(word(4), word(5));
                vec![0, 0]
            }
            0x04 => fixed_parameters(),
            0x16 => algorithm_parameters(word(4), optics),
            0x95 => [1, word(5), word(6)].map(u16::to_le_bytes).concat(),
            _ => vec![0xff, 0xff],
        };
        self.answer = self.framed(command, tag, data);
        Answer::Data(Vec::new())
    }

    /// The answer that waits; empty where there is none yet.
    pub(super) fn give(&mut self, room: usize) -> Answer {
        if self.empty_answers > 0 {
            self.empty_answers -= 1;
            return Answer::Data(Vec::new());
        }
        let mut answer = std::mem::take(&mut self.answer);
        answer.truncate(room);
        Answer::Data(answer)
    }

    fn framed(&self, command: u16, tag: u16, mut data: Vec<u8>) -> Vec<u8> {
        let (mut magic, mut command, mut tag, mut words) = (*b"RB", command, tag, (data.len() / 2) as u16);
        match self.fault {
            Some(CommandFault::BadMagic) => magic = *b"XX",
            Some(CommandFault::BadTag) => tag = tag.wrapping_add(1),
            Some(CommandFault::BadCommand) => command ^= 0x40,
            Some(CommandFault::BadLength) => words += 7,
            Some(CommandFault::Short) => {
                data.truncate(data.len() / 4 * 2);
                words = (data.len() / 2) as u16;
            }
            Some(CommandFault::Nonsense) => return vec![0xff; 8 + data.len()],
            _ => {}
        }
        let header = [words, command, tag].map(u16::to_le_bytes);
        [&magic[..], header.as_flattened(), &data].concat()
    }
}

/// 322 bytes, the zero plane at 94 (libfreenect `src/cameras.c`, `freenect_fetch_zero_plane_info`).
fn fixed_parameters() -> Vec<u8> {
    let mut data = vec![0; 322];
    let plane = [EMITTER_CM, TOLD_COLOR_CM, REFERENCE, PIXEL].map(f32::to_le_bytes);
    data[94..110].copy_from_slice(plane.as_flattened());
    data
}

/// Registration, padding and constant shift, each after two bytes of status.
fn algorithm_parameters(which: u16, optics: &Optics) -> Vec<u8> {
    let mut data = vec![0, 0];
    match which {
        0x40 => data.extend(optics.registration().map(i32::to_le_bytes).as_flattened()),
        0x41 => data.extend([0u16, 0, 0].map(u16::to_le_bytes).as_flattened()),
        0x00 => data.extend(CONST_SHIFT.to_le_bytes()),
        _ => {}
    }
    data
}
