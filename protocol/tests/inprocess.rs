//! The in-process transport: the same promises as between processes.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::thread;
use std::time::Duration;

use common::{Echoed, echo, receive, send, timed};
use protocol::PROTOCOL_VERSION;
use protocol::header::{Header, Kind};
use protocol::inprocess::Hub;
use protocol::link::{Expect, Link, LinkError, Transport};

const LONG: Duration = Duration::from_secs(60);
const SHORT: Duration = Duration::from_millis(300);

/// Both ends of one data link, `fluid` first.
fn pair(hub: &Hub) -> (Box<dyn Link<f64>>, std::sync::mpsc::Sender<()>, thread::JoinHandle<()>) {
    let (mut here, mut there) = (hub.transport("fluid"), hub.transport("coupler"));
    let (release, released) = std::sync::mpsc::channel();
    let peer = thread::spawn(move || {
        let link = there.connect("fluid", 8).unwrap();
        released.recv().unwrap_or_default();
        drop(link);
    });
    (here.connect("coupler", 8).unwrap(), release, peer)
}

#[test]
fn any_slice_arrives_bit_for_bit() {
    let hub = Hub::new(LONG);
    let mut there = hub.transport("coupler");
    let peer = thread::spawn(move || echo(&mut there, "fluid"));
    let mut echoed = Echoed::new(&mut hub.transport("fluid"), "coupler");
    common::any_slice_survives(&mut echoed);
    echoed.end();
    peer.join().unwrap().unwrap();
}

#[test]
fn control_works_both_ways() {
    let hub = Hub::new(LONG);
    let mut there = hub.transport("fluid");
    let peer = thread::spawn(move || {
        let mut control = there.control().unwrap();
        control
            .receive(Expect { kind: Kind::Order, step: 1, count: Some(3) }, &mut |_, bytes| {
                assert_eq!(bytes, b"act")
            })
            .unwrap();
        control
            .send(Header::new(Kind::Reply, 1, 0.0, 0.0), 4, &mut |target| target.copy_from_slice(b"done"))
            .unwrap();
    });
    let mut control = hub.control("fluid");
    assert_eq!(control.peer(), "fluid");
    control
        .send(Header::new(Kind::Order, 1, 0.0, 0.0), 3, &mut |target| target.copy_from_slice(b"act"))
        .unwrap();
    let mut answer = Vec::new();
    let expect = Expect { kind: Kind::Reply, step: 1, count: None };
    control.receive(expect, &mut |_, bytes| answer.extend_from_slice(bytes)).unwrap();
    assert_eq!(answer, b"done");
    peer.join().unwrap();
}

#[test]
fn another_version_or_count_is_refused() {
    let hub = Hub::new(LONG);
    let mut there = hub.transport("coupler");
    let peer = thread::spawn(move || {
        let mut link = there.connect("fluid", 8).unwrap();
        let foreign =
            Header { protocol_version: PROTOCOL_VERSION + 1, ..Header::new(Kind::Load, 1, 0.0, 0.0) };
        link.send(foreign, 2, &mut |_| ()).unwrap();
        send(&mut *link, Kind::Load, 2, 0.0, &[1.0, 2.0]).unwrap();
    });
    let mut link = hub.transport("fluid").connect("coupler", 8).unwrap();
    let coupler = "coupler".to_owned();
    let version =
        LinkError::Version { peer: coupler.clone(), expected: PROTOCOL_VERSION, found: PROTOCOL_VERSION + 1 };
    assert_eq!(receive(&mut *link, 1, 2), Err(version));
    assert_eq!(receive(&mut *link, 2, 3), Err(LinkError::Count { peer: coupler, expected: 3, found: 2 }));
    peer.join().unwrap();
}

#[test]
fn abort_wakes_a_waiter() {
    let hub = Hub::new(LONG);
    let (mut link, release, peer) = pair(&hub);
    let caller = hub.clone();
    let abort = thread::spawn(move || {
        thread::sleep(Duration::from_millis(100));
        caller.abort();
    });
    let (result, waited) = timed(|| receive(&mut *link, 1, 1));
    assert_eq!(result, Err(LinkError::Aborted));
    assert!(waited < Duration::from_secs(1), "{waited:?}");
    assert_eq!(send(&mut *link, Kind::Load, 1, 0.0, &[1.0]), Err(LinkError::Aborted));
    drop(release);
    abort.join().unwrap();
    peer.join().unwrap();
}

#[test]
fn silence_and_a_full_channel_end_by_the_time_out() {
    let hub = Hub::new(SHORT);
    let (mut link, release, peer) = pair(&hub);
    let (silent, waited) = timed(|| receive(&mut *link, 1, 1));
    assert!(matches!(&silent, Err(LinkError::PeerSilent { peer, .. }) if peer == "coupler"), "{silent:?}");
    assert!(waited >= SHORT);
    for step in 1..=2 {
        send(&mut *link, Kind::Load, step, 0.0, &[1.0]).unwrap();
    }
    assert!(matches!(send(&mut *link, Kind::Load, 3, 0.0, &[1.0]), Err(LinkError::PeerSilent { .. })));
    drop(release);
    peer.join().unwrap();
    let nobody = LinkError::NoReceiver { peer: "coupler".to_owned() };
    assert_eq!(send(&mut *link, Kind::Load, 3, 0.0, &[1.0]), Err(nobody));
}

#[test]
fn what_cannot_be_sent_is_refused() {
    let hub = Hub::new(LONG);
    let (mut link, release, peer) = pair(&hub);
    let refused = send(&mut *link, Kind::Load, 1, 0.0, &[0.0; 9]);
    assert_eq!(refused, Err(LinkError::TooLarge { peer: "coupler".to_owned(), count: 9, capacity: 8 }));
    let refused = send(&mut *link, Kind::Load, 1, 0.0, &[0.0, f64::INFINITY]);
    assert_eq!(refused, Err(LinkError::NonFinite { peer: "coupler".to_owned(), index: 1 }));
    drop(release);
    peer.join().unwrap();
}

#[test]
fn a_peer_that_never_comes_is_silent() {
    let hub = Hub::new(SHORT);
    let never = hub.transport("fluid").connect("coupler", 8).map(|_| ());
    assert!(matches!(never, Err(LinkError::PeerSilent { .. })), "{never:?}");
}
