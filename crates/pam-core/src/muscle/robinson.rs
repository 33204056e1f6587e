//! `robinson`: the force balance of [`super::kothera`] with the radius and thickness of the
//! elliptic ends.
//!
//! Equation (physics reference, section 2, model 6; Robinson 2014, ch. 2): (2.16) with `R` and `t`
//! of the elliptic-end geometry, a polynomial stress of any order M whose moduli are linear in
//! pressure, one polynomial for both directions:
//!
//! ```text
//! s(eps) = sum_k E_k eps^k
//! E_k = m_k P + b_k
//! k = 1 .. M
//! (2.9), section 2.2.6
//! ```
//!
//! The balance is the same function; only the geometry, elliptic unless the muscle says otherwise,
//! differs.

pub use super::kothera::{elastic, gas};
