//! A coupler's end that sends a bad message in the first step: a wrong one, or one that is damaged where it lies in
//! shared memory, which no honest sender could make.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;

use protocol::header::{Header, Kind};
use protocol::link::{Expect, Item, Link, LinkError};
use protocol::names::RunNames;
use protocol::shm::SHM_DIR;

/// What is done to a message, its header and its values.
type Change = fn(&mut Header, &mut Vec<f64>);

/// A message that must be refused.
pub(super) struct Forgery {
    /// What the program must do.
    pub(super) what: &'static str,
    /// How the message differs from a good one when it is sent.
    forge: Change,
    /// How it is damaged afterwards.
    damage: Change,
    /// What the program must have said; nothing in particular if empty.
    pub(super) words: &'static str,
}

const NOTHING: Change = |_, _| ();

/// All of them.
pub(super) const FORGERIES: [Forgery; 6] = [
    Forgery {
        what: "refuses the message of another step, saying so",
        forge: |header, _| header.step += 6,
        damage: NOTHING,
        words: "found 7",
    },
    Forgery {
        what: "refuses a message of another kind, saying so",
        forge: |header, _| header.kind = Kind::Fin as u32,
        damage: NOTHING,
        words: "found 8",
    },
    Forgery {
        what: "refuses a message of another protocol version, saying so",
        forge: |header, _| header.protocol_version = 77,
        damage: NOTHING,
        words: "found 77",
    },
    Forgery {
        what: "refuses a message that is too short, saying so",
        forge: |_, values| values.truncate(values.len() - 1),
        damage: NOTHING,
        words: "found",
    },
    Forgery {
        what: "refuses a message whose checksum is wrong",
        forge: NOTHING,
        damage: |header, _| header.checksum ^= 1,
        words: "",
    },
    Forgery {
        what: "refuses a message with a value that is not finite",
        forge: NOTHING,
        damage: |header, values| {
            let middle = values.len() / 2;
            values[middle] = f64::NAN;
            header.checksum = u64::from(f64::checksum(values));
        },
        words: "",
    },
];

/// The forger's end of the data link. It shakes hands honestly.
pub(super) struct Forger<'a> {
    pub(super) link: Box<dyn Link<f64>>,
    pub(super) names: &'a RunNames,
    pub(super) forgery: &'a Forgery,
}

impl Link<f64> for Forger<'_> {
    fn peer(&self) -> &str {
        self.link.peer()
    }

    fn send(
        &mut self,
        mut header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [f64]),
    ) -> Result<(), LinkError> {
        if header.step == 0 {
            return self.link.send(header, count, fill);
        }
        let mut values = vec![0.0; count];
        fill(&mut values);
        (self.forgery.forge)(&mut header, &mut values);
        self.link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))?;
        (header.count, header.checksum) = (values.len() as u64, u64::from(f64::checksum(&values)));
        let sent = [header_bytes(&header), value_bytes(&values)];
        (self.forgery.damage)(&mut header, &mut values);
        let damaged = [header_bytes(&header), value_bytes(&values)];
        let failed = |what| LinkError::Transport { peer: self.link.peer().to_owned(), what };
        if sent == damaged {
            return Ok(());
        }
        match overwrite(self.names, &sent, &damaged) {
            Ok(true) => Ok(()),
            Ok(false) => Err(failed(format!("the message to damage is not found in {SHM_DIR}"))),
            Err(error) => Err(failed(error.to_string())),
        }
    }

    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[f64])) -> Result<(), LinkError> {
        self.link.receive(expect, read)
    }
}

/// A header as it lies in memory.
fn header_bytes(header: &Header) -> Vec<u8> {
    let Header { magic, protocol_version, kind, step, count, time, dt, checksum } = *header;
    let mut bytes = magic.to_le_bytes().to_vec();
    bytes.extend([protocol_version, kind].map(u32::to_le_bytes).as_flattened());
    bytes.extend([step, count, time.to_bits(), dt.to_bits(), checksum].map(u64::to_le_bytes).as_flattened());
    bytes
}

fn value_bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Replaces header and values where they lie, one behind the other, in the run's shared memory; whether they were found.
fn overwrite(names: &RunNames, old: &[Vec<u8>; 2], new: &[Vec<u8>; 2]) -> io::Result<bool> {
    for entry in fs::read_dir(SHM_DIR)?.flatten() {
        if !entry.file_name().to_string_lossy().starts_with(names.prefix()) {
            continue;
        }
        let memory = fs::read(entry.path())?;
        let Some(header) = find(&memory, &old[0], 0) else { continue };
        let Some(values) = find(&memory, &old[1], header + old[0].len()) else { continue };
        let file: File = OpenOptions::new().write(true).open(entry.path())?;
        file.write_all_at(&new[0], header as u64)?;
        file.write_all_at(&new[1], values as u64)?;
        return Ok(true);
    }
    Ok(false)
}

/// Where `wanted` begins in `memory`, from `start` on; both lie on multiples of eight bytes.
fn find(memory: &[u8], wanted: &[u8], start: usize) -> Option<usize> {
    let places = (start.next_multiple_of(8)..=memory.len().checked_sub(wanted.len())?).step_by(8);
    places.into_iter().find(|&at| memory[at..].starts_with(wanted))
}
