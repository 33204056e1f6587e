//! What a group of muscles does to its joint and its chamber, as polynomials of the angle.
//!
//! A lane has no time to find the tendon's length and then the muscle's table cell by cell. Joint,
//! table and count are functions of the angle alone; their products are interpolated over uniform
//! cells, refined until they agree with [`crate::blocks::joint::Joint::eval`] and
//! [`crate::muscle::Table::eval`] at points off the nodes. No cell crosses a kink of the muscle.

use super::num::{side_by_side, Aligned, Num, Registers, MOST_LANES, PAIR, WHOLE};
use crate::chebyshev::{interpolate, lobatto};
use crate::muscle::Pushed;
use crate::plant::Group;
use pulp::Simd;

/// Torque per gauge pressure of braid and wall [m3], of the moduli's slopes for scale 1 [m3],
/// torque of their offsets for scale 1 [N m]; air volume [m3] and its slope [m3/rad]; then the
/// first three again for the power of the muscles, which a printed joint does not pass on whole.
pub(crate) const COLUMNS: usize = 8;
const DEGREE: usize = 5;
const NODES: usize = DEGREE + 1;
const VOLUME: usize = 3;
const SLOPE: usize = 4;
/// A cell: its powers, of the distance from its middle in its width, one after the other, all
/// columns of each, which are one line of the cache.
type Cell = Aligned<[f64; NODES * COLUMNS]>;

const _: () = assert!(COLUMNS * size_of::<f64>() == align_of::<Cell>());

/// Largest error, relative to the largest magnitude of each column.
pub(crate) const TOLERANCE: f64 = 1e-9;
/// Cells are halved until the error is below this.
const AIM: f64 = 2e-10;
const MOST_CELLS: usize = 1024;
/// Check points in a cell, in units of its half-width; none is a node.
const CHECKS: [f64; 5] = [-0.93, -0.55, 0.07, 0.62, 0.95];
/// Points at which kinks are looked for.
const SCAN: usize = 512;

/// Uniform cells between two kinks: the number of a cell follows its coordinate.
#[derive(Debug, Clone, Copy)]
struct Piece {
    start: f64,
    cells_per_unit: f64,
    /// Number of the middle of the first cell, less that of zero.
    offset: f64,
    /// Numbers of its first and of its last cell, in the last digits.
    first: f64,
    last: f64,
}

impl Piece {
    /// What its cells are found by: cells per unit, offset, the first and the last one.
    #[inline(always)]
    fn numbers<S: Simd, R: Registers>(&self, of: Num<S, R>) -> [Num<S, R>; 4] {
        let Self { cells_per_unit, offset, first, last, .. } = *self;
        [of.constant(cells_per_unit), of.constant(offset), of.constant(first), of.constant(last)]
    }
}

/// What the torque of muscles that pull does to the coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sign {
    Raises,
    Lowers,
}

/// All columns of one group over a range of its coordinate.
#[derive(Debug, Clone)]
pub(crate) struct Curves {
    pub low: f64,
    pub high: f64,
    /// Of muscles that go slack the sign of the torque with which they pull: of the other one they
    /// have none.
    pub pulls: Option<Sign>,
    first: Piece,
    others: Vec<Piece>,
    cells: Vec<Cell>,
    /// In the place of a cell that is not there: no number finds none.
    none: Cell,
}

impl Curves {
    /// Curves over a range [rad, or m of shortening] in which the muscle's table and the joint
    /// hold; none where they are not smooth enough.
    pub fn new(group: &Group, low: f64, high: f64) -> Option<Self> {
        let pulls = match group.muscle.pushed() {
            Pushed::Slack => Some(turning(group, low, high)?),
            _ => None,
        };
        let mut ends = vec![low];
        ends.extend(kinks(group, low, high));
        ends.push(high);
        let scales = scales(group, low, high);
        let (mut pieces, mut cells) = (Vec::new(), Vec::new());
        for pair in ends.windows(2) {
            let fitted = refined(group, pair[0], pair[1], &scales)?;
            let cells_per_unit = fitted.len() as f64 / (pair[1] - pair[0]);
            let offset = cells.len() as f64 - 0.5 - pair[0] * cells_per_unit;
            let first = cells.len() as f64 + WHOLE;
            cells.extend(fitted.iter().map(stored));
            let last = cells.len() as f64 - 1.0 + WHOLE;
            pieces.push(Piece { start: pair[0], cells_per_unit, offset, first, last });
        }
        let mut pieces = pieces.into_iter();
        let (first, others) = (pieces.next()?, pieces.collect());
        Some(Self { low, high, pulls, first, others, cells, none: Aligned([0.0; NODES * COLUMNS]) })
    }

    /// The columns at an angle of each lane, worked out in registers of some width; beyond the range
    /// its end.
    #[inline(always)]
    pub fn eval<W: Simd, S: Simd, R: Registers>(
        &self,
        wide: W,
        simd: S,
        at: Num<S, R>,
    ) -> [Num<S, R>; COLUMNS] {
        let (cell, x) = self.place(at.or_above(self.low).or_below(self.high));
        let square = x * x;
        let mut columns = [at; COLUMNS];
        if side_by_side::<S, R>() == 1 {
            let mut row = Aligned([0.0; COLUMNS]);
            let place = [x.numbers()[0], square.numbers()[0]];
            self.row(wide, cell.numbers()[0], place, &mut row.0);
            for (column, value) in columns.iter_mut().zip(row.0) {
                *column = at.constant(value);
            }
            return columns;
        }
        for register in 0..R::COUNT {
            let mut rows = Aligned([0.0; COLUMNS * MOST_LANES / PAIR]);
            let lanes = rows.0.chunks_exact_mut(COLUMNS).take(S::F64_LANES);
            for (row, lane) in lanes.zip(register * S::F64_LANES..) {
                let place = [x.numbers()[lane], square.numbers()[lane]];
                self.row(wide, cell.numbers()[lane], place, row);
            }
            Num::turn(simd, &rows.0, &mut columns, register);
        }
        columns
    }

    /// All columns at a place of one cell and the square of it, see [`Self::place`].
    #[inline(always)]
    fn row<W: Simd>(&self, wide: W, cell: f64, [x, square]: [f64; 2], row: &mut [f64]) {
        let per_row = COLUMNS / W::F64_LANES;
        let cell = self.cells.get(cell.to_bits() as u32 as usize).unwrap_or(&self.none);
        let powers = W::as_simd_f64s(&cell.0).0;
        let (x, square) = (wide.splat_f64s(x), wide.splat_f64s(square));
        for (k, out) in W::as_mut_simd_f64s(row).0.iter_mut().enumerate() {
            let power = |power: usize| powers[power * per_row + k];
            let low = wide.mul_add_f64s(power(1), x, power(0));
            let middle = wide.mul_add_f64s(power(3), x, power(2));
            let high = wide.mul_add_f64s(power(5), x, power(4));
            let above = wide.mul_add_f64s(high, square, middle);
            *out = wide.mul_add_f64s(above, square, low);
        }
    }

    /// Cell of each lane, in the last digits of a number, and the place in it from -1/2 to 1/2.
    #[inline(always)]
    fn place<S: Simd, R: Registers>(&self, at: Num<S, R>) -> (Num<S, R>, Num<S, R>) {
        let [scale, offset, first, last] = if side_by_side::<S, R>() == 1 {
            // a plant alone goes where it is
            let mut own = &self.first;
            for piece in &self.others {
                if at.numbers()[0] < piece.start {
                    break;
                }
                own = piece;
            }
            own.numbers(at)
        } else {
            let mut own = self.first.numbers(at);
            for piece in &self.others {
                let here = at.constant(piece.start).at_most(at);
                for (own, its) in own.iter_mut().zip(piece.numbers(at)) {
                    *own = here.select(its, *own);
                }
            }
            own
        };
        let position = at.times_plus(scale, offset);
        // on a kink, rounding alone would find the cell on its other side
        let cell = (position + WHOLE).or_above(first).or_below(last);
        (cell, position - (cell - WHOLE))
    }
}

/// The sign of the torque of muscles that pull, where that is one over a whole range.
fn turning(group: &Group, low: f64, high: f64) -> Option<Sign> {
    let arms = (0..=SCAN).map(|k| low + (high - low) * k as f64 / SCAN as f64);
    let (mut raises, mut lowers) = (false, false);
    for arm in arms.map(|angle| group.joint.eval(angle).torque_arm) {
        raises |= arm > 0.0;
        lowers |= arm < 0.0;
    }
    match (raises, lowers) {
        (true, true) => None,
        (_, true) => Some(Sign::Lowers),
        _ => Some(Sign::Raises),
    }
}

/// A cell as it is stored, of one in powers of half its width.
fn stored(powers: &[[f64; COLUMNS]; NODES]) -> Cell {
    Aligned(std::array::from_fn(|k| {
        let (power, column) = (k / COLUMNS, k % COLUMNS);
        powers[power][column] * f64::from(1 << power)
    }))
}

/// The columns at an angle, the slope (zero here) left to the volume's polynomial.
fn exact(group: &Group, angle: f64) -> [f64; COLUMNS] {
    let point = group.joint.eval(angle);
    let table = group.muscle.table.eval(point.shortening / group.rest_length);
    let (turn, shorten) = (point.torque_arm * group.count, point.moment_arm * group.count);
    let forces = [table.a_gas, table.a_elastic, table.b_elastic];
    let mut columns = [0.0; COLUMNS];
    for (k, force) in forces.into_iter().enumerate() {
        columns[k] = force * turn;
        columns[SLOPE + 1 + k] = force * shorten;
    }
    columns[VOLUME] = table.volume * group.count;
    columns
}

fn with_slope(group: &Group, angle: f64) -> [f64; COLUMNS] {
    let point = group.joint.eval(angle);
    let table = group.muscle.table.eval(point.shortening / group.rest_length);
    let mut columns = exact(group, angle);
    columns[SLOPE] = table.volume_slope * point.moment_arm * (group.count / group.rest_length);
    columns
}

/// Angles inside a range at which the muscle passes from one smooth piece to the next.
fn kinks(group: &Group, low: f64, high: f64) -> Vec<f64> {
    let contraction = |angle: f64| group.joint.eval(angle).shortening / group.rest_length;
    let at = |k: usize| low + (high - low) * k as f64 / SCAN as f64;
    let mut found = Vec::new();
    for ratio in group.muscle.table.breakpoints() {
        for k in 0..SCAN {
            let (mut a, mut b) = (at(k), at(k + 1));
            let below = contraction(a) < ratio;
            if below == (contraction(b) < ratio) {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if (contraction(middle) < ratio) == below {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            // A muscle at rest stands on a kink: on the side that its own table takes.
            found.push(if below { a } else { b });
        }
    }
    // Pieces have a width.
    let least = 1e-6 * (high - low);
    found.retain(|x| *x > low + least && *x < high - least);
    found.sort_by(f64::total_cmp);
    found.dedup_by(|a, b| *a - *b < least);
    found
}

/// Largest magnitude of each column.
fn scales(group: &Group, low: f64, high: f64) -> [f64; COLUMNS] {
    let mut scales = [f64::MIN_POSITIVE; COLUMNS];
    for k in 0..=64 {
        let here = with_slope(group, low + (high - low) * f64::from(k) / 64.0);
        for (scale, value) in scales.iter_mut().zip(here) {
            *scale = scale.max(value.abs());
        }
    }
    scales
}

/// Cells of one piece, doubled until they are as good as they get.
fn refined(
    group: &Group,
    start: f64,
    stop: f64,
    scales: &[f64; COLUMNS],
) -> Option<Vec<[[f64; COLUMNS]; NODES]>> {
    let mut best: Option<(Vec<[[f64; COLUMNS]; NODES]>, f64)> = None;
    let mut count = 1;
    while count <= MOST_CELLS {
        let (cells, error) = fitted(group, start, stop, count, scales);
        if best.as_ref().is_some_and(|(_, least)| *least <= TOLERANCE && error > 0.5 * least) {
            break;
        }
        best = Some((cells, error));
        if error <= AIM {
            break;
        }
        count *= 2;
    }
    best.filter(|(_, error)| *error <= TOLERANCE).map(|(cells, _)| cells)
}

/// Cells of equal width over a piece and their largest error; the rest is left out behind a cell
/// that is far off.
fn fitted(
    group: &Group,
    start: f64,
    stop: f64,
    count: usize,
    scales: &[f64; COLUMNS],
) -> (Vec<[[f64; COLUMNS]; NODES]>, f64) {
    let width = (stop - start) / count as f64;
    let at =
        |cell: usize, x: f64| (start + (cell as f64 + 0.5 + 0.5 * x) * width).clamp(start, stop);
    let (mut cells, mut worst) = (Vec::with_capacity(count), 0.0_f64);
    for index in 0..count {
        let values: [[f64; COLUMNS]; NODES] =
            std::array::from_fn(|j| exact(group, at(index, lobatto(j, DEGREE))));
        let mut cell = interpolate(&values);
        for power in 0..DEGREE {
            cell[power][SLOPE] = cell[power + 1][VOLUME] * (power + 1) as f64 * 2.0 / width;
        }
        for x in CHECKS {
            let wanted = with_slope(group, at(index, x));
            for (column, wanted) in wanted.iter().enumerate() {
                let found = cell.iter().rev().fold(0.0, |sum, power| sum * x + power[column]);
                let error = (found - wanted).abs() / scales[column];
                // `max` would drop NaN.
                worst = if error <= worst { worst } else { error };
            }
        }
        cells.push(cell);
        if worst.is_nan() || worst > 1e3 * TOLERANCE {
            return (cells, f64::INFINITY);
        }
    }
    (cells, worst)
}
