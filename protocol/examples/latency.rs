//! Round-trip time of a message between two processes: `cargo run --release -p protocol --example latency [values]`.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use protocol::header::{Header, Kind};
use protocol::ipc::IpcTransport;
use protocol::link::{Expect, Link, LinkError, Transport};
use protocol::names::{RunId, RunNames};
use protocol::sweep;

const ROUNDS: u64 = 20_000;
const WARM_UP: u64 = 1000;
const TIMEOUT: Duration = Duration::from_secs(10);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, count, prefix, root] = arguments.as_slice() {
        return Ok(echo(&RunNames::new(prefix, Path::new(root))?, count.parse()?)?);
    }
    let count = arguments.get(1).map_or(Ok(600), |word| word.parse())?;
    let names = RunNames::of(RunId::random()?);
    sweep::claim(&names)?;
    let mut child = Command::new(std::env::current_exe()?)
        .args([&count.to_string(), names.prefix(), &names.root().to_string_lossy()])
        .spawn()?;
    let times = measure(&names, count)?;
    child.wait()?;
    sweep::remove_run(&names);
    let micros = |share: f64| times[(share * (times.len() - 1) as f64) as usize].as_secs_f64() * 1.0e6;
    println!(
        "{count} values, {ROUNDS} round trips: median {:.1}, 90 % {:.1}, 99 % {:.1} microseconds",
        micros(0.5),
        micros(0.9),
        micros(0.99)
    );
    Ok(())
}

/// Sorted times of a message there and back.
fn measure(names: &RunNames, count: usize) -> Result<Vec<Duration>, LinkError> {
    let mut link = IpcTransport::new(names, "here", TIMEOUT)?.connect("there", count)?;
    let mut times = Vec::new();
    for step in 0..WARM_UP + ROUNDS {
        let start = Instant::now();
        send(&mut *link, step, count)?;
        receive(&mut *link, step, count)?;
        times.push(start.elapsed());
    }
    let mut times = times.split_off(WARM_UP as usize);
    times.sort_unstable();
    Ok(times)
}

fn echo(names: &RunNames, count: usize) -> Result<(), LinkError> {
    let mut link = IpcTransport::new(names, "there", TIMEOUT)?.connect("here", count)?;
    for step in 0..WARM_UP + ROUNDS {
        receive(&mut *link, step, count)?;
        send(&mut *link, step, count)?;
    }
    Ok(())
}

fn send(link: &mut dyn Link<f64>, step: u64, count: usize) -> Result<(), LinkError> {
    link.send(Header::new(Kind::Load, step, 0.0, 0.0), count, &mut |values| values.fill(1.0))
}

fn receive(link: &mut dyn Link<f64>, step: u64, count: usize) -> Result<(), LinkError> {
    link.receive(Expect { kind: Kind::Load, step, count: Some(count) }, &mut |_, _| ())
}
