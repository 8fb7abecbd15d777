//! The camera's commands: written to one bulk endpoint, answered with data and a completion on another (libfreenect2
//! `protocol/command.h`, `src/command_transaction.cpp`).

use std::collections::VecDeque;

use toile_driver_transport::simulated::Answer;

use super::{CommandFault, Optics};

/// Begins a command, and a completion.
const COMMAND_MAGIC: u32 = 0x0602_2009;
const COMPLETION_MAGIC: u32 = 0x0a6f_e000;

/// Answers that wait, and what was switched on.
#[derive(Default)]
pub(super) struct Commands {
    answers: VecDeque<Vec<u8>>,
    looks: u32,
    pub(super) streaming: bool,
    pub(super) fault: Option<CommandFault>,
    /// How often the streams were switched on.
    pub(super) starts: u32,
}

impl Commands {
    /// Takes a command: magic, number, room, code, 0, parameters.
    pub(super) fn take(&mut self, bytes: &[u8], optics: &Optics, serial: &str) -> Answer {
        match self.fault {
            Some(CommandFault::Stall) => return Answer::Stall,
            Some(CommandFault::Silence) => return Answer::Silence,
            _ => {}
        }
        let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let [COMMAND_MAGIC, sequence, room, code, 0, ref parameters @ ..] = words[..] else { return Answer::Stall };
        let parameter = parameters.first().copied().unwrap_or(0);
        let data = match (code, parameter) {
            (0x02, _) => firmware(),
            (0x22, 1) => serial.bytes().flat_map(|b| [b, 0]).chain([0; 2]).collect(),
            (0x22, 2) => Optics::stated_p0(),
            (0x22, 3) => optics.stated_depth(),
            (0x22, 4) => optics.stated_color(),
            (0x16, _) => self.status(),
            (0x2b, on) => {
                self.streaming = on == 1;
                self.starts += on;
                Vec::new()
            }
            (0x14, _) => vec![0; 0x5c],
            _ => Vec::new(),
        };
        self.queue(data, sequence, room as usize, code == 0x22 && parameter > 1);
        Answer::Data(Vec::new())
    }

    fn queue(&mut self, mut data: Vec<u8>, sequence: u32, room: usize, is_calibration: bool) {
        let (mut magic, mut sequence) = (COMPLETION_MAGIC, sequence);
        match self.fault {
            Some(CommandFault::BadMagic) => magic ^= 0xff,
            Some(CommandFault::BadSequence) => sequence = sequence.wrapping_add(1),
            Some(CommandFault::Premature) => data.clear(),
            Some(CommandFault::Short) => data.truncate(data.len() / 2),
            Some(CommandFault::Nonsense) => data.fill(0xff),
            Some(CommandFault::NonsenseCalibration) if is_calibration => data.fill(0xff),
            _ => {}
        }
        data.truncate(room);
        if !data.is_empty() {
            self.answers.push_back(data);
        }
        self.answers.push_back([magic, sequence, 0, 0].iter().flat_map(|word| word.to_le_bytes()).collect());
    }

    /// The next part of the answer that waits.
    pub(super) fn give(&mut self, room: usize) -> Answer {
        let Some(answer) = self.answers.front_mut() else { return Answer::Silence };
        let rest = answer.split_off(room.min(answer.len()));
        let part = std::mem::replace(answer, rest);
        if answer.is_empty() {
            self.answers.pop_front();
        }
        Answer::Data(part)
    }

    fn status(&mut self) -> Vec<u8> {
        self.looks += 1;
        let is_ready = match self.fault {
            Some(CommandFault::Slow(looks)) => self.looks > looks,
            _ => true,
        };
        u32::from(is_ready).to_le_bytes().to_vec()
    }
}

/// Seven entries of sixteen bytes; the fourth is the main firmware's.
fn firmware() -> Vec<u8> {
    let mut bytes = vec![0; 7 * 16];
    let version = [4 << 16 | 3, 3913, 0, 0].map(u32::to_le_bytes);
    bytes[48..64].copy_from_slice(version.as_flattened());
    bytes
}
