//! A muscle known by its measured forces alone, `F(P, e)` over gauge pressure and contraction.
//!
//! The map is a grid of forces. Between its nodes the force is a bicubic Hermite polynomial: slopes
//! along both axes after F. N. Fritsch and J. Butland, *A method for constructing local monotone
//! piecewise cubic interpolants*, SIAM J. Sci. Stat. Comput. 5 (1984), as in PCHIP, the twist as the
//! slope of the slopes. Where the nodes of a cell rise or fall alike and its polynomial does not,
//! the slopes at its corners are made smaller until it does; without slopes it always does, since
//! the force is then a mean of the nodes with weights that are monotone themselves. The force and
//! its derivatives by pressure and contraction are continuous, so that sensitivities exist; a force
//! linear in pressure is met exactly. Outside the grid it goes on along straight lines.
//!
//! The muscle's geometry gives its volume only.

use crate::error::{check_range, Error, Result};
use crate::key;
use crate::keys::Key;
use crate::scalar::{constant, Scalar};

/// Nodes along pressure and along contraction at most.
pub const MOST_NODES: (usize, usize) = (200, 400);

/// Points along each side of a cell at which it is asked whether it is monotone.
const CHECKS: u32 = 8;
/// How often the slopes at the corners of a cell are halved before they are taken away.
const HALVINGS: u32 = 6;
/// Of the largest difference in a cell: what counts as no change.
const FLAT: f64 = 1e-9;

/// Coefficients of a cell, powers of both coordinates in `[0, 1]`: `[pressure][contraction]`.
type Cell = [[f64; 4]; 4];

/// Value and derivatives at a node, by the units of the axes: force, by pressure, by contraction,
/// by both.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    force: f64,
    by_pressure: f64,
    by_contraction: f64,
    twist: f64,
}

/// The forces of a map, compiled.
#[derive(Debug, Clone)]
pub struct MapSurface {
    pressure: Vec<f64>,
    contraction: Vec<f64>,
    cells: Vec<Cell>,
}

impl MapSurface {
    /// The surface of a table: gauge pressures [Pa], contraction ratios [1], and a row of forces
    /// [N] over the contractions for each pressure.
    ///
    /// # Errors
    /// As [`check`].
    pub fn of(pressure: &[f64], contraction: &[f64], force: &[f64]) -> Result<Self> {
        check(pressure, contraction, force)?;
        let (p, e) = (pressure.to_vec(), contraction.to_vec());
        let mut nodes = nodes(&p, &e, force);
        let (rows, columns) = (p.len() - 1, e.len() - 1);
        // A corner belongs to four cells: all are asked again until none changes.
        for round in 0..=HALVINGS {
            let wrong: Vec<_> = (0..rows * columns)
                .filter(|i| !monotone(&corners(&nodes, &p, &e, i / columns, i % columns)))
                .collect();
            if wrong.is_empty() {
                break;
            }
            let factor = if round == HALVINGS { 0.0 } else { 0.5 };
            for i in wrong {
                for at in [0, 1, e.len(), e.len() + 1] {
                    let node = &mut nodes[(i / columns) * e.len() + i % columns + at];
                    node.by_pressure *= factor;
                    node.by_contraction *= factor;
                    node.twist *= factor;
                }
            }
        }
        let cells = (0..rows * columns)
            .map(|i| polynomial(&corners(&nodes, &p, &e, i / columns, i % columns)))
            .collect();
        Ok(Self { pressure: p, contraction: e, cells })
    }

    /// Force [N] at gauge pressure `pressure` [Pa] and contraction ratio `e`.
    #[inline]
    pub fn force<S: Scalar>(&self, pressure: S, e: S) -> S {
        let (row, x, over) = place(&self.pressure, pressure);
        let (column, y, beyond) = place(&self.contraction, e);
        let cell = &self.cells[row * (self.contraction.len() - 1) + column];
        let zero = constant::<S>(0.0);
        let (mut value, mut by_x, mut by_y) = (zero, zero, zero);
        for power in (0..4).rev() {
            let [c0, c1, c2, c3] = cell[power];
            let along = ((y * c3 + c2) * y + c1) * y + c0;
            by_x = by_x * x + value;
            value = value * x + along;
            by_y = by_y * x + (y * (3.0 * c3) + 2.0 * c2) * y + c1;
        }
        value + by_x * over + by_y * beyond
    }
}

/// Cell of a value on an axis, where in it, and how far beyond the axis in units of the cell; a
/// value that is not a number stays one.
#[inline]
fn place<S: Scalar>(axis: &[f64], value: S) -> (usize, S, S) {
    let at = value.re();
    let last = axis.len() - 2;
    let cell = axis[1..=last].partition_point(|node| *node <= at);
    let width = axis[cell + 1] - axis[cell];
    let x = (value - axis[cell]) / width;
    if at < axis[0] {
        return (cell, constant(0.0), x);
    }
    if at > axis[last + 1] {
        return (cell, constant(1.0), x - 1.0);
    }
    (cell, x, constant(0.0))
}

/// Whether a map is one.
///
/// # Errors
/// [`Error::Parameter`] for an axis that does not rise or a value that is not possible,
/// [`Error::Length`] if there are not as many forces as nodes.
pub fn check(pressure: &[f64], contraction: &[f64], force: &[f64]) -> Result<()> {
    axis(key!("muscle", "map_pressure"), pressure, MOST_NODES.0)?;
    axis(key!("muscle", "map_contraction"), contraction, MOST_NODES.1)?;
    let expected = pressure.len() * contraction.len();
    if force.len() != expected {
        return Err(Error::Length {
            name: "muscle.map_force".into(),
            found: force.len(),
            expected,
            why: "a row over muscle.map_contraction for each muscle.map_pressure".into(),
        });
    }
    key!("muscle", "map_force").check_all("muscle", force)
}

fn axis(key: &Key, values: &[f64], most: usize) -> Result<()> {
    let count = format!("muscle.{} length", key.name);
    check_range(&count, values.len() as f64, 2.0, most as f64, "values")?;
    key.check_all("muscle", values)?;
    match (1..values.len()).find(|k| values[*k] <= values[k - 1]) {
        None => Ok(()),
        Some(k) => Err(Error::parameter(
            format!("muscle.{}[{k}]", key.name),
            values[k],
            format!("rising values, more than {}", values[k - 1]),
        )),
    }
}

/// All nodes, contraction fastest.
fn nodes(p: &[f64], e: &[f64], force: &[f64]) -> Vec<Node> {
    let (rows, columns) = (p.len(), e.len());
    let along_row = |values: &[f64]| -> Vec<f64> {
        (0..rows).flat_map(|i| slopes(e, &values[i * columns..(i + 1) * columns])).collect()
    };
    let along_column = |values: &[f64]| -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        for j in 0..columns {
            let column: Vec<f64> = (0..rows).map(|i| values[i * columns + j]).collect();
            for (i, slope) in slopes(p, &column).into_iter().enumerate() {
                out[i * columns + j] = slope;
            }
        }
        out
    };
    let (by_p, by_e) = (along_column(force), along_row(force));
    let (twist_e, twist_p) = (along_row(&by_p), along_column(&by_e));
    (0..force.len())
        .map(|k| Node {
            force: force[k],
            by_pressure: by_p[k],
            by_contraction: by_e[k],
            twist: 0.5 * (twist_e[k] + twist_p[k]),
        })
        .collect()
}

/// Slopes at the nodes of one axis: the weighted harmonic mean of those of the two neighbouring
/// intervals, zero where they differ in sign; at the ends that of the parabola, kept monotone.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let d: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / h[i]).collect();
    if n == 2 {
        return vec![d[0]; 2];
    }
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
        if slope * d0 <= 0.0 {
            0.0
        } else if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() {
            3.0 * d0
        } else {
            slope
        }
    };
    let mut out = vec![end(h[0], h[1], d[0], d[1])];
    for i in 1..n - 1 {
        let (before, after) = (d[i - 1], d[i]);
        out.push(if before * after <= 0.0 {
            0.0
        } else {
            let (w0, w1) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
            (w0 + w1) / (w0 / before + w1 / after)
        });
    }
    out.push(end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]));
    out
}

/// The corners of a cell with derivatives by its own coordinates: `[pressure][contraction]`.
fn corners(nodes: &[Node], p: &[f64], e: &[f64], row: usize, column: usize) -> [[Node; 2]; 2] {
    let (hp, he) = (p[row + 1] - p[row], e[column + 1] - e[column]);
    let at = |i: usize, j: usize| {
        let node = nodes[(row + i) * e.len() + column + j];
        Node {
            force: node.force,
            by_pressure: node.by_pressure * hp,
            by_contraction: node.by_contraction * he,
            twist: node.twist * hp * he,
        }
    };
    [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
}

/// Coefficients of the cubic with values and slopes at 0 and 1.
fn hermite(f0: f64, f1: f64, d0: f64, d1: f64) -> [f64; 4] {
    [f0, d0, 3.0 * (f1 - f0) - 2.0 * d0 - d1, 2.0 * (f0 - f1) + d0 + d1]
}

fn polynomial(c: &[[Node; 2]; 2]) -> Cell {
    let values = [0, 1].map(|i| {
        hermite(c[i][0].force, c[i][1].force, c[i][0].by_contraction, c[i][1].by_contraction)
    });
    let slopes = [0, 1]
        .map(|i| hermite(c[i][0].by_pressure, c[i][1].by_pressure, c[i][0].twist, c[i][1].twist));
    let mut cell = [[0.0; 4]; 4];
    for j in 0..4 {
        let along = hermite(values[0][j], values[1][j], slopes[0][j], slopes[1][j]);
        for (power, coefficient) in along.into_iter().enumerate() {
            cell[power][j] = coefficient;
        }
    }
    cell
}

/// Whether a cell rises or falls along each side as all its corners do.
fn monotone(c: &[[Node; 2]; 2]) -> bool {
    let cell = polynomial(c);
    let at = |x: f64, y: f64| {
        cell.iter()
            .rev()
            .fold(0.0, |sum, [c0, c1, c2, c3]| sum * x + ((c3 * y + c2) * y + c1) * y + c0)
    };
    let f = [[c[0][0].force, c[0][1].force], [c[1][0].force, c[1][1].force]];
    let by_p = [f[1][0] - f[0][0], f[1][1] - f[0][1]];
    let by_e = [f[0][1] - f[0][0], f[1][1] - f[1][0]];
    let size = by_p.iter().chain(&by_e).fold(0.0_f64, |most, change| most.max(change.abs()));
    let share = |k: u32| f64::from(k) / f64::from(CHECKS);
    let steps = |one: &dyn Fn(f64, f64) -> f64, sign: f64| {
        (0..=CHECKS).all(|i| {
            (0..CHECKS).all(|k| {
                sign * (one(share(k + 1), share(i)) - one(share(k), share(i))) >= -FLAT * size
            })
        })
    };
    let along = |changes: [f64; 2], one: &dyn Fn(f64, f64) -> f64| {
        changes.iter().product::<f64>() < 0.0 || steps(one, (changes[0] + changes[1]).signum())
    };
    along(by_p, &|s, t| at(s, t)) && along(by_e, &|s, t| at(t, s))
}

#[cfg(test)]
mod tests {
    use crate::dual::Slope;
    use crate::muscle::tests::shoulder;
    use crate::muscle::MuscleSpec;

    fn grid(p: &[f64], e: &[f64], force: impl Fn(f64, f64) -> f64) -> MuscleSpec {
        MuscleSpec {
            model: "map".into(),
            modulus_slope: Vec::new(),
            modulus_offset: Vec::new(),
            map_pressure: p.to_vec(),
            map_contraction: e.to_vec(),
            map_force: p.iter().flat_map(|p| e.iter().map(|e| force(*p, *e))).collect(),
            ..shoulder()
        }
    }

    fn axes() -> (Vec<f64>, Vec<f64>) {
        let p = [0.0, 0.5, 1.0, 2.0, 3.5, 6.0].map(|p| 1e5 * p).to_vec();
        (p, (0..9).map(|k| -0.02 + 0.03 * f64::from(k) + 0.001 * f64::from(k * k)).collect())
    }

    fn sharp(p: f64, e: f64) -> f64 {
        // hardly a force below a threshold, then saturating: hard for cubics
        900.0 * (1.0 + ((p - 1.5e5) / 3e4).tanh()) * (1.0 - 3.0 * e) - 4e3 * e.powi(3)
    }

    #[test]
    fn nodes_are_met_and_what_is_linear_in_pressure_is_exact() {
        let (p, e) = axes();
        let law = |p: f64, e: f64| 2e-3 * p * (1.0 - 3.0 * e) - 400.0 * e;
        let surface = grid(&p, &e, law).surface().unwrap().unwrap();
        for p in [-5e4, 0.0, 3.3e4, 1e5, 2.9e5, 6e5, 7e5] {
            for e in &e {
                assert!((surface.force(p, *e) - law(p, *e)).abs() < 1e-9, "{p} {e}");
            }
            assert!((surface.force(p, 0.111) - law(p, 0.111)).abs() < 1e-9);
        }
        let surface = grid(&p, &e, sharp).surface().unwrap().unwrap();
        for p in &p {
            for e in &e {
                assert!((surface.force(*p, *e) - sharp(*p, *e)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn it_is_monotone_where_its_nodes_are() {
        let (p, e) = axes();
        let spec = grid(&p, &e, sharp);
        let surface = spec.surface().unwrap().unwrap();
        let line = |k: u32, low: f64, high: f64| low + (high - low) * f64::from(k) / 300.0;
        for i in 0..=300 {
            for k in 0..300 {
                let (q, x) = (line(i, 0.0, 6e5), line(i, e[0], e[8]));
                let falls = surface.force(q, line(k + 1, e[0], e[8]))
                    - surface.force(q, line(k, e[0], e[8]));
                assert!(falls <= 1e-6, "{q} Pa");
                let rises =
                    surface.force(line(k + 1, 0.0, 6e5), x) - surface.force(line(k, 0.0, 6e5), x);
                assert!(rises >= -1e-6, "{x}");
            }
        }
    }

    #[test]
    fn slopes_are_continuous_and_those_of_dual_numbers() {
        let (p, e) = axes();
        let surface = grid(&p, &e, sharp).surface().unwrap().unwrap();
        for q in [-1e4, 2e4, 1e5, 1.7e5, 6.5e5] {
            for x in [-0.05, 0.0, e[3], 0.1, 0.4] {
                let by_p = surface.force(Slope::new(q, 1.0), Slope::from(x)).slope();
                let by_e = surface.force(Slope::from(q), Slope::new(x, 1.0)).slope();
                let change =
                    |a: f64, b: f64| surface.force(q + a, x + b) - surface.force(q - a, x - b);
                assert!((by_p - change(1.0, 0.0) / 2.0).abs() < 2e-6, "{q} {x}");
                assert!((by_e - change(0.0, 1e-6) / 2e-6).abs() < 0.5, "{q} {x}");
            }
        }
        assert!(surface.force(f64::NAN, 0.1).is_nan());
        assert!(surface.force(1e5, f64::NAN).is_nan());
    }

    #[test]
    fn what_is_no_map_is_named() {
        let (p, e) = axes();
        let good = grid(&p, &e, sharp);
        type Change = fn(&mut MuscleSpec);
        let changes: [(&str, Change); 6] = [
            ("muscle.map_pressure length = 1", |s| s.map_pressure.truncate(1)),
            ("muscle.map_contraction[2]", |s| s.map_contraction[2] = 0.0),
            ("muscle.map_pressure[0]", |s| s.map_pressure[0] = -2e5),
            ("muscle.map_force has 53 values, 54", |s| s.map_force.truncate(53)),
            ("muscle.map_force[7] = NaN", |s| s.map_force[7] = f64::NAN),
            ("muscle.modulus_slope", |s| s.modulus_slope = vec![1.0]),
        ];
        assert!(good.validate().is_ok());
        for (name, change) in changes {
            let mut spec = good.clone();
            change(&mut spec);
            let message = spec.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{name}: {message}");
        }
        let mut other = shoulder();
        other.map_force = vec![1.0];
        assert!(other.validate().unwrap_err().to_string().contains("muscle.map_force"));
        let mut empty = good;
        empty.map_force.clear();
        assert!(empty.validate().unwrap_err().to_string().contains("muscle.map_force"));
    }
}
