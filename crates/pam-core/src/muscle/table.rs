//! The compiled muscle: force coefficients and air volume as piecewise polynomials of contraction.
//!
//! Equations: `F = P a_gas + scale (P a_elastic + b_elastic)` and `V(e)` of the parent modules,
//! each replaced by polynomials of degree [`DEGREE`] that interpolate the exact solve at the
//! Chebyshev-Lobatto points of uniform cells (L. N. Trefethen, *Approximation Theory and
//! Approximation Practice*, ch. 2-4): continuous across cells, found in constant time. Cells never
//! cross a kink of the geometry: pieces end exactly at `e = 0` and where the braid becomes taut.
//! `volume_slope` is the derivative of the volume's polynomial, so the two never disagree.
//!
//! In extension the root of a wide muscle can vanish in a fold before the braid is taut, where the
//! slopes are unbounded; the table then starts short of the fold.
//!
//! Each piece is refined until every column agrees with the exact solve (the slope with the
//! implicitly differentiated one) at points off the nodes; the largest disagreement found is
//! [`Table::error_bound`].

use crate::dual::Slope;

use super::elasticity::Elasticity;
use crate::braid::MuscleGeometry;
use crate::chebyshev::{interpolate, lobatto};
use crate::error::{Error, Result};
use crate::scalar::{chained, constant, Scalar};

/// Degree of the polynomials.
pub const DEGREE: usize = 9;
/// The largest error a table may have, relative as in [`Table::error_bound`].
pub const TOLERANCE: f64 = 1e-9;

const NODES: usize = DEGREE + 1;
/// a_gas, a_elastic, b_elastic, volume, volume_slope.
const COLUMNS: usize = 5;
const NAMES: [&str; COLUMNS] = ["a_gas", "a_elastic", "b_elastic", "volume", "volume_slope"];
const VOLUME: usize = 3;
const SLOPE: usize = 4;
/// Of the largest slope: a smaller jump is rounding where two pieces of a smooth volume meet.
const SMOOTH: f64 = 1e-6;
/// Refinement goes on to this error where the cells allow it.
const AIM: f64 = 1e-10;
/// Cells of one piece at most.
const MOST_CELLS: usize = 1024;
/// Where a piece in extension is not smooth up to its far end, the table starts at this fraction
/// of it, and again, at most [`MOST_CUTS`] times, at last at zero.
const CUT: f64 = 0.8;
const MOST_CUTS: u32 = 8;
/// Check points in a cell, in units of its half-width; none is a node.
const CHECKS: [f64; 7] = [-0.993, -0.86, -0.41, 0.087, 0.33, 0.71, 0.985];
/// The least range of contraction that a table is made for.
const LEAST_RANGE: f64 = 0.01;
/// Volumes below this fraction of the largest are compared with that fraction.
const VOLUME_FLOOR: f64 = 1e-3;

/// Value of every column at one contraction ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TablePoint<S = f64> {
    /// Force per gauge pressure, braid and wall [m2].
    pub a_gas: S,
    /// Force per gauge pressure of the moduli's slopes, for scale 1 [m2].
    pub a_elastic: S,
    /// Force of the moduli's offsets, for scale 1 [N].
    pub b_elastic: S,
    /// Air volume of one muscle [m3].
    pub volume: S,
    /// `dV/de` [m3].
    pub volume_slope: S,
}

impl<S: Scalar> TablePoint<S> {
    fn from_columns([a_gas, a_elastic, b_elastic, volume, volume_slope]: [S; COLUMNS]) -> Self {
        Self { a_gas, a_elastic, b_elastic, volume, volume_slope }
    }

    /// Force of one muscle [N] at gauge pressure `pressure` [Pa].
    #[inline]
    pub fn force(&self, pressure: S, modulus_scale: S) -> S {
        pressure * self.a_gas + modulus_scale * (pressure * self.a_elastic + self.b_elastic)
    }
}

/// Polynomials of all columns over one cell, powers of `x` in `[-1, 1]`, lowest first.
type Cell = [[f64; COLUMNS]; NODES];

/// Uniform cells between two breakpoints.
#[derive(Debug, Clone, Copy)]
struct Piece {
    start: f64,
    cells_per_unit: f64,
    first: usize,
    last: usize,
}

/// Straight continuation of every column beyond one end of the table.
#[derive(Debug, Clone, Copy)]
struct Continuation {
    value: [f64; COLUMNS],
    slope: [f64; COLUMNS],
}

/// Where the slope of the volume jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kink {
    /// Contraction ratio.
    pub at: f64,
    /// `dV/de` [m3] of one muscle above it less that below it.
    pub jump: f64,
}

/// What came of one choice of pieces.
enum Assembled {
    Table(Box<Table>),
    Rough { start: f64, stop: f64, column: usize, error: f64 },
}

/// A muscle's force coefficients and volume, compiled over contraction.
#[derive(Debug, Clone)]
pub struct Table {
    /// Smallest contraction ratio of the table: the braid's full length, or nearer to zero where
    /// the radius of a wide or thick-walled muscle collapses with an unbounded slope.
    pub e_min: f64,
    /// Largest contraction ratio of the table.
    pub e_max: f64,
    pieces: Vec<Piece>,
    cells: Vec<Cell>,
    below: Continuation,
    above: Continuation,
    errors: [f64; COLUMNS],
    kinks: Vec<Kink>,
}

impl Table {
    /// Compiles a geometry with a force model and its elastic parameters.
    ///
    /// # Errors
    /// [`Error::Model`] if the geometry has no usable range of contraction, or a column cannot be
    /// brought below [`TOLERANCE`].
    pub fn compile(geometry: &MuscleGeometry, elasticity: &Elasticity) -> Result<Self> {
        let exact = Exact { geometry, elasticity };
        let (low, high) = geometry.range();
        let e_max = exact.solved_up_to(high);
        if e_max <= LEAST_RANGE {
            return Err(Error::Model("muscle: the geometry has no solution in contraction".into()));
        }
        let kinks = geometry.kinks()?;
        let mut e_min = exact.solved_up_to(low);
        let mut cuts = 0;
        loop {
            let mut ends = vec![e_min];
            ends.extend(kinks.iter().filter(|k| **k > e_min));
            ends.extend([0.0, e_max]);
            ends.dedup();
            match Self::assemble(&exact, &ends)? {
                Assembled::Table(table) => return Ok(*table),
                Assembled::Rough { start, stop, .. } if stop <= 0.0 && cuts <= MOST_CUTS => {
                    e_min = if cuts < MOST_CUTS { stop + CUT * (start - stop) } else { 0.0 };
                    cuts += 1;
                }
                Assembled::Rough { column, error, .. } => {
                    return Err(Error::Model(format!(
                        "muscle: the table of {} reaches a relative error of {error:.1e} only, \
                         {TOLERANCE:.0e} is needed: the geometry of this muscle is not smooth \
                         enough between its kinks",
                        NAMES[column]
                    )));
                }
            }
        }
    }

    /// The table whose smooth pieces end at `ends`, or the first piece that is not smooth enough.
    fn assemble(exact: &Exact, ends: &[f64]) -> Result<Assembled> {
        let (e_min, e_max) = (ends[0], ends[ends.len() - 1]);
        let scales = exact.scales(e_min, e_max)?;
        let (mut pieces, mut cells) = (Vec::new(), Vec::new());
        let mut errors = [0.0_f64; COLUMNS];
        for pair in ends.windows(2).rev() {
            let (start, stop) = (pair[0], pair[1]);
            let (fitted, found) = exact.refine(start, stop, &scales)?;
            for (column, error) in found.into_iter().enumerate() {
                if error.is_nan() || error > TOLERANCE {
                    return Ok(Assembled::Rough { start, stop, column, error });
                }
                errors[column] = errors[column].max(error);
            }
            // In the order of use: contraction first.
            pieces.push(Piece {
                start,
                cells_per_unit: fitted.len() as f64 / (stop - start),
                first: cells.len(),
                last: fitted.len() - 1,
            });
            cells.extend(fitted);
        }
        let kinks = pieces.windows(2).map(|pair: &[Piece]| {
            let (above, below) = (&cells[pair[0].first], &cells[pair[1].first + pair[1].last]);
            let jump = evaluate(above, -1.0_f64)[SLOPE] - evaluate(below, 1.0_f64)[SLOPE];
            Kink { at: pair[0].start, jump }
        });
        let kinks = kinks.filter(|kink| kink.jump.abs() > SMOOTH * scales[SLOPE]).collect();
        let idle = Continuation { value: [0.0; COLUMNS], slope: [0.0; COLUMNS] };
        let mut table =
            Self { e_min, e_max, pieces, cells, below: idle, above: idle, errors, kinks };
        table.below = table.continuation(e_min);
        table.above = table.continuation(e_max);
        Ok(Assembled::Table(Box::new(table)))
    }

    /// Every column at contraction ratio `e`, with derivatives when `S` carries them.
    ///
    /// Outside `e_min ..= e_max` the columns go on along straight lines ([`Table::contains`]
    /// tells). NaN gives NaN.
    #[inline]
    pub fn eval<S: Scalar>(&self, e: S) -> TablePoint<S> {
        let at = e.re();
        if at < self.e_min {
            return self.below.eval(e - self.e_min);
        }
        if at > self.e_max {
            return self.above.eval(e - self.e_max);
        }
        self.inside(at, e)
    }

    /// Whether `e` is inside the table.
    #[inline]
    #[must_use]
    pub fn contains(&self, e: f64) -> bool {
        e >= self.e_min && e <= self.e_max
    }

    /// Largest error found against the exact solve: relative to the largest magnitude of the
    /// column over the table, for the volume relative to its own value (below a thousandth of the
    /// largest volume: to that thousandth).
    #[must_use]
    pub fn error_bound(&self) -> f64 {
        self.errors.iter().copied().fold(0.0, f64::max)
    }

    /// The error of each column: a_gas, a_elastic, b_elastic, volume, volume_slope.
    #[must_use]
    pub fn errors(&self) -> [f64; COLUMNS] {
        self.errors
    }

    /// The ends of the smooth pieces, ascending.
    #[must_use]
    pub fn breakpoints(&self) -> Vec<f64> {
        self.pieces.iter().rev().map(|p| p.start).chain([self.e_max]).collect()
    }

    /// Where the slope of the volume jumps, inside the table.
    #[must_use]
    pub fn volume_kinks(&self) -> &[Kink] {
        &self.kinks
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    #[inline(always)]
    fn inside<S: Scalar>(&self, at: f64, e: S) -> TablePoint<S> {
        let mut piece = &self.pieces[0];
        for candidate in &self.pieces {
            piece = candidate;
            if at >= candidate.start {
                break;
            }
        }
        let position = (at - piece.start) * piece.cells_per_unit;
        let cell = (position as usize).min(piece.last);
        let x = (e - piece.start) * (2.0 * piece.cells_per_unit) - (2 * cell + 1) as f64;
        let cell = &self.cells[piece.first + cell];
        let columns =
            if S::DERIVATIVES == 0 { evaluate(cell, x) } else { chained(x, |x| evaluate(cell, x)) };
        TablePoint::from_columns(columns)
    }

    fn continuation(&self, e: f64) -> Continuation {
        let p = self.inside(e, Slope::new(e, 1.0));
        let columns = [p.a_gas, p.a_elastic, p.b_elastic, p.volume, p.volume_slope];
        let mut slope = columns.map(|c| c.slope());
        slope[VOLUME] = p.volume_slope.re;
        slope[SLOPE] = 0.0;
        Continuation { value: columns.map(|c| c.re), slope }
    }
}

impl Continuation {
    #[cold]
    fn eval<S: Scalar>(&self, beyond: S) -> TablePoint<S> {
        let mut columns = [constant::<S>(0.0); COLUMNS];
        for (i, column) in columns.iter_mut().enumerate() {
            *column = beyond * self.slope[i] + self.value[i];
        }
        TablePoint::from_columns(columns)
    }
}

/// All columns at `x`: even and odd powers in two Horner chains of half the length.
#[inline(always)]
fn evaluate<S: Scalar>(cell: &Cell, x: S) -> [S; COLUMNS] {
    let square = x * x;
    let mut even = cell[DEGREE - 1].map(constant::<S>);
    let mut odd = cell[DEGREE].map(constant::<S>);
    for power in (0..DEGREE - 1).rev().step_by(2) {
        for i in 0..COLUMNS {
            odd[i] = odd[i] * square + cell[power][i];
            even[i] = even[i] * square + cell[power - 1][i];
        }
    }
    for i in 0..COLUMNS {
        even[i] += odd[i] * x;
    }
    even
}

/// The exact columns and the fit to them.
struct Exact<'a> {
    geometry: &'a MuscleGeometry,
    elasticity: &'a Elasticity,
}

impl Exact<'_> {
    /// The columns at `e`; without the slope (zero) in the values used for fitting.
    fn columns(&self, e: f64) -> Result<[f64; COLUMNS]> {
        let shape = self.geometry.solve(e)?;
        let force = self.elasticity.coefficients(self.geometry.braid(), &shape);
        Ok([force.a_gas, force.a_elastic, force.b_elastic, shape.air_volume, 0.0])
    }

    /// The columns at `e`, the slope by implicit differentiation of the solve.
    fn columns_and_slope(&self, e: f64) -> Result<[f64; COLUMNS]> {
        let mut columns = self.columns(e)?;
        columns[SLOPE] = self.geometry.solve_dual(e)?.air_volume.slope();
        Ok(columns)
    }

    /// How far from rest towards `end` the geometry solves, with its derivatives, without a gap.
    fn solved_up_to(&self, end: f64) -> f64 {
        const STEPS: u32 = 64;
        let solves = |e: f64| self.geometry.solve_dual(e).is_ok();
        let mut good = 0.0;
        for i in 1..=STEPS {
            let next = if i == STEPS { end } else { end * f64::from(i) / f64::from(STEPS) };
            if !solves(next) {
                let mut bad = next;
                for _ in 0..60 {
                    let middle = 0.5 * (good + bad);
                    if solves(middle) {
                        good = middle;
                    } else {
                        bad = middle;
                    }
                }
                // A margin of one percent: the derivatives may be unbounded at the very end.
                return 0.99 * good;
            }
            good = next;
        }
        end
    }

    /// Largest magnitude of each column.
    fn scales(&self, low: f64, high: f64) -> Result<[f64; COLUMNS]> {
        let mut scales = [f64::MIN_POSITIVE; COLUMNS];
        for i in 0..=64 {
            let e = (low + (high - low) * f64::from(i) / 64.0).clamp(low, high);
            for (scale, value) in scales.iter_mut().zip(self.columns_and_slope(e)?) {
                *scale = scale.max(value.abs());
            }
        }
        Ok(scales)
    }

    /// Cells of one piece, doubled until the error is below [`AIM`] or no longer falls.
    fn refine(
        &self,
        start: f64,
        stop: f64,
        scales: &[f64; COLUMNS],
    ) -> Result<(Vec<Cell>, [f64; COLUMNS])> {
        let mut best: Option<(Vec<Cell>, [f64; COLUMNS], f64)> = None;
        let mut count = 1;
        loop {
            let (cells, errors, worst) = self.fit(start, stop, count, scales)?;
            let previous = best.as_ref().map_or(f64::INFINITY, |b| b.2);
            let stalled = previous <= TOLERANCE && worst > 0.5 * previous;
            if !stalled {
                best = Some((cells, errors, worst));
            }
            count *= 2;
            if worst <= AIM || stalled || count > MOST_CELLS {
                break;
            }
        }
        best.map(|(cells, errors, _)| (cells, errors))
            .ok_or_else(|| Error::Model("muscle: no table could be fitted".into()))
    }

    /// `count` cells over a piece, the error of each column and the largest of them; stops at the
    /// first cell that is far from [`TOLERANCE`].
    fn fit(
        &self,
        start: f64,
        stop: f64,
        count: usize,
        scales: &[f64; COLUMNS],
    ) -> Result<(Vec<Cell>, [f64; COLUMNS], f64)> {
        let width = (stop - start) / count as f64;
        let at = |cell: usize, x: f64| {
            (start + (cell as f64 + 0.5 + 0.5 * x) * width).clamp(start, stop)
        };
        let mut cells = Vec::with_capacity(count);
        let mut errors = [0.0_f64; COLUMNS];
        for index in 0..count {
            let mut values = [[0.0; COLUMNS]; NODES];
            for (j, value) in values.iter_mut().enumerate() {
                *value = self.columns(at(index, lobatto(j, DEGREE)))?;
            }
            let mut cell = interpolate(&values);
            for power in 0..DEGREE {
                cell[power][SLOPE] = cell[power + 1][VOLUME] * (power + 1) as f64 * 2.0 / width;
            }
            for x in CHECKS {
                let exact = self.columns_and_slope(at(index, x))?;
                let found: [f64; COLUMNS] = evaluate(&cell, x);
                for i in 0..COLUMNS {
                    let scale = if i == VOLUME {
                        exact[i].abs().max(VOLUME_FLOOR * scales[i])
                    } else {
                        scales[i]
                    };
                    let error = (found[i] - exact[i]).abs() / scale;
                    // `max` would drop NaN.
                    errors[i] = if error <= errors[i] { errors[i] } else { error };
                }
            }
            cells.push(cell);
            if errors.iter().any(|e| e.is_nan() || *e > 1e3 * TOLERANCE) {
                break;
            }
        }
        let worst = errors.iter().copied().fold(0.0, f64::max);
        Ok((cells, errors, worst))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::tests::{elbow, shoulder, thick};
    use crate::muscle::{CompiledMuscle, Muscle, MuscleSpec};

    fn compiled(spec: &MuscleSpec) -> CompiledMuscle {
        CompiledMuscle::new(Muscle::new(spec).unwrap()).unwrap()
    }

    fn muscles() -> Vec<(MuscleSpec, CompiledMuscle)> {
        let mut cylinder = shoulder();
        cylinder.geometry = Some("cylinder".into());
        [shoulder(), elbow(), thick(), cylinder]
            .into_iter()
            .map(|s| (s.clone(), compiled(&s)))
            .collect()
    }

    #[test]
    fn interpolation_reproduces_a_polynomial() {
        let p = |x: f64| 1.0 - 2.0 * x + 0.5 * x.powi(5) - 0.25 * x.powi(9);
        let mut values = [[0.0; COLUMNS]; NODES];
        for (j, v) in values.iter_mut().enumerate() {
            v[0] = p(lobatto(j, DEGREE));
        }
        let cell = interpolate(&values);
        for x in [-1.0, -0.3, 0.0, 0.77, 1.0] {
            let found: [f64; COLUMNS] = evaluate(&cell, x);
            assert!((found[0] - p(x)).abs() < 1e-13, "{x}: {}", found[0]);
        }
    }

    #[test]
    fn error_bound_holds_between_the_nodes() {
        for (spec, muscle) in muscles() {
            let table = &muscle.table;
            assert!(table.error_bound() <= TOLERANCE);
            println!(
                "{} R0 {}: {} cells, errors {:?}, breakpoints {:?}",
                spec.geometry.as_deref().unwrap_or("-"),
                0.5 * spec.rest_diameter,
                table.cells(),
                table.errors(),
                table.breakpoints()
            );
            let points: Vec<f64> = (0..=3000)
                .map(|i| table.e_min + (table.e_max - table.e_min) * f64::from(i) / 3000.0)
                .collect();
            let largest =
                points.iter().map(|e| muscle.exact.coefficients(*e).unwrap().b_elastic.abs());
            let largest = largest.fold(0.0, f64::max);
            for e in points {
                let point: TablePoint = table.eval(e);
                let shape = muscle.exact.geometry.solve_dual(e).unwrap();
                assert!((point.volume / shape.air_volume.re - 1.0).abs() < 2e-9, "{e}");
                assert!((point.volume_slope - shape.air_volume.slope()).abs() < 2e-9 * 6e-3, "{e}");
                let exact = muscle.exact.coefficients(e).unwrap();
                assert!((point.b_elastic - exact.b_elastic).abs() < 2e-9 * largest, "{e}");
            }
        }
    }

    #[test]
    fn breakpoints_hold_the_kinks_exactly() {
        let muscle = compiled(&shoulder());
        let ends = muscle.table.breakpoints();
        assert!(ends.contains(&0.0));
        let kink = ends[1];
        assert!(kink < 0.0 && kink > ends[0]);
        assert!(muscle.exact.geometry.solve(kink - 1e-12).unwrap().braid_taut);
        assert!(!muscle.exact.geometry.solve(kink + 1e-12).unwrap().braid_taut);
        assert_eq!(muscle.table.e_max, muscle.exact.geometry.range().1);
    }

    #[test]
    fn derivatives_come_out_of_dual_numbers() {
        for (_, muscle) in muscles() {
            for e in [-0.03, -0.02, -0.003, 0.0, 0.004, 0.1, 0.33] {
                if !muscle.table.contains(e) {
                    continue;
                }
                let point = muscle.table.eval(Slope::new(e, 1.0));
                let plain: TablePoint = muscle.table.eval(e);
                assert_eq!(point.volume.re, plain.volume);
                let relative = point.volume.slope() / plain.volume_slope - 1.0;
                assert!(relative.abs() < 1e-12, "{e}: {relative:e}");
                let shape = muscle.exact.geometry.solve_dual(e).unwrap();
                let elasticity = Elasticity::contracting(&muscle.exact.spec).unwrap();
                let exact = elasticity.coefficients(muscle.exact.geometry.braid(), &shape);
                assert!((point.a_gas.slope() / exact.a_gas.slope() - 1.0).abs() < 1e-5, "{e}");
                assert!(
                    (point.b_elastic.slope() / exact.b_elastic.slope() - 1.0).abs() < 1e-5,
                    "{e}"
                );
            }
        }
    }

    #[test]
    fn wide_muscles_compile_short_of_their_fold() {
        for (angle, diameter, wall) in
            [(80.0_f64, 0.0375, 0.003), (84.0, 0.025, 0.0025), (78.0, 0.0508, 0.004)]
        {
            let mut spec = shoulder();
            (spec.rest_length, spec.rest_diameter) = (0.25, diameter);
            (spec.braid_angle, spec.wall_thickness) = (angle.to_radians(), wall);
            let muscle = compiled(&spec);
            assert!(muscle.table.error_bound() <= TOLERANCE);
            assert!(
                muscle.table.e_min >= muscle.exact.geometry.range().0 && muscle.table.contains(0.0)
            );
            let point: TablePoint = muscle.table.eval(muscle.table.e_min - 1e-3);
            assert!(point.volume.is_finite());
        }
    }

    #[test]
    fn continues_along_straight_lines_outside() {
        let muscle = compiled(&shoulder());
        let table = &muscle.table;
        for (edge, out) in [(table.e_min, -0.01), (table.e_max, 0.01)] {
            assert!(!table.contains(edge + out));
            let (at, one): (TablePoint, TablePoint) = (table.eval(edge), table.eval(edge + out));
            assert!((one.volume - at.volume - out * at.volume_slope).abs() < 1e-15);
            assert_eq!(one.volume_slope, at.volume_slope);
            let near: TablePoint = table.eval(edge + 1e-9 * out);
            assert!((near.a_gas / at.a_gas - 1.0).abs() < 1e-8);
        }
        let nan: TablePoint = table.eval(f64::NAN);
        assert!(nan.volume.is_nan());
    }
}
