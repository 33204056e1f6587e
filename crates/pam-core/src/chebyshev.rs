//! Polynomials through values at Chebyshev-Lobatto points (L. N. Trefethen, *Approximation Theory and
//! Approximation Practice*, ch. 2-4).

/// The j-th of the Chebyshev-Lobatto points of a degree, from 1 down to -1.
pub(crate) fn lobatto(j: usize, degree: usize) -> f64 {
    (std::f64::consts::PI * j as f64 / degree as f64).cos()
}

/// Monomial coefficients, lowest power first, of the interpolants through `NODES` values of each
/// column at the Chebyshev-Lobatto points of the degree `NODES - 1`.
pub(crate) fn interpolate<const NODES: usize, const COLUMNS: usize>(
    values: &[[f64; COLUMNS]; NODES],
) -> [[f64; COLUMNS]; NODES] {
    let degree = NODES - 1;
    let half_at_ends = |j: usize| if j == 0 || j == degree { 0.5 } else { 1.0 };
    let mut cell = [[0.0; COLUMNS]; NODES];
    // Chebyshev polynomials T_k in powers of x, by their recurrence.
    let (mut before, mut current) = ([0.0; NODES], [0.0; NODES]);
    current[0] = 1.0;
    for k in 0..NODES {
        for i in 0..COLUMNS {
            let sum: f64 = (0..NODES)
                .map(|j| {
                    // The angle reduced first: exact zeros and signs of the cosine.
                    let angle = (j * k) % (2 * degree);
                    half_at_ends(j) * values[j][i] * lobatto(angle, degree)
                })
                .sum();
            let chebyshev = sum * half_at_ends(k) * 2.0 / degree as f64;
            for power in 0..=k {
                cell[power][i] += chebyshev * current[power];
            }
        }
        let factor = if k == 0 { 1.0 } else { 2.0 };
        let mut next = [0.0; NODES];
        for power in 0..NODES {
            let shifted = if power == 0 { 0.0 } else { current[power - 1] };
            next[power] = factor * shifted - before[power];
        }
        before = current;
        current = next;
    }
    cell
}
