//! The header every message carries beside its payload.

use crate::PROTOCOL_VERSION;

/// First word of every message: "TIDEWALL" in ASCII.
pub const MAGIC: u64 = u64::from_be_bytes(*b"TIDEWALL");

/// What a message holds. The number travels in [`Header::kind`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// Launcher to participant: one encoded [`crate::control::Order`].
    Order = 1,
    /// Participant to launcher: one encoded [`crate::control::Reply`].
    Reply = 2,
    /// Handshake of a data link: one encoded [`crate::interface::Contract`].
    Contract = 3,
    /// Handshake of a data link: one encoded [`crate::interface::Surface`] (solid to coupler).
    Surface = 4,
    /// Handshake of a data link: one encoded [`crate::interface::BodyMesh`] (coupler to fluid).
    BodyMesh = 5,
    /// Motion of the interface over one step.
    Motion = 6,
    /// Load on the interface at one step.
    Load = 7,
    /// Nothing more will come.
    Fin = 8,
    /// Handshake of a data link: one encoded [`crate::interface::Points`] (fluid to coupler).
    Points = 9,
    /// Handshake of a data link: one encoded [`crate::interface::PointWall`] (coupler to fluid).
    PointWall = 10,
}

/// User header of every sample, in shared memory as it stands here.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Header {
    /// [`MAGIC`].
    pub magic: u64,
    /// [`PROTOCOL_VERSION`] of the sender.
    pub protocol_version: u32,
    /// A [`Kind`] as number.
    pub kind: u32,
    /// Coupling step the message belongs to; 0 in the handshake.
    pub step: u64,
    /// Number of payload items.
    pub count: u64,
    /// Simulated time at the end of the step, s.
    pub time: f64,
    /// Length of the step, s.
    pub dt: f64,
    /// CRC-32 of the payload bytes.
    pub checksum: u64,
}

impl Header {
    /// A header of this program's version; count and checksum are filled in by the link that sends it.
    pub fn new(kind: Kind, step: u64, time: f64, dt: f64) -> Self {
        let kind = kind as u32;
        Self { magic: MAGIC, protocol_version: PROTOCOL_VERSION, kind, step, count: 0, time, dt, checksum: 0 }
    }
}
