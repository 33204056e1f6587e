//! Fixed-step integration.

use crate::scalar::Scalar;
use nalgebra::SVector;

/// One step of the classical fourth-order Runge-Kutta method.
///
/// `rate(fraction, state)` is the time derivative at `fraction` (0, 1/2 or 1) of the step.
#[inline]
pub fn rk4<S: Scalar, const N: usize>(
    state: &SVector<S, N>,
    step: f64,
    mut rate: impl FnMut(f64, &SVector<S, N>) -> SVector<S, N>,
) -> SVector<S, N> {
    let scaled = |k: &SVector<S, N>, factor: f64| k.map(|v| v * factor);
    let k1 = rate(0.0, state);
    let k2 = rate(0.5, &(state + scaled(&k1, 0.5 * step)));
    let k3 = rate(0.5, &(state + scaled(&k2, 0.5 * step)));
    let k4 = rate(1.0, &(state + scaled(&k3, step)));
    state + scaled(&(k1 + scaled(&(k2 + k3), 2.0) + k4), step / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_four() {
        let error = |n: u32| {
            let h = 1.0 / f64::from(n);
            let mut y = SVector::<f64, 2>::new(1.0, 0.0);
            for _ in 0..n {
                y = rk4(&y, h, |_, y| SVector::<f64, 2>::new(y[1], -y[0]));
            }
            (y[0] - 1f64.cos()).abs()
        };
        let order = (error(20) / error(40)).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }
}
