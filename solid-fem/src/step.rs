//! One step of the solid, from one state of balance to the next: Newton's method on
//! M [(1-am) a1 + am a0] + (1-af) f(u1) + af f(u0) = (1-af) F1 + af F0.

use crate::body::Body;
use crate::error::Trouble;
use crate::state::Span;

/// Advances the body over one span of time; on trouble its state stays as it was.
///
/// The prediction is accepted unchanged when it is in balance, so rest is kept to the last bit. The tangent is kept
/// while the residual falls well with it.
pub(crate) fn step(body: &mut Body, span: Span) -> Result<(), Trouble> {
    body.timed("predict", |body| body.predict(span));
    iterate(body, span)?;
    body.accept();
    Ok(())
}

/// The same without inertia: the balance under the loads of one instant.
pub(crate) fn static_step(body: &mut Body, span: Span) -> Result<(), Trouble> {
    body.timed("predict", |body| body.predict_rest(span.when.time));
    iterate(body, span)?;
    body.accept();
    Ok(())
}

fn iterate(body: &mut Body, span: Span) -> Result<(), Trouble> {
    body.timed("balance_forces", |body| body.balance(span))?;
    while !body.is_balanced() {
        body.timed("assemble_tangent", |body| body.assemble_tangent(span))?;
        body.timed("solve_linear", Body::solve_linear)?;
        body.timed("correct_motion", |body| body.correct(span));
        body.timed("balance_forces", |body| body.balance(span))?;
    }
    Ok(())
}
