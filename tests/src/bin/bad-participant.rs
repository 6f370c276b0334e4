//! A solid that does not fit the run, for the tests of the handshake. It answers `--check` as `solid-rigid` does; then
//! it behaves as the environment variable `TIDEWALL_TEST_FLAW` says:
//!
//! - `version`: it was built with a later protocol version, which its data messages carry and expect;
//! - `check-version`: the same, and its answer to `--check` says so;
//! - `forgets`: its answer to `--check` says that it keeps no state;
//! - `size`: it has made another surface than it has planned.

use std::process::ExitCode;

use protocol::PROTOCOL_VERSION;
use protocol::case::CaseFile;
use protocol::control::{Account, Part, Ready, Start, StepReport, StepTime};
use protocol::failure::Failure;
use protocol::header::Header;
use protocol::link::{Expect, Link, LinkError, Transport};
use protocol::participant::{Participant, Program, main as participant_main};
use solid_fem::rigid;

const LATER: u32 = PROTOCOL_VERSION + 1;

fn main() -> ExitCode {
    participant_main(Program {
        name: "bad-participant",
        about: "A solid that does not fit the run",
        check: |case| {
            let mut report = rigid::check(case);
            if flaw() == "check-version" {
                report.protocol_version = LATER;
            }
            report.keeps_state &= flaw() != "forgets";
            report
        },
        build: |case, context| {
            let finer = CaseFile::parse(case.path(), case.text(), &["solid.elements=[1, 9]".to_owned()]);
            let case = if flaw() == "size" { &finer } else { case };
            Ok(Box::new(Misfit(rigid::RigidSolid::new(case, context)?)))
        },
        ..rigid::PROGRAM
    })
}

fn flaw() -> String {
    std::env::var("TIDEWALL_TEST_FLAW").unwrap_or_default()
}

struct Misfit(rigid::RigidSolid);

impl Participant for Misfit {
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure> {
        match flaw().as_str() {
            "version" => self.0.start(start, &mut LaterTransport(transport)),
            _ => self.0.start(start, transport),
        }
    }

    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        self.0.part(part, at)
    }

    fn output(&mut self, frame: u32, at: StepTime) -> Result<(), Failure> {
        self.0.output(frame, at)
    }

    fn account(&self) -> Account {
        self.0.account()
    }
}

/// Data links as a program of a later version would make them.
struct LaterTransport<'t>(&'t mut dyn Transport);

impl Transport for LaterTransport<'_> {
    fn control(&mut self) -> Result<Box<dyn Link<u8>>, LinkError> {
        self.0.control()
    }

    fn connect(&mut self, peer: &str, send_capacity: usize) -> Result<Box<dyn Link<f64>>, LinkError> {
        Ok(Box::new(LaterLink(self.0.connect(peer, send_capacity)?)))
    }
}

struct LaterLink(Box<dyn Link<f64>>);

impl Link<f64> for LaterLink {
    fn peer(&self) -> &str {
        self.0.peer()
    }

    fn send(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [f64]),
    ) -> Result<(), LinkError> {
        self.0.send(Header { protocol_version: LATER, ..header }, count, fill)
    }

    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[f64])) -> Result<(), LinkError> {
        let mut found = LATER;
        self.0.receive(expect, &mut |header, values| {
            found = header.protocol_version;
            read(header, values);
        })?;
        match found {
            LATER => Ok(()),
            found => Err(LinkError::Version { peer: self.0.peer().to_owned(), expected: LATER, found }),
        }
    }
}
