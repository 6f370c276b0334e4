//! The transport as the programs see it: one duplex connection to one peer.
//!
//! [`crate::ipc`] carries it over iceoryx2 shared memory between processes, [`crate::inprocess`] over plain memory
//! between threads; both give bit-identical results. MPI or TCP between hosts would be a third implementation.

use crate::failure::{Failure, FailureClass};
use crate::header::{Header, Kind};
use crate::interface::Contract;

/// Items a link can carry: plain numbers that are valid for any bit pattern.
pub trait Item: Copy + Default + Send + Sync + std::fmt::Debug + 'static {
    /// Checksum of the items seen as bytes, little-endian on every supported machine, and the index of the first that is
    /// no finite number: in one pass, as messages may be larger than the caches.
    fn inspect(items: &[Self]) -> (u32, Option<usize>);

    /// The checksum alone.
    fn checksum(items: &[Self]) -> u32 {
        Self::inspect(items).0
    }
}

impl Item for u8 {
    fn inspect(items: &[Self]) -> (u32, Option<usize>) {
        (crc32fast::hash(items), None)
    }
}

/// Values looked at in one go: their bytes stay in the innermost cache.
const BLOCK: usize = 512;

impl Item for f64 {
    fn inspect(items: &[Self]) -> (u32, Option<usize>) {
        let mut hasher = crc32fast::Hasher::new();
        let mut bytes = [[0; 8]; BLOCK];
        let mut bad = None;
        for (number, block) in items.chunks(BLOCK).enumerate() {
            let mut is_finite = true;
            for (target, value) in bytes.iter_mut().zip(block) {
                *target = value.to_le_bytes();
                is_finite &= value.is_finite();
            }
            hasher.update(bytes[..block.len()].as_flattened());
            if !is_finite && bad.is_none() {
                let within = block.iter().position(|value| !value.is_finite());
                bad = within.map(|within| number * BLOCK + within);
            }
        }
        (hasher.finalize(), bad)
    }
}

/// What the receiver insists on; anything else is refused with a [`LinkError`] that says expected and found.
#[derive(Debug, Clone, Copy)]
pub struct Expect {
    /// The message kind.
    pub kind: Kind,
    /// The coupling step.
    pub step: u64,
    /// Number of items, where it is known beforehand.
    pub count: Option<usize>,
}

/// One duplex, lossless, lock-step connection to one peer.
pub trait Link<T: Item> {
    /// Name of the process at the other end.
    fn peer(&self) -> &str;

    /// Sends one message of `count` items; `fill` writes them straight into the memory that is shared.
    ///
    /// # Errors
    /// [`LinkError::PeerSilent`] if the peer has not taken the previous message in time, [`LinkError::NoReceiver`],
    /// [`LinkError::NonFinite`], [`LinkError::TooLarge`], [`LinkError::Aborted`].
    fn send(&mut self, header: Header, count: usize, fill: &mut dyn FnMut(&mut [T]))
    -> Result<(), LinkError>;

    /// As [`Link::send`], but does not wake the receiver: it will find the message when the data it waits for anyway
    /// wakes it. One process woken less.
    ///
    /// # Errors
    /// As [`Link::send`].
    fn leave(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [T]),
    ) -> Result<(), LinkError> {
        self.send(header, count, fill)
    }

    /// Waits for the message `expect` names, checks it (magic, version, kind, step, count, checksum, finiteness)
    /// and lets `read` look at it in place.
    ///
    /// # Errors
    /// One variant of [`LinkError`] per check, [`LinkError::PeerSilent`] after the time-out, [`LinkError::Aborted`].
    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[T])) -> Result<(), LinkError>;
}

/// Why a message was not sent or not accepted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinkError {
    /// The time-out passed.
    #[error("no word from {peer} for {waited_s:.1} s (limit {limit_s:.1} s)")]
    PeerSilent {
        /// Process at the other end.
        peer: String,
        /// Time waited, s.
        waited_s: f64,
        /// The time-out, s.
        limit_s: f64,
    },
    /// A process is gone.
    #[error("{peer} {how}")]
    PeerLost {
        /// The process.
        peer: String,
        /// How it ended, as a predicate: "was killed by signal 9".
        how: String,
    },
    /// The launcher called the run off, or this process was asked to stop.
    #[error("the run was called off")]
    Aborted,
    /// A message was sent and nobody got it.
    #[error("nobody receives what is sent to {peer}")]
    NoReceiver {
        /// Process at the other end.
        peer: String,
    },
    /// The sender speaks another protocol version, or no Tidewall protocol at all.
    #[error("protocol version of {peer}: expected {expected}, found {found}")]
    Version {
        /// Process at the other end.
        peer: String,
        /// Own version.
        expected: u32,
        /// The peer's version (0 if the magic word is wrong).
        found: u32,
    },
    /// A message of another kind.
    #[error("message from {peer}: expected kind {expected}, found {found}")]
    Kind {
        /// Process at the other end.
        peer: String,
        /// Kind waited for.
        expected: u32,
        /// Kind received.
        found: u32,
    },
    /// A message of another step.
    #[error("message from {peer}: expected step {expected}, found {found}")]
    Step {
        /// Process at the other end.
        peer: String,
        /// Step waited for.
        expected: u64,
        /// Step received.
        found: u64,
    },
    /// A message of another size.
    #[error("message from {peer}: expected {expected} values, found {found}")]
    Count {
        /// Process at the other end.
        peer: String,
        /// Number of items waited for.
        expected: usize,
        /// Number of items received.
        found: usize,
    },
    /// The two ends of a data link are not made for the same run.
    #[error("interface of {peer}: expected {expected}; found {found}")]
    Contract {
        /// Process at the other end.
        peer: String,
        /// Own contract, in words.
        expected: String,
        /// The peer's.
        found: String,
    },
    /// The payload was damaged on its way.
    #[error("checksum of the message from {peer} is wrong")]
    Checksum {
        /// Process at the other end.
        peer: String,
    },
    /// A value that is no finite number, sent or received.
    #[error("value {index} exchanged with {peer} is not finite")]
    NonFinite {
        /// Process at the other end.
        peer: String,
        /// Index in the message.
        index: usize,
    },
    /// More items than the channel was made for.
    #[error("a message of {count} values to {peer} exceeds the channel's {capacity}")]
    TooLarge {
        /// Process at the other end.
        peer: String,
        /// Number of items.
        count: usize,
        /// Capacity agreed on in the handshake.
        capacity: usize,
    },
    /// A message that cannot be decoded.
    #[error("a message from {peer} cannot be decoded: {what}")]
    Garbled {
        /// Process at the other end.
        peer: String,
        /// What the decoder says.
        what: String,
    },
    /// The transport itself failed; `what` is its own word.
    #[error("channel to {peer}: {what}")]
    Transport {
        /// Process at the other end.
        peer: String,
        /// What the transport says.
        what: String,
    },
}

impl LinkError {
    /// The failure this error ends the run with: mismatches are refusals (exit 2), everything else a lost peer (exit 4).
    pub fn into_failure(self, process: &str, step: u64, time_s: f64, phase: &str) -> Failure {
        let class = match self {
            Self::Version { .. } | Self::Contract { .. } => FailureClass::Case,
            Self::NonFinite { .. } => FailureClass::Numerical,
            _ => FailureClass::Process,
        };
        Failure::new(class, process, phase, self.to_string()).at(step, time_s)
    }
}

/// Exchanges contracts over a new data link; unequal ones are refused by both ends, each saying expected and found.
///
/// # Errors
/// [`LinkError::Contract`], [`LinkError::Version`], or whatever the link says.
pub fn agree(link: &mut dyn Link<f64>, mine: &Contract) -> Result<(), LinkError> {
    let peer = link.peer().to_owned();
    let values = mine.encode();
    link.send(Header::new(Kind::Contract, 0, 0.0, 0.0), values.len(), &mut |out| {
        out.copy_from_slice(&values)
    })?;
    let expect = Expect { kind: Kind::Contract, step: 0, count: Some(values.len()) };
    let mut theirs = None;
    link.receive(expect, &mut |_, values| theirs = Some(Contract::decode(values, &peer)))?;
    let theirs = theirs.expect("a message that was received was read")?;
    if theirs == *mine {
        return Ok(());
    }
    Err(LinkError::Contract { peer, expected: mine.to_string(), found: theirs.to_string() })
}

/// How a participant reaches the others: over iceoryx2, or in one process in tests.
pub trait Transport {
    /// The control link to the launcher.
    ///
    /// # Errors
    /// [`LinkError::PeerSilent`] when the launcher has not made it in time, [`LinkError::Transport`].
    fn control(&mut self) -> Result<Box<dyn Link<u8>>, LinkError>;

    /// The data link to a peer; `send_capacity` is the number of values of the largest message this side sends.
    ///
    /// # Errors
    /// [`LinkError::PeerSilent`] when the peer does not come in time, [`LinkError::Transport`].
    fn connect(&mut self, peer: &str, send_capacity: usize) -> Result<Box<dyn Link<f64>>, LinkError>;

    /// The means to knock at the door of another process, which something will be sent to in a moment: by then it is awake.
    /// `None` where it takes no part in the run, or where waking costs nothing.
    fn knock(&mut self, _process: &str) -> Option<Knock> {
        None
    }
}

/// Wakes one process; nothing else follows from it, and nothing from its not being heard.
pub type Knock = Box<dyn Fn()>;
