//! Sub-steps: an interval is crossed in equal parts, each of them by step halving.
//!
//! Step halving: an interval is crossed in one step if that works, else in halves down to 1/256, doubling back after
//! each success.

use crate::error::Trouble;

/// Smallest part of an interval tried.
const PARTS: u32 = 256;

/// Crosses an interval; `attempt(from, to)` tries a part of it given in fractions of the whole. Returns the number of
/// parts and of failed attempts.
///
/// # Errors
/// The trouble of the last attempt when 1/256 of the interval fails too.
pub(crate) fn cross(mut attempt: impl FnMut(f64, f64) -> Result<(), Trouble>) -> Result<(u32, u64), Trouble> {
    let (mut done, mut size, mut taken, mut failed) = (0, PARTS, 0, 0);
    let fraction = |part: u32| f64::from(part) / f64::from(PARTS);
    while done < PARTS {
        match attempt(fraction(done), fraction(done + size)) {
            Ok(()) => {
                done += size;
                taken += 1;
                if done % (2 * size) == 0 && done + 2 * size <= PARTS {
                    size *= 2;
                }
            }
            Err(_) if size > 1 => {
                size /= 2;
                failed += 1;
            }
            Err(trouble) => return Err(trouble),
        }
    }
    Ok((taken, failed))
}

/// Crosses an interval in equal parts, each as [`cross`] does.
///
/// # Errors
/// As [`cross`].
pub(crate) fn cross_in(
    parts: u32,
    mut attempt: impl FnMut(f64, f64) -> Result<(), Trouble>,
) -> Result<(u32, u64), Trouble> {
    let whole = f64::from(parts);
    let (mut taken, mut failed) = (0, 0);
    for part in 0..parts {
        let first = f64::from(part);
        let done = cross(|from, to| attempt((first + from) / whole, (first + to) / whole))?;
        (taken, failed) = (taken + done.0, failed + done.1);
    }
    Ok((taken, failed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_and_doubles_back() {
        let mut parts = Vec::new();
        let (taken, failed) = cross(|from, to| {
            let is_hard = from < 0.1 && to - from > 0.13;
            if is_hard {
                return Err(Trouble::NonFinite);
            }
            parts.push((from, to));
            Ok(())
        })
        .unwrap();
        assert_eq!(failed, 3);
        assert_eq!(parts, [(0.0, 0.125), (0.125, 0.25), (0.25, 0.5), (0.5, 1.0)]);
        assert_eq!(taken, 4);
    }

    #[test]
    fn equal_parts_follow_each_other() {
        let mut parts = Vec::new();
        let done = cross_in(4, |from, to| {
            parts.push((from, to));
            Ok(())
        });
        assert_eq!(done, Ok((4, 0)));
        assert_eq!(parts, [(0.0, 0.25), (0.25, 0.5), (0.5, 0.75), (0.75, 1.0)]);
    }

    #[test]
    fn gives_up_below_one_part_of_256() {
        let mut attempts = 0;
        let result = cross(|_, _| {
            attempts += 1;
            Err(Trouble::Indefinite)
        });
        assert_eq!((result, attempts), (Err(Trouble::Indefinite), 9));
    }
}
