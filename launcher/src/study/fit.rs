//! What a set of (cost, error) points says: order of convergence, front, cheapest setting.

/// Slope of the straight line through (ln size, ln error), by least squares; the observed order of convergence.
/// `None` with fewer than two different sizes, or errors that are not positive.
pub(super) fn order(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<_> = points
        .iter()
        .filter(|(size, error)| *size > 0.0 && *error > 0.0)
        .map(|(size, error)| (size.ln(), error.ln()))
        .collect();
    let count = logs.len() as f64;
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(value).sum::<f64>() / count;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let covariance: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let variance: f64 = logs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
    (logs.len() >= 2 && variance > 1e-12).then(|| covariance / variance)
}

/// Which of the (cost, error) points no other one beats in both.
pub(super) fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|point| !points.iter().any(|other| beats(other, point))).collect()
}

/// Index of the cheapest of the (cost, error) points whose error is at most `wanted`.
pub(super) fn cheapest(points: &[(f64, f64)], wanted: f64) -> Option<usize> {
    let good = points.iter().enumerate().filter(|(_, point)| point.1 <= wanted);
    good.min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(index, _)| index)
}

/// Middle of the values; the mean of the two middle ones of an even number.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_order_error_has_order_two() {
        let points: Vec<_> = [0.1, 0.05, 0.02].map(|h: f64| (h, 3.0 * h * h)).to_vec();
        assert!((order(&points).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(order(&points[..1]), None);
        assert_eq!(order(&[(0.1, 1.0), (0.1, 2.0)]), None);
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [(1.0, 4.0), (2.0, 5.0), (3.0, 1.0), (3.0, 2.0)];
        assert_eq!(front(&points), [true, false, true, false]);
        assert_eq!(cheapest(&points, 2.0), Some(2));
        assert_eq!(cheapest(&points, 0.5), None);
    }

    #[test]
    fn the_middle_of_an_even_number_is_a_mean() {
        assert_eq!(median(vec![3.0, 1.0]), Some(2.0));
        assert_eq!(median(vec![3.0, 1.0, 9.0]), Some(3.0));
        assert_eq!(median(vec![]), None);
    }
}
