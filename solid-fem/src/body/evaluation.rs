//! What is asked of a body between its steps: the acceleration it starts with, forces of inertia, matrices.

use super::Body;
use crate::error::Trouble;
use crate::linear::LinearMethod;
use crate::linear::block_matrix::BlockMatrix;
use crate::load::When;
use crate::state::{Span, State};

impl Body {
    /// Acceleration that balances the forces at the present displacement and velocity, unless they are in balance.
    pub(crate) fn balance_acceleration(&mut self) -> Result<(), Trouble> {
        let still = Span {
            dt: f64::INFINITY,
            when: When { time: self.state.time, fraction: 1.0, weight: 1.0, own: 1.0 },
        };
        self.predict_rest(self.state.time);
        self.balance(still)?;
        std::mem::swap(&mut self.state, &mut self.trial);
        if self.is_balanced() {
            return Ok(());
        }
        self.system.values.copy_from_slice(&self.mass.values);
        self.system.fix(&self.fixed);
        self.combined = None;
        let method = LinearMethod::JacobiConjugateGradient;
        self.linear.solve(method, &self.system, &self.residual, &mut self.state.acceleration, 1e-12)
    }

    /// Force of inertia and damping at the state, `[n, D]` N, for [`Self::product`].
    pub(crate) fn find_inertia_of_state(&mut self) {
        let state = &self.state;
        for i in 0..self.fixed.len() {
            self.increment[i] = state.acceleration[i] + self.damping * state.velocity[i];
        }
        self.mass.multiply(&self.increment, &mut self.work);
        if let Some(damping) = &self.stiffness_damping {
            damping.multiply(&state.velocity, &mut self.increment);
            self.work.iter_mut().zip(&self.increment).for_each(|(work, damping)| *work += damping);
        }
    }

    /// Computes M x of a column of the state, `[n, D]`, for [`Self::product`].
    pub(crate) fn times_mass(&mut self, column: impl Fn(&State) -> &[f64]) {
        self.mass.multiply(column(&self.state), &mut self.work);
    }

    /// The last product of [`Self::times_mass`].
    pub(crate) fn product(&self) -> &[f64] {
        &self.work
    }

    /// Mass and stiffness for eigenvalues: assembles the tangent at the state, fixed components made identity.
    pub(crate) fn stiffness_at_state(&mut self) -> Result<&BlockMatrix, Trouble> {
        if !self.is_linear {
            self.assembly.tangent(self.state.at(), &mut self.stiffness)?;
            self.tangent_serves = false;
        }
        self.combined = None;
        self.system.values.copy_from_slice(&self.stiffness.values);
        self.system.fix(&self.fixed);
        Ok(&self.system)
    }
}
