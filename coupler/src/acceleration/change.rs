//! What both quasi-Newton methods are made of: the changes from pass to pass, and an orthonormal basis of them.

use serde::{Deserialize, Serialize};

use super::dot;

/// A column whose part orthogonal to the others is smaller than this, relative to itself, is left out.
///
/// Source: Haelterman et al., Comput. Struct. 171, 2016.
const FILTER: f64 = 1e-6;

/// A change of the residual and the change of the solid's answer that goes with it, `[n]` m each.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Change {
    pub(super) residual: Vec<f64>,
    pub(super) answer: Vec<f64>,
}

impl Change {
    pub(super) fn copy(&mut self, other: &Self) {
        self.residual.clone_from(&other.residual);
        self.answer.clone_from(&other.answer);
    }

    fn subtract(&mut self, share: f64, other: &Self) {
        subtract(&mut self.residual, share, &other.residual);
        subtract(&mut self.answer, share, &other.answer);
    }
}

/// The last pass of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct LastPass {
    pass: Change,
    is_known: bool,
}

impl LastPass {
    /// Writes the change since the last pass into `change` and keeps this pass. `None` in the first pass of a step, else
    /// whether the residual has grown.
    pub(super) fn change(&mut self, residual: &[f64], answer: &[f64], change: &mut Change) -> Option<bool> {
        let has_grown = dot(residual, residual) > dot(&self.pass.residual, &self.pass.residual);
        let grown = self.is_known.then_some(has_grown);
        if self.is_known {
            difference(&mut change.residual, residual, &self.pass.residual);
            difference(&mut change.answer, answer, &self.pass.answer);
        }
        self.pass.residual.clear();
        self.pass.residual.extend_from_slice(residual);
        self.pass.answer.clear();
        self.pass.answer.extend_from_slice(answer);
        self.is_known = true;
        grown
    }

    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }
}

/// Changes with orthonormal residuals, in room that is used again.
#[derive(Debug, Clone, Default)]
pub(super) struct Basis {
    room: Vec<Change>,
    count: usize,
}

impl Basis {
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn columns(&self) -> &[Change] {
        &self.room[..self.count]
    }

    /// Adds what a change says beyond the columns there are, by modified Gram-Schmidt; the answer goes through the same
    /// combinations as the residual.
    pub(super) fn add(&mut self, change: &Change) {
        if self.count == change.residual.len() {
            return;
        }
        if self.count == self.room.len() {
            self.room.push(Change::default());
        }
        let (columns, free) = self.room.split_at_mut(self.count);
        let column = &mut free[0];
        column.copy(change);
        let size = dot(&column.residual, &column.residual).sqrt();
        for earlier in columns.iter() {
            column.subtract(dot(&earlier.residual, &column.residual), earlier);
        }
        let length = dot(&column.residual, &column.residual).sqrt();
        if length > FILTER * size {
            column.residual.iter_mut().chain(&mut column.answer).for_each(|value| *value /= length);
            self.count += 1;
        }
    }
}

/// answer -= sum over the columns of (column.residual . residual) column.answer: what the columns know of the answer
/// to a change of the residual.
pub(super) fn subtract_known<'c>(
    columns: impl IntoIterator<Item = &'c Change>,
    residual: &[f64],
    answer: &mut [f64],
) {
    for column in columns {
        subtract(answer, dot(&column.residual, residual), &column.answer);
    }
}

fn difference(target: &mut Vec<f64>, a: &[f64], b: &[f64]) {
    target.clear();
    target.extend(a.iter().zip(b).map(|(a, b)| a - b));
}

/// target -= share * column.
fn subtract(target: &mut [f64], share: f64, column: &[f64]) {
    for (target, value) in target.iter_mut().zip(column) {
        *target -= share * value;
    }
}
