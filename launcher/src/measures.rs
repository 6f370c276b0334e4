//! One number each of a series of rows (time in s, value).

/// Linear interpolation in a series, constant outside.
pub fn at(series: &[(f64, f64)], time: f64) -> f64 {
    protocol::case::interpolate(series, time)
}

/// The first passage of a level, s.
pub fn crossing(rows: &[(f64, f64)], level: f64) -> Option<f64> {
    let pair = rows.windows(2).find(|pair| (pair[0].1 < level) != (pair[1].1 < level))?;
    Some(pair[0].0 + (level - pair[0].1) / (pair[1].1 - pair[0].1) * (pair[1].0 - pair[0].0))
}

/// Frequency from the first to the last passage of a level, Hz; `None` with fewer than three.
pub fn frequency(rows: &[(f64, f64)], level: f64) -> Option<f64> {
    let mut passages = Vec::new();
    let mut rest = rows;
    while let Some(next) = rest.windows(2).position(|pair| (pair[0].1 < level) != (pair[1].1 < level)) {
        passages.push(crossing(&rest[next..next + 2], level)?);
        rest = &rest[next + 1..];
    }
    let half_periods = passages.len().checked_sub(1).filter(|&count| count >= 2)?;
    Some(0.5 * half_periods as f64 / (passages.last()? - passages.first()?))
}

/// r of exp(-r t): least squares through the logarithms of the absolute values, 1/s; `None` with fewer than two.
pub fn decay_rate(rows: &[(f64, f64)]) -> Option<f64> {
    let points: Vec<_> =
        rows.iter().filter(|row| row.1 != 0.0).map(|row| (row.0, row.1.abs().ln())).collect();
    let count = points.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| points.iter().map(pick).sum::<f64>() / count;
    let (time, value) = (mean(|point| point.0), mean(|point| point.1));
    let spread: f64 = points.iter().map(|point| (point.0 - time).powi(2)).sum();
    let common: f64 = points.iter().map(|point| (point.0 - time) * (point.1 - value)).sum();
    (spread > 0.0).then_some(-common / spread)
}

/// Mean over time by the trapezoidal rule.
pub fn time_mean(rows: &[(f64, f64)]) -> f64 {
    let span = rows.last().map_or(0.0, |row| row.0) - rows.first().map_or(0.0, |row| row.0);
    if span <= 0.0 {
        return rows.first().map_or(0.0, |row| row.1);
    }
    rows.windows(2).map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0)).sum::<f64>() / span
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequency_and_decay_are_found_in_a_damped_cosine() {
        let rows: Vec<_> = (0..=1000)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| (t, 0.3 + (std::f64::consts::TAU * 5.0 * t + 0.4).cos()))
            .collect();
        assert!((frequency(&rows, 0.3).unwrap() - 5.0).abs() < 1e-3);
        assert_eq!(frequency(&rows[..50], 0.3), None);
        let rows: Vec<_> = rows.iter().map(|row| (row.0, -2.0 * (-3.0 * row.0).exp())).collect();
        assert!((decay_rate(&rows).unwrap() - 3.0).abs() < 1e-9);
    }
}
