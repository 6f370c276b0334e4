//! What every message is checked for, the same on every transport.

use std::time::Duration;

use crate::PROTOCOL_VERSION;
use crate::header::{Header, MAGIC};
use crate::link::{Expect, Item, LinkError};

/// A link that ends waits at most this long for its peer to read the last message.
pub(crate) const MAX_LINGER: Duration = Duration::from_secs(5);

/// Fills count and checksum into the header of a message about to leave.
///
/// # Errors
/// [`LinkError::NonFinite`]: nothing that is no number leaves a process.
pub(crate) fn seal<T: Item>(mut header: Header, items: &[T], peer: &str) -> Result<Header, LinkError> {
    let (checksum, bad) = T::inspect(items);
    if let Some(index) = bad {
        return Err(LinkError::NonFinite { peer: peer.to_owned(), index });
    }
    header.count = items.len() as u64;
    header.checksum = u64::from(checksum);
    Ok(header)
}

/// Refuses a message that is not the expected one: magic word and version first, as nothing else means anything
/// without them, then kind, step, count, checksum and finiteness.
pub(crate) fn verify<T: Item>(
    expect: Expect,
    header: &Header,
    items: &[T],
    peer: &str,
) -> Result<(), LinkError> {
    let peer = || peer.to_owned();
    if header.magic != MAGIC || header.protocol_version != PROTOCOL_VERSION {
        let found = if header.magic == MAGIC { header.protocol_version } else { 0 };
        return Err(LinkError::Version { peer: peer(), expected: PROTOCOL_VERSION, found });
    }
    let expected = expect.kind as u32;
    if header.kind != expected {
        return Err(LinkError::Kind { peer: peer(), expected, found: header.kind });
    }
    if header.step != expect.step {
        return Err(LinkError::Step { peer: peer(), expected: expect.step, found: header.step });
    }
    let expected = expect.count.unwrap_or(items.len());
    if items.len() != expected {
        return Err(LinkError::Count { peer: peer(), expected, found: items.len() });
    }
    if header.count != items.len() as u64 {
        let found = usize::try_from(header.count).unwrap_or(usize::MAX);
        return Err(LinkError::Count { peer: peer(), expected, found });
    }
    let (checksum, bad) = T::inspect(items);
    if header.checksum != u64::from(checksum) {
        return Err(LinkError::Checksum { peer: peer() });
    }
    match bad {
        Some(index) => Err(LinkError::NonFinite { peer: peer(), index }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::header::Kind;

    const EXPECT: Expect = Expect { kind: Kind::Load, step: 4, count: Some(3) };

    fn message() -> (Header, [f64; 3]) {
        let items = [1.5, -0.0, 3.0e-310];
        (seal(Header::new(Kind::Load, 4, 0.4, 0.1), &items, "fluid").unwrap(), items)
    }

    #[test]
    fn each_check_has_its_own_refusal() {
        let (good, items) = message();
        let refusal = |change: fn(&mut Header)| {
            let mut header = good;
            change(&mut header);
            verify(EXPECT, &header, &items, "fluid").unwrap_err()
        };
        verify(EXPECT, &good, &items, "fluid").unwrap();
        let peer = "fluid".to_owned();
        let version = LinkError::Version { peer: peer.clone(), expected: PROTOCOL_VERSION, found: 0 };
        assert_eq!(refusal(|header| header.magic += 1), version);
        let version = LinkError::Version { peer: peer.clone(), expected: PROTOCOL_VERSION, found: 77 };
        assert_eq!(refusal(|header| header.protocol_version = 77), version);
        let kind = LinkError::Kind { peer: peer.clone(), expected: 7, found: 6 };
        assert_eq!(refusal(|header| header.kind = Kind::Motion as u32), kind);
        let step = LinkError::Step { peer: peer.clone(), expected: 4, found: 5 };
        assert_eq!(refusal(|header| header.step = 5), step);
        let count = LinkError::Count { peer: peer.clone(), expected: 3, found: 1 << 40 };
        assert_eq!(refusal(|header| header.count = 1 << 40), count);
        assert_eq!(refusal(|header| header.checksum ^= 1), LinkError::Checksum { peer });
    }

    #[test]
    fn a_payload_of_another_size_is_refused() {
        let (header, items) = message();
        let refused = verify(EXPECT, &header, &items[..2], "fluid").unwrap_err();
        assert_eq!(refused, LinkError::Count { peer: "fluid".to_owned(), expected: 3, found: 2 });
    }

    #[test]
    fn what_is_no_number_neither_leaves_nor_arrives() {
        let items = [1.0, f64::NAN, 0.0];
        let refused = LinkError::NonFinite { peer: "fluid".to_owned(), index: 1 };
        let header = Header::new(Kind::Load, 4, 0.4, 0.1);
        assert_eq!(seal(header, &items, "fluid").unwrap_err(), refused);
        // In the second of the blocks a message is looked at in.
        let mut long = vec![0.0; 1000];
        (long[700], long[701]) = (f64::INFINITY, f64::NAN);
        assert_eq!(f64::inspect(&long).1, Some(700));
        let sealed = Header { count: 3, checksum: u64::from(f64::checksum(&items)), ..header };
        assert_eq!(verify(EXPECT, &sealed, &items, "fluid").unwrap_err(), refused);
    }
}
