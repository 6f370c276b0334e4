//! What the tests of both transports share.

use std::time::{Duration, Instant};

use protocol::header::{Header, Kind};
use protocol::link::{Expect, Link, LinkError, Transport};

/// Largest message of the tests, values.
pub(crate) const CAPACITY: usize = 5000;

/// Time that ends an echo.
const LAST: f64 = -1.0;

/// Sends what it receives back to `peer`, bit for bit, until the last message.
pub(crate) fn echo(transport: &mut dyn Transport, peer: &str) -> Result<(), LinkError> {
    let mut link = transport.connect(peer, CAPACITY)?;
    let mut values = Vec::new();
    for step in 1.. {
        let mut received = Header::default();
        link.receive(Expect { kind: Kind::Load, step, count: None }, &mut |header, items| {
            values.clear();
            values.extend_from_slice(items);
            received = *header;
        })?;
        send(&mut *link, Kind::Motion, step, received.time, &values)?;
        if received.time == LAST {
            break;
        }
    }
    Ok(())
}

/// The other end of [`echo`].
pub(crate) struct Echoed {
    link: Box<dyn Link<f64>>,
    step: u64,
}

impl Echoed {
    pub(crate) fn new(transport: &mut dyn Transport, peer: &str) -> Self {
        Self { link: transport.connect(peer, CAPACITY).unwrap(), step: 0 }
    }

    /// The values after their journey there and back.
    pub(crate) fn journey(&mut self, values: &[f64]) -> Vec<f64> {
        self.journey_at(0.25, values)
    }

    pub(crate) fn end(&mut self) {
        self.journey_at(LAST, &[]);
    }

    fn journey_at(&mut self, time: f64, values: &[f64]) -> Vec<f64> {
        self.step += 1;
        send(&mut *self.link, Kind::Load, self.step, time, values).unwrap();
        let mut back = Vec::new();
        let expect = Expect { kind: Kind::Motion, step: self.step, count: Some(values.len()) };
        let mut read = |header: &Header, items: &[f64]| {
            assert_eq!((header.time, header.step, header.count), (time, self.step, values.len() as u64));
            back.extend_from_slice(items);
        };
        self.link.receive(expect, &mut read).unwrap();
        back
    }
}

/// Sends `values` as they are.
pub(crate) fn send(
    link: &mut dyn Link<f64>,
    kind: Kind,
    step: u64,
    time: f64,
    values: &[f64],
) -> Result<(), LinkError> {
    let header = Header::new(kind, step, time, 1.0e-4);
    link.send(header, values.len(), &mut |target| target.copy_from_slice(values))
}

/// Receives a load of `count` values at `step`.
pub(crate) fn receive(link: &mut dyn Link<f64>, step: u64, count: usize) -> Result<(), LinkError> {
    link.receive(Expect { kind: Kind::Load, step, count: Some(count) }, &mut |_, _| ())
}

/// Bits instead of numbers, so that -0.0 and 0.0 differ.
pub(crate) fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// 200 slices of any finite numbers, 0 to 4096 of them, survive the journey bit for bit.
pub(crate) fn any_slice_survives(echoed: &mut Echoed) {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    use proptest::test_runner::{Config, TestRunner};
    let number = POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO;
    let slices = proptest::collection::vec(number, 0..=4096);
    let mut runner = TestRunner::new(Config { failure_persistence: None, ..Config::with_cases(200) });
    let echoed = std::cell::RefCell::new(echoed);
    let test = |values: Vec<f64>| {
        proptest::prop_assert_eq!(bits(&echoed.borrow_mut().journey(&values)), bits(&values));
        Ok(())
    };
    runner.run(&slices, test).unwrap();
}

/// What `work` gives, and how long it took.
pub(crate) fn timed<R>(work: impl FnOnce() -> R) -> (R, Duration) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed())
}
