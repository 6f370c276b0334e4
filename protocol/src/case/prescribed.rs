//! Motion known beforehand: none, a sine, or a table. Of a rigid body, an obstacle or the tank.

use std::f64::consts::TAU;

use super::section::Section;

/// How a rigid body moves; it does not turn.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Prescribed {
    /// Not at all.
    #[default]
    Fixed,
    /// u = amplitude sin(2 pi frequency t + phase).
    Sine {
        /// `[D]` m.
        amplitude: Vec<f64>,
        /// Hz.
        frequency: f64,
        /// rad.
        phase: f64,
    },
    /// Through the rows of a table by cubic Hermite pieces with Catmull-Rom slopes: displacement and velocity are
    /// continuous, at rest before the first and after the last row.
    Table {
        /// s.
        time: Vec<f64>,
        /// `[rows, D]` m.
        displacement: Vec<Vec<f64>>,
    },
}

/// Displacement m, velocity m/s and acceleration m/s2 along one axis.
pub(super) type Motion = [f64; 3];

impl Prescribed {
    /// Reads a section of a motion, such as `[solid.motion]`.
    pub fn read(section: &Section<'_>, dimension: usize) -> Self {
        let kind = section.choice("kind", &["sine", "table"]).about("Form of the motion.").default("sine");
        let amplitude = section.vector("amplitude", dimension, "m", "sine: amplitude along each axis.");
        let frequency =
            section.number("frequency").unit("Hz").above(0.0).about("sine: frequency.").optional();
        let phase = section.number("phase").unit("degree").about("sine: phase at time 0.").default(0.0);
        let rows = section.rows("table", 1 + dimension, "s, m", "table: rows [time, displacement per axis].");
        section.finish();
        match (kind.as_str(), amplitude, frequency, rows) {
            ("sine", Some(amplitude), Some(frequency), None) => {
                Self::Sine { amplitude, frequency, phase: phase.to_radians() }
            }
            ("table", None, None, Some(rows)) => Self::from_rows(section, rows),
            ("sine", ..) => {
                section.complain("kind", "a sine takes amplitude and frequency", "and no table", "");
                Self::Fixed
            }
            _ => {
                section.complain("kind", "a table takes rows under table", "and nothing else", "");
                Self::Fixed
            }
        }
    }

    fn from_rows(section: &Section<'_>, rows: Vec<Vec<f64>>) -> Self {
        if rows.len() < 2 || rows.windows(2).any(|pair| pair[0][0] >= pair[1][0]) {
            let hint = "Sort the rows by time.";
            section.complain(
                "table",
                "the times do not increase",
                "at least two rows, increasing times",
                hint,
            );
        }
        let time = rows.iter().map(|row| row[0]).collect();
        Self::Table { time, displacement: rows.into_iter().map(|row| row[1..].to_vec()).collect() }
    }

    /// Largest speed at any time, m/s; of a table, to a twentieth of a row.
    pub fn largest_speed(&self) -> f64 {
        let size = |speeds: &mut dyn Iterator<Item = f64>| speeds.map(|v| v * v).sum::<f64>().sqrt();
        match self {
            Self::Fixed => 0.0,
            Self::Sine { amplitude, frequency, .. } => TAU * frequency * size(&mut amplitude.iter().copied()),
            Self::Table { time, displacement } => {
                let at = |t: f64| size(&mut (0..displacement[0].len()).map(|axis| self.at(axis, t)[1]));
                let inside = time
                    .windows(2)
                    .flat_map(|pair| (0..=20).map(|k| pair[0] + f64::from(k) / 20.0 * (pair[1] - pair[0])));
                inside.map(at).fold(0.0, f64::max)
            }
        }
    }

    /// The motion along an axis at a time, s.
    pub fn at(&self, axis: usize, time: f64) -> Motion {
        match self {
            Self::Fixed => [0.0; 3],
            Self::Sine { amplitude, frequency, phase } => {
                let omega = TAU * frequency;
                let (sine, cosine) = (omega * time + phase).sin_cos();
                [sine, omega * cosine, -omega * omega * sine].map(|factor| amplitude[axis] * factor)
            }
            Self::Table { time: times, displacement } => {
                let after = times.partition_point(|&row| row <= time);
                match after {
                    0 => [displacement[0][axis], 0.0, 0.0],
                    _ if after == times.len() => [displacement[after - 1][axis], 0.0, 0.0],
                    _ => hermite(times, displacement, axis, (after - 1, time)),
                }
            }
        }
    }
}

/// The cubic between rows `row` and `row + 1`.
fn hermite(times: &[f64], displacement: &[Vec<f64>], axis: usize, (row, time): (usize, f64)) -> Motion {
    let value = |row: usize| displacement[row][axis];
    let slope = |row: usize| {
        let is_inner = row > 0 && row + 1 < times.len();
        if is_inner { (value(row + 1) - value(row - 1)) / (times[row + 1] - times[row - 1]) } else { 0.0 }
    };
    let length = times[row + 1] - times[row];
    let s = (time - times[row]) / length;
    let rise = value(row + 1) - value(row);
    let (left, right) = (slope(row) * length, slope(row + 1) * length);
    // u = u0 + left s + b s2 + c s3 with the end slopes and the rise.
    let (b, c) = (3.0 * rise - 2.0 * left - right, left + right - 2.0 * rise);
    [
        value(row) + s * (left + s * (b + s * c)),
        (left + s * (2.0 * b + 3.0 * c * s)) / length,
        (2.0 * b + 6.0 * c * s) / (length * length),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_and_acceleration_are_the_derivatives() {
        let sine = Prescribed::Sine { amplitude: vec![0.1, 0.02], frequency: 2.0, phase: 0.3 };
        let table = Prescribed::Table {
            time: vec![0.0, 0.1, 0.3, 0.4],
            displacement: vec![vec![0.0, 0.0], vec![0.02, 0.1], vec![-0.01, 0.2], vec![0.0, 0.2]],
        };
        for motion in [sine, table] {
            for time in [0.03, 0.17, 0.33] {
                for axis in 0..2 {
                    let step = 1e-5;
                    let (up, here, down) =
                        (motion.at(axis, time + step), motion.at(axis, time), motion.at(axis, time - step));
                    assert!(((up[0] - down[0]) / (2.0 * step) - here[1]).abs() < 1e-6);
                    assert!(((up[1] - down[1]) / (2.0 * step) - here[2]).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn the_largest_speed_is_met_and_never_passed() {
        let sine = Prescribed::Sine { amplitude: vec![0.03, 0.04], frequency: 2.0, phase: 0.3 };
        assert!((sine.largest_speed() - TAU * 0.1).abs() < 1e-12);
        let table = Prescribed::Table { time: vec![0.0, 1.0], displacement: vec![vec![0.0], vec![1.0]] };
        assert!((table.largest_speed() - 1.5).abs() < 2e-3, "3 s2 - 2 s3: {}", table.largest_speed());
    }

    #[test]
    fn a_table_goes_through_its_rows_and_rests_outside() {
        let table = Prescribed::Table {
            time: vec![1.0, 2.0, 4.0],
            displacement: vec![vec![0.1], vec![0.4], vec![0.3]],
        };
        assert_eq!(table.at(0, 0.0), [0.1, 0.0, 0.0]);
        assert_eq!(table.at(0, 2.0)[0], 0.4);
        assert_eq!(table.at(0, 9.0), [0.3, 0.0, 0.0]);
    }
}
