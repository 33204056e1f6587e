//! Numerical tools of the geometry: Gauss-Legendre quadrature and a bracketed root solve.
//!
//! Quadrature: `integral_-1^1 f dx = sum w_i f(x_i)`, `x_i` the roots of the Legendre polynomial
//! `P_n`, `w_i = 2 / ((1 - x_i^2) P_n'(x_i)^2)` (Abramowitz & Stegun 25.4.29), exact to degree
//! `2n - 1`. Root solve: R. P. Brent, *Algorithms for Minimization without Derivatives*, ch. 4
//! (bisection, secant and inverse quadratic interpolation; never leaves the bracket).

/// Nodes and weights of the `N`-point Gauss-Legendre rule on `[-1, 1]`.
#[derive(Debug, Clone, Copy)]
pub struct GaussLegendre<const N: usize> {
    /// Nodes, ascending.
    pub nodes: [f64; N],
    /// Weights; they sum to 2.
    pub weights: [f64; N],
}

impl<const N: usize> GaussLegendre<N> {
    /// The rule, its nodes found by Newton's method from the Chebyshev-like first guess.
    #[must_use]
    pub fn new() -> Self {
        let (mut nodes, mut weights) = ([0.0; N], [0.0; N]);
        let order = N as f64;
        for i in 0..N {
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (order + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (value, derivative) = legendre(N, x);
                slope = derivative;
                let step = value / derivative;
                x -= step;
                if step.abs() <= 1e-16 {
                    break;
                }
            }
            nodes[i] = x;
            weights[i] = 2.0 / ((1.0 - x * x) * slope * slope);
        }
        Self { nodes, weights }
    }

    /// The integral of `f` over `[low, high]`.
    pub fn integrate(&self, low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let terms = self.nodes.iter().zip(&self.weights);
        half * terms.map(|(x, w)| w * f(middle + half * x)).sum::<f64>()
    }
}

impl<const N: usize> Default for GaussLegendre<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Value and first derivative of the Legendre polynomial of the given order.
fn legendre(order: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for n in 1..order {
        let n = n as f64;
        let next = ((2.0 * n + 1.0) * x * current - n * previous) / (n + 1.0);
        previous = current;
        current = next;
    }
    (current, order as f64 * (x * current - previous) / (x * x - 1.0))
}

/// Root of a function on a bracket, with the number of function evaluations it took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// The root.
    pub x: f64,
    /// Function evaluations used inside the bracket.
    pub iterations: u32,
}

/// Brent's method on `[a, b]` with `f(a) = fa` and `f(b) = fb` of opposite sign.
///
/// `tolerance` is relative to the root. `None` if the bracket holds no sign change or the method
/// has not converged after 200 evaluations (bisection alone would need about 60).
pub fn brent(
    f: impl Fn(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
    tolerance: f64,
) -> Option<Root> {
    if fa == 0.0 {
        return Some(Root { x: a, iterations: 0 });
    }
    if fb == 0.0 {
        return Some(Root { x: b, iterations: 0 });
    }
    // Written so that NaN is refused too.
    if fa.signum() == fb.signum() || fa.is_nan() || fb.is_nan() {
        return None;
    }
    let (mut c, mut fc) = (a, fa);
    let (mut step, mut last) = (b - a, b - a);
    for iterations in 0..200 {
        if fb.signum() == fc.signum() {
            (c, fc) = (a, fa);
            step = b - a;
            last = step;
        }
        if fc.abs() < fb.abs() {
            (a, fa) = (b, fb);
            (b, fb) = (c, fc);
            (c, fc) = (a, fa);
        }
        let width = f64::EPSILON * b.abs() + 0.5 * tolerance * b.abs();
        let middle = 0.5 * (c - b);
        if middle.abs() <= width || fb == 0.0 {
            return Some(Root { x: b, iterations });
        }
        let near = last.abs() >= width && fa.abs() > fb.abs();
        match near.then(|| interpolated([a, b, c], [fa, fb, fc], width, last)).flatten() {
            Some(found) => (last, step) = (step, found),
            None => (last, step) = (middle, middle),
        }
        (a, fa) = (b, fb);
        b += if step.abs() > width { step } else { width.copysign(middle) };
        fb = f(b);
        if fb.is_nan() {
            return None;
        }
    }
    None
}

/// Step from the second of three points towards the root by inverse quadratic interpolation, by the
/// secant where the first is the third; `None` where it leaves the bracket or does not halve the
/// last step but one.
#[inline]
fn interpolated([a, b, c]: [f64; 3], [fa, fb, fc]: [f64; 3], width: f64, last: f64) -> Option<f64> {
    let middle = 0.5 * (c - b);
    let s = fb / fa;
    let (mut p, mut q) = if a == c {
        (2.0 * middle * s, 1.0 - s)
    } else {
        let (q, r) = (fa / fc, fb / fc);
        (s * (2.0 * middle * q * (q - r) - (b - a) * (r - 1.0)), (q - 1.0) * (r - 1.0) * (s - 1.0))
    };
    if p > 0.0 {
        q = -q;
    } else {
        p = -p;
    }
    (2.0 * p < (3.0 * middle * q - (width * q).abs()).min((last * q).abs())).then(|| p / q)
}

/// The least value of a function on `[0, 1]`: the best of `steps` equal steps, then golden-section
/// search about it.
pub fn minimum(f: impl Fn(f64) -> f64, steps: u32) -> Root {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    const NARROWED: u32 = 80;
    let at = |i: u32| f64::from(i) / f64::from(steps);
    let mut best = 0;
    for i in 1..=steps {
        if f(at(i)) < f(at(best)) {
            best = i;
        }
    }
    let (mut low, mut high) = (at(best.saturating_sub(1)), at((best + 1).min(steps)));
    for _ in 0..NARROWED {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if f(left) <= f(right) {
            high = right;
        } else {
            low = left;
        }
    }
    let middle = 0.5 * (low + high);
    let x = [0.0, 1.0].into_iter().find(|end| f(*end) <= f(middle)).unwrap_or(middle);
    Root { x, iterations: 2 * (steps + NARROWED) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_is_exact_to_its_degree() {
        let rule = GaussLegendre::<24>::new();
        assert!((rule.weights.iter().sum::<f64>() - 2.0).abs() < 1e-14);
        for degree in 0..=47 {
            let exact = (2.0_f64.powi(degree + 1) - 1.0) / f64::from(degree + 1);
            let found = rule.integrate(1.0, 2.0, |x| x.powi(degree));
            assert!((found / exact - 1.0).abs() < 1e-13, "degree {degree}: {found} {exact}");
        }
    }

    #[test]
    fn brent_finds_roots_to_tolerance() {
        let f = |x: f64| x.cos() - x;
        let root = brent(f, (0.0, f(0.0)), (1.0, f(1.0)), 1e-15).unwrap();
        assert!((root.x - 0.739_085_133_215_160_6).abs() < 1e-15);
        assert!(root.iterations < 12);
    }

    #[test]
    fn brent_refuses_a_bracket_without_sign_change() {
        assert_eq!(brent(|x| x, (1.0, 1.0), (2.0, 2.0), 1e-14), None);
        assert_eq!(brent(|x| x, (1.0, f64::NAN), (2.0, 2.0), 1e-14), None);
    }
}
