//! The running mean of a series and what is left of the series beside it. Steps differ in length, so a row counts with
//! the time since the row before.

/// The series with every value replaced by the mean over the rows within half of `length` s of it.
pub fn running_mean(rows: &[(f64, f64)], length: f64) -> Vec<(f64, f64)> {
    // Integral up to each row: a mean is then one difference, however long it is.
    let mut integral = 0.0;
    let mut before = rows.first().map_or(0.0, |row| row.0);
    let integrals: Vec<f64> = rows
        .iter()
        .map(|&(time, value)| {
            integral += (time - before) * value;
            before = time;
            integral
        })
        .collect();
    let mean = |&(time, value): &(f64, f64)| {
        // The row before the first one within reach: where the first one's time begins.
        let first = rows.partition_point(|row| row.0 < time - 0.5 * length).saturating_sub(1);
        let last = rows.partition_point(|row| row.0 <= time + 0.5 * length) - 1;
        let span = rows[last].0 - rows[first].0;
        let mean = if span > 0.0 { (integrals[last] - integrals[first]) / span } else { value };
        (time, mean)
    };
    rows.iter().map(mean).collect()
}

/// Root mean square of the series about its running mean from `from` to `to` s, over its mean there; `None` without rows or
/// with a mean of zero.
pub fn noise(rows: &[(f64, f64)], length: f64, (from, to): (f64, f64)) -> Option<f64> {
    let smooth = running_mean(rows, length);
    let (mut time, mut sum, mut square) = (0.0, 0.0, 0.0);
    for (pair, smooth) in rows.windows(2).zip(&smooth[1..]) {
        let (before, (at, value)) = (pair[0].0, pair[1]);
        if from <= at && at <= to {
            time += at - before;
            sum += (at - before) * value;
            square += (at - before) * (value - smooth.1).powi(2);
        }
    }
    (sum != 0.0).then(|| (square / time).sqrt() / (sum / time).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line from 2 to 4 with an oscillation of amplitude 0.3 that a window holds 10 times.
    fn rows() -> Vec<(f64, f64)> {
        let value = |t: f64| 2.0 + 2.0 * t + 0.3 * (std::f64::consts::TAU * 100.0 * t).sin();
        // Steps of two lengths.
        (0..=3000)
            .map(|k| f64::from(k / 2) / 1500.0 + f64::from(k % 2) * 2e-4)
            .map(|t| (t, value(t)))
            .collect()
    }

    #[test]
    fn the_running_mean_keeps_a_line_and_removes_an_oscillation() {
        for (time, mean) in running_mean(&rows(), 0.1) {
            if (0.05..0.95).contains(&time) {
                assert!((mean - 2.0 - 2.0 * time).abs() < 5e-3, "{mean} at {time}");
            }
        }
        let constant: Vec<_> = (0..10).map(|k| (f64::from(k * k), 7.0)).collect();
        assert!(running_mean(&constant, 20.0).iter().all(|row| (row.1 - 7.0).abs() < 1e-12));
    }

    #[test]
    fn noise_is_the_rms_of_the_oscillation_over_the_mean() {
        let found = noise(&rows(), 0.1, (0.25, 0.75)).unwrap();
        let expected = 0.3 / 2f64.sqrt() / 3.0;
        assert!((found / expected - 1.0).abs() < 0.02, "{found}, {expected}");
        assert_eq!(noise(&rows(), 0.1, (2.0, 3.0)), None);
    }
}
