//! The stream over the interface as a file, and a file in the place of one of the two sides.
//!
//! A recording is a line of text and then messages, one after the other, as little-endian words: kind, step, time s,
//! length of the step s, number of values, values. First the solid's surface, the fluid's points where it offers some, and
//! the solid's motion at the start, then for every step that stands the fluid's load and the solid's motion.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use protocol::control::StepTime;
use protocol::failure::{Failure, FailureClass};
use protocol::header::{Header, Kind};
use protocol::interface::{Points, Surface};
use protocol::link::{Expect, Link, LinkError};
use protocol::series::unwritable;

use crate::participant::NAME;

const MARK: &[u8] = b"tidewall interface 1\n";
/// File in the run folder.
pub const FILE: &str = "interface.rec";

/// Writes a recording.
pub struct Recorder {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Recorder {
    /// Begins `interface.rec` in the run folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path) -> Result<Self, Failure> {
        let path = folder.join(FILE);
        let begin = || {
            let mut file = BufWriter::new(File::create(&path)?);
            file.write_all(MARK)?;
            Ok(file)
        };
        let file = begin().map_err(|error| unwritable(&path, &error))?;
        Ok(Self { path, file })
    }

    /// Adds one message, given in blocks.
    ///
    /// # Errors
    /// The disk is full.
    pub fn write(&mut self, kind: Kind, at: StepTime, blocks: &[&[f64]]) -> Result<(), Failure> {
        let count: usize = blocks.iter().map(|block| block.len()).sum();
        let mut write = || -> std::io::Result<()> {
            self.file.write_all(&(kind as u64).to_le_bytes())?;
            self.file.write_all(&at.step.to_le_bytes())?;
            self.file.write_all(&at.time.to_le_bytes())?;
            self.file.write_all(&at.dt.to_le_bytes())?;
            self.file.write_all(&(count as u64).to_le_bytes())?;
            blocks.iter().copied().flatten().try_for_each(|value| self.file.write_all(&value.to_le_bytes()))
        };
        write().map_err(|error| unwritable(&self.path, &error))
    }

    /// Brings everything to the disk.
    ///
    /// # Errors
    /// The disk is full.
    pub fn flush(&mut self) -> Result<(), Failure> {
        self.file.flush().map_err(|error| unwritable(&self.path, &error))
    }
}

/// Kind, step, time, length of the step, number of values.
type Head = [[u8; 8]; 5];

/// One message of a recording.
#[derive(Debug, Clone, Default)]
struct Frame {
    time: f64,
    dt: f64,
    values: Vec<f64>,
}

/// The messages of one side of a recording, read as they are needed.
#[derive(Debug)]
pub struct Recording {
    file: BufReader<File>,
    kind: Kind,
    surface: Surface,
    points: Option<Points>,
    before: Frame,
    after: Frame,
}

impl Recording {
    /// Opens a recording to take the loads ([`Kind::Load`]) or the motions ([`Kind::Motion`]) from it.
    ///
    /// # Errors
    /// What is wrong with the file, in words.
    pub fn open(path: &Path, kind: Kind) -> Result<Self, String> {
        let say = |what: &str| format!("{} {what}", path.display());
        let mut file =
            BufReader::new(File::open(path).map_err(|error| say(&format!("cannot be read: {error}")))?);
        let mut mark = [0; MARK.len()];
        if file.read_exact(&mut mark).is_err() || mark != MARK {
            return Err(say("is no recording of an interface"));
        }
        let (before, after) = (Frame::default(), Frame::default());
        let (surface, points) = (Surface::default(), None);
        let mut recording = Self { file, kind: Kind::Surface, surface, points, before, after };
        let mut mesh = Frame::default();
        let surface = recording.next(&mut mesh).then(|| Surface::decode(&mesh.values, "recording"));
        recording.surface = match surface {
            Some(Ok(surface)) => surface,
            _ => return Err(say("has no surface")),
        };
        recording.points = recording.take_points().map_err(|error| say(&error.to_string()))?;
        recording.kind = kind;
        let mut first = Frame::default();
        if !recording.next(&mut first) {
            return Err(say("ends before its first step"));
        }
        recording.before.clone_from(&first);
        recording.after = first;
        Ok(recording)
    }

    /// The solid's surface.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The fluid's points, where it has offered some.
    pub fn points(&self) -> Option<&Points> {
        self.points.as_ref()
    }

    /// Takes the points if they are the next message.
    fn take_points(&mut self) -> Result<Option<Points>, LinkError> {
        let Some(words) = self.head() else { return Ok(None) };
        let back = self.file.seek_relative(-(size_of::<Head>() as i64));
        let mut frame = Frame::default();
        self.kind = Kind::Points;
        if u64::from_le_bytes(words[0]) != Kind::Points as u64 || back.is_err() || !self.next(&mut frame) {
            return Ok(None);
        }
        Points::decode(&frame.values, "recording").map(Some)
    }

    /// The five words before the values of a message.
    fn head(&mut self) -> Option<Head> {
        let mut words = Head::default();
        words.iter_mut().all(|word| self.file.read_exact(word).is_ok()).then_some(words)
    }

    /// Reads the next message of the kind wanted; false at the end.
    fn next(&mut self, frame: &mut Frame) -> bool {
        loop {
            let Some(words) = self.head() else { return false };
            let count = u64::from_le_bytes(words[4]);
            if u64::from_le_bytes(words[0]) != self.kind as u64 {
                let bytes = i64::try_from(count.saturating_mul(8)).unwrap_or(i64::MAX);
                if self.file.seek_relative(bytes).is_err() {
                    return false;
                }
                continue;
            }
            (frame.time, frame.dt) = (f64::from_le_bytes(words[2]), f64::from_le_bytes(words[3]));
            frame.values.clear();
            for _ in 0..count {
                let mut word = [0; 8];
                if self.file.read_exact(&mut word).is_err() {
                    return false;
                }
                frame.values.push(f64::from_le_bytes(word));
            }
            return true;
        }
    }

    /// The values at a time, s, not earlier than the last one asked for: those recorded, between two instants their
    /// linear interpolation, before the first and after the last instant those.
    fn at(&mut self, time: f64, values: &mut Vec<f64>) {
        while self.after.time < time && self.advance() {}
        let (before, after) = (&self.before, &self.after);
        values.clear();
        if time >= after.time || time <= before.time {
            let nearest = if time >= after.time { after } else { before };
            return values.extend_from_slice(&nearest.values);
        }
        let share = (time - before.time) / (after.time - before.time);
        let pairs = before.values.iter().zip(&after.values);
        values.extend(pairs.map(|(before, after)| before + share * (after - before)));
    }

    fn advance(&mut self) -> bool {
        let mut next = std::mem::take(&mut self.before);
        let is_there = self.next(&mut next);
        self.before = std::mem::replace(&mut self.after, next);
        if !is_there {
            self.after.clone_from(&self.before);
        }
        is_there
    }

    /// The step that leads from `time` s to the next recorded instant, s; infinite after the last.
    fn admitted_dt(&mut self, time: f64) -> f64 {
        while self.after.time <= time {
            if !self.advance() {
                return f64::INFINITY;
            }
        }
        if self.before.time == time { self.after.dt } else { self.after.time - time }
    }
}

/// A recording in the place of the fluid or the solid, seen through the coupler's link to it.
#[derive(Clone)]
pub struct Replay(Rc<RefCell<Recording>>);

impl Replay {
    /// A recording whose first message is at the start of the run.
    pub fn new(recording: Recording) -> Self {
        Self(Rc::new(RefCell::new(recording)))
    }

    /// The link to the side of this name.
    pub fn link(&self, peer: &str) -> Box<dyn Link<f64>> {
        Box::new(ReplayLink {
            peer: peer.to_owned(),
            replay: self.clone(),
            contract: Vec::new(),
            time: 0.0,
            values: Vec::new(),
        })
    }

    /// The step to the next recorded instant, s.
    pub fn admitted_dt(&self, time: f64) -> f64 {
        self.0.borrow_mut().admitted_dt(time)
    }
}

/// Answers what is asked of one side; what is sent to it says what time it is.
struct ReplayLink {
    peer: String,
    replay: Replay,
    contract: Vec<f64>,
    time: f64,
    values: Vec<f64>,
}

impl Link<f64> for ReplayLink {
    fn peer(&self) -> &str {
        &self.peer
    }

    fn send(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [f64]),
    ) -> Result<(), LinkError> {
        self.time = header.time;
        if header.kind == Kind::Contract as u32 {
            self.contract.resize(count, 0.0);
            fill(&mut self.contract);
        }
        Ok(())
    }

    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[f64])) -> Result<(), LinkError> {
        let mut recording = self.replay.0.borrow_mut();
        match expect.kind {
            Kind::Contract => self.values.clone_from(&self.contract),
            Kind::Surface => self.values = recording.surface.encode(),
            Kind::Points => self.values = recording.points().map(Points::encode).unwrap_or_default(),
            _ => recording.at(self.time, &mut self.values),
        }
        let (expected, found) = (expect.count.unwrap_or(self.values.len()), self.values.len());
        if expected != found {
            return Err(LinkError::Count { peer: format!("the recorded {}", self.peer), expected, found });
        }
        read(&Header::new(expect.kind, expect.step, self.time, 0.0), &self.values);
        Ok(())
    }
}

/// The failure of a recording that cannot be used.
pub fn unusable(what: String) -> Failure {
    Failure::new(FailureClass::Resource, NAME, "replay", what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(step: u64, time: f64, dt: f64) -> StepTime {
        StepTime { step, time, dt }
    }

    fn recorded(folder: &Path, points: Option<&Points>) -> PathBuf {
        let surface = Surface { dimension: 2, ..Surface::default() };
        let mut recorder = Recorder::create(folder).unwrap();
        recorder.write(Kind::Surface, at(0, 0.0, 0.0), &[&surface.encode()]).unwrap();
        if let Some(points) = points {
            recorder.write(Kind::Points, at(0, 0.0, 0.0), &[&points.encode()]).unwrap();
        }
        recorder.write(Kind::Motion, at(0, 0.0, 0.0), &[&[0.0]]).unwrap();
        for (step, time, dt) in [(1, 0.25, 0.25), (2, 0.75, 0.5)] {
            recorder.write(Kind::Load, at(step, time, dt), &[&[10.0 * time], &[1.0]]).unwrap();
            recorder.write(Kind::Motion, at(step, time, dt), &[&[time]]).unwrap();
        }
        recorder.flush().unwrap();
        folder.join(FILE)
    }

    #[test]
    fn what_was_recorded_comes_back_at_its_instants_and_between_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = recorded(folder.path(), None);
        let mut motion = Recording::open(&path, Kind::Motion).unwrap();
        assert_eq!((motion.surface().dimension, motion.points()), (2, None));
        assert_eq!(motion.admitted_dt(0.0), 0.25);
        let mut values = Vec::new();
        for (time, expected) in
            [(0.0, 0.0), (0.125, 0.125), (0.25, 0.25), (0.5, 0.5), (0.75, 0.75), (2.0, 0.75)]
        {
            motion.at(time, &mut values);
            assert_eq!(values, [expected], "at {time}");
        }
        assert_eq!(motion.admitted_dt(0.75), f64::INFINITY);
        let mut load = Recording::open(&path, Kind::Load).unwrap();
        load.at(0.25, &mut values);
        assert_eq!((values, load.admitted_dt(0.25)), (vec![2.5, 1.0], 0.5));
    }

    #[test]
    fn points_come_back_beside_loads_and_motions() {
        let folder = tempfile::tempdir().unwrap();
        let points = Points { dimension: 2, reference_position: vec![0.5, 0.25], area: vec![0.125] };
        let path = recorded(folder.path(), Some(&points));
        for kind in [Kind::Motion, Kind::Load] {
            let mut recording = Recording::open(&path, kind).unwrap();
            assert_eq!(recording.points(), Some(&points));
            assert_eq!(recording.admitted_dt(0.25), 0.5);
        }
    }

    #[test]
    fn another_file_is_no_recording() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("other");
        std::fs::write(&path, "time_s,fx_n\n").unwrap();
        assert!(Recording::open(&path, Kind::Load).unwrap_err().contains("no recording"));
        assert!(Recording::open(&folder.path().join("none"), Kind::Load).is_err());
    }
}
