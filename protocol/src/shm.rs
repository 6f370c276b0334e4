//! Room in shared memory: what a run's channels need, and what `/dev/shm` has.
//!
//! Containers often give 64 MB, and writing past the end of a full `/dev/shm` is a SIGBUS, not an error. So the
//! need is computed and compared before any process starts.

use std::path::Path;

/// Where Linux keeps POSIX shared memory.
pub const SHM_DIR: &str = "/dev/shm";

/// Bytes a channel takes beside its payload: iceoryx2 0.10 keeps about five small files per direction, a page of
/// memory each, and reserves one aligned slot per item of a message. The files of the payload look many times larger
/// than they are: memory is taken when it is written to.
const CHANNEL_OVERHEAD: u64 = 64 * 1024;

/// Samples each channel keeps in memory.
pub(crate) const POOL: usize = 2;

/// Largest order or reply, bytes.
pub(crate) const CONTROL_CAPACITY: usize = 64 * 1024;

/// One direction between two processes, as far as memory goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelNeed {
    /// Largest message, bytes.
    pub message_bytes: u64,
}

/// The two directions of one control link.
pub fn control_needs() -> [ChannelNeed; 2] {
    [ChannelNeed { message_bytes: CONTROL_CAPACITY as u64 }; 2]
}

/// One direction of a data link with messages of up to `values` numbers.
pub fn data_need(values: usize) -> ChannelNeed {
    ChannelNeed { message_bytes: 8 * values as u64 }
}

/// `/dev/shm` has no room for the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the channels need {} kB of shared memory, {SHM_DIR} has {} kB free",
    needed.div_ceil(1024), free / 1024
)]
pub struct ShmError {
    /// Need of the run, bytes.
    pub needed: u64,
    /// Free bytes.
    pub free: u64,
}

/// Shared memory that channels with these messages need, bytes.
pub fn needed_bytes(channels: &[ChannelNeed]) -> u64 {
    let one = |channel: &ChannelNeed| {
        let chunk = channel.message_bytes.saturating_add(4096);
        chunk.saturating_mul(POOL as u64).saturating_add(CHANNEL_OVERHEAD)
    };
    channels.iter().map(one).fold(0, u64::saturating_add)
}

/// Free bytes of the file system that holds `path` for an ordinary user.
///
/// # Errors
/// What `statvfs` says.
pub fn free_bytes(path: &Path) -> std::io::Result<u64> {
    let found = rustix::fs::statvfs(path)?;
    Ok(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Refuses a run that `/dev/shm` has no room for; `free` is what [`free_bytes`] of [`SHM_DIR`] said.
///
/// # Errors
/// [`ShmError`] with need and room.
pub fn check_room(channels: &[ChannelNeed], free: u64) -> Result<u64, ShmError> {
    let needed = needed_bytes(channels);
    if needed <= free { Ok(needed) } else { Err(ShmError { needed, free }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_shared_memory_is_refused_with_both_numbers() {
        let channels = [ChannelNeed { message_bytes: 10 << 20 }; 4];
        let needed = needed_bytes(&channels);
        assert!((80 << 20..100 << 20).contains(&needed), "two samples each: {needed}");
        assert_eq!(check_room(&channels, needed), Ok(needed));
        let refused = check_room(&channels, 64 << 20).unwrap_err();
        assert_eq!(refused, ShmError { needed, free: 64 << 20 });
        assert!(refused.to_string().contains("has 65536 kB free"), "{refused}");
    }

    #[test]
    fn an_absurd_need_does_not_wrap_around() {
        assert_eq!(needed_bytes(&[ChannelNeed { message_bytes: u64::MAX }; 3]), u64::MAX);
    }

    #[test]
    fn this_machine_has_shared_memory() {
        assert!(free_bytes(Path::new(SHM_DIR)).unwrap() > 0);
    }
}
