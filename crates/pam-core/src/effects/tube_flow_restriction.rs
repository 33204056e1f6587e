//! `tube_flow_restriction`: finite conductance between a valve and what it feeds, such as a hose
//! that the model leaves out.
//!
//! Valve and tube in series without volume between them: the pressure at the node is that at which
//! both pass the same mass, `m_v(p_1, p_n) = m_t(p_n, p_2)`. `iso_6358`: the tube has a sonic
//! conductance and a critical ratio of 0.3. `pipe`: isothermal flow through a long pipe, laminar at
//! small flows and turbulent at large ones ([`crate::blocks::pipe`]; Shapiro 1953). The node is
//! found by Newton steps inside a bracket, for the difference of the flows or of their squares; one
//! more step in the scalar's own arithmetic gives it its exact derivatives. Not stiff: nothing is
//! stored at the node (a volume there is a `[line]`'s inlet volume). ISO 6358-3 (2014); Eckersten,
//! "Simplified flow calculations for pneumatic components", 1975. A conductance of [`NONE`] or more
//! restricts nothing.
//!
//! With a `tap` of [`AT_VALVE`] or more the transducer of what the valve feeds sits at the valve's
//! end of the tube and reads the node, which leads the muscle's pressure while air flows. Where
//! such a reading drives a block, it gives the valve's flow, and the muscle's pressure is that to
//! which the tube passes it ([`Tube::other_end`]); see [`crate::plant`]'s `tap.rs`. In front of a
//! `[line]` that is the line's inlet; of two valves at one chamber the first one has the
//! transducer.

use super::{At, AtRest, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role, Use};
use crate::blocks::gas::Gas;
use crate::blocks::pipe::Pipe;
use crate::blocks::tube::Tube;
use crate::blocks::valve::Opening;
use crate::dual::Slope;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Conductance of what is in series with a valve.
pub(super) const CONDUCTANCE: EffectParameter =
    EffectParameter::new("conductance", "m3/(s Pa)", 1e-15, 1.0, 1.2e-8)
        .starts(&[1.2e-8])
        .off(1.0)
        .role(Use::Size)
        .restricts()
        .like("valve.discharge_area_max");

const TAP: EffectParameter = EffectParameter::new("tap", "1", 0.0, 1.0, 0.0)
    .starts(&[0.0, 1.0])
    .role(Use::Choice)
    .needed_in(&["arm"]);

const ISO_6358: Form = Form {
    name: "iso_6358",
    parameters: &[CONDUCTANCE, TAP],
    states: &[EffectState { name: "reading", role: Role::Keeps }],
    integrates: false,
    ports: &[Port::Passage],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "tube_flow_restriction",
    block: "line",
    at: "valve",
    at_rest: &[AtRest::Set("tap", 0.0)],
    acts_in: &["supply", "chamber", "flow", "arm", "pull"],
    source: "ISO 6358-3; Eckersten (1975); Shapiro (1953) for the form pipe",
    forms: &[
        ISO_6358,
        Form {
            name: "pipe",
            parameters: &[
                CONDUCTANCE,
                TAP,
                EffectParameter::new("laminar_pressure", "Pa", 10.0, 1e7, 2e4).starts(&[2e4]),
            ],
            make: made_by!(pipe),
            ..ISO_6358
        },
    ],
    ..EffectInfo::USUAL
};

/// Conductance that restricts nothing [m3/(s Pa)].
pub const NONE: f64 = 1.0;
/// Tap from which on the transducer sits at the valve's end of the tube [1].
pub const AT_VALVE: f64 = 0.5;
const CRITICAL_RATIO: f64 = 0.3;
const MOST_STEPS: usize = 60;
/// Last step to a node, of its pressure [1].
const NEAR: f64 = 1e-12;

/// The tube of a conductance.
pub fn tube<S: Scalar>(conductance: S, temperature: f64) -> Passage<S> {
    Passage::Tube(Tube::of_conductance(conductance, constant(CRITICAL_RATIO), temperature))
}

/// What is in series with a valve.
#[derive(Debug, Clone, Copy)]
pub enum Passage<S> {
    /// By ISO 6358.
    Tube(Tube<S>),
    /// Long enough for friction along it.
    Pipe(Pipe<S>),
}

impl<S: Scalar> Passage<S> {
    #[inline]
    fn re(&self) -> Passage<f64> {
        match self {
            Self::Tube(tube) => Passage::Tube(tube.re()),
            Self::Pipe(pipe) => Passage::Pipe(pipe.re()),
        }
    }

    #[inline]
    fn mass_flow(&self, upstream: S, downstream: S) -> S {
        match self {
            Self::Tube(tube) => tube.mass_flow(upstream, downstream),
            Self::Pipe(pipe) => pipe.mass_flow(upstream, downstream),
        }
    }

    fn other_end(&self, here: S, flow: S) -> S {
        match self {
            Self::Tube(tube) => tube.other_end(here, flow),
            Self::Pipe(pipe) => pipe.other_end(here, flow),
        }
    }
}

impl Passage<f64> {
    /// Mass flow into a vacuum per upstream pressure [kg/(s Pa)].
    fn choked(&self) -> f64 {
        match self {
            Self::Tube(tube) => tube.flow_factor(),
            Self::Pipe(pipe) => pipe.flow_factor(),
        }
    }

    #[inline]
    fn lift<S: Scalar>(&self) -> Passage<S> {
        match self {
            Self::Tube(tube) => Passage::Tube(tube.lift()),
            Self::Pipe(pipe) => Passage::Pipe(pipe.lift()),
        }
    }
}

/// Mass flow [kg/s] through an opening and then a tube, between two absolute pressures [Pa]; the
/// other way round if `tube_first`. Negative when the downstream pressure is the higher one.
pub fn mass_flow<S: Scalar>(
    gas: &Gas,
    opening: &Opening<S>,
    tube: &Passage<S>,
    upstream: S,
    downstream: S,
    tube_first: bool,
) -> S {
    if upstream.re() < downstream.re() {
        return -mass_flow(gas, opening, tube, downstream, upstream, !tube_first);
    }
    let series = Series { gas, opening: *opening, tube: *tube, tube_first };
    series.flows(upstream, series.exact_node(upstream, downstream), downstream).1
}

/// Absolute pressure [Pa] between an opening and a tube, of the same arguments as [`mass_flow`].
pub fn node<S: Scalar>(
    gas: &Gas,
    opening: &Opening<S>,
    tube: &Passage<S>,
    upstream: S,
    downstream: S,
    tube_first: bool,
) -> S {
    if upstream.re() < downstream.re() {
        return node(gas, opening, tube, downstream, upstream, !tube_first);
    }
    Series { gas, opening: *opening, tube: *tube, tube_first }.exact_node(upstream, downstream)
}

struct Series<'a, S> {
    gas: &'a Gas,
    opening: Opening<S>,
    tube: Passage<S>,
    tube_first: bool,
}

impl<S: Scalar> Series<'_, S> {
    /// Flow into and out of the node.
    fn flows(&self, upstream: S, node: S, downstream: S) -> (S, S) {
        if self.tube_first {
            (
                self.tube.mass_flow(upstream, node),
                self.opening.mass_flow(self.gas, node, downstream),
            )
        } else {
            (
                self.opening.mass_flow(self.gas, upstream, node),
                self.tube.mass_flow(node, downstream),
            )
        }
    }

    /// Pressure at the node [Pa] with its derivatives.
    fn exact_node(&self, upstream: S, downstream: S) -> S {
        let Self { gas, tube_first, .. } = *self;
        let start =
            Series::<f64> { gas, opening: self.opening.re(), tube: self.tube.re(), tube_first };
        let (node, slope) = start.node(upstream.re(), downstream.re());
        let fixed = constant::<S>(node);
        let (a, b) = self.flows(upstream, fixed, downstream);
        if slope < 0.0 {
            fixed - (a - b) / slope
        } else {
            fixed
        }
    }
}

impl Series<'_, f64> {
    /// Pressure at the node of two long pipes that choke like these two [Pa]; next to a shut one,
    /// that at the other one's end.
    fn near_node(&self, upstream: f64, downstream: f64) -> f64 {
        let (valve, tube) = (self.opening.choked(self.gas).powi(2), self.tube.choked().powi(2));
        let (first, last) = if self.tube_first { (tube, valve) } else { (valve, tube) };
        if first <= 0.0 {
            return downstream;
        }
        if last <= 0.0 {
            return upstream;
        }
        let square =
            (first * upstream * upstream + last * downstream * downstream) / (first + last);
        if square.is_nan() {
            return square; // within a step a pressure may be no number, which ends the run behind it
        }
        square.sqrt().max(downstream).min(upstream)
    }

    /// Pressure at the node [Pa] and slope of what it gains there [kg/(s Pa)].
    fn node(&self, upstream: f64, downstream: f64) -> (f64, f64) {
        let dual = Series {
            gas: self.gas,
            opening: self.opening.lift::<Slope>(),
            tube: self.tube.lift::<Slope>(),
            tube_first: self.tube_first,
        };
        // What the node gains falls with its pressure, from what comes in at the lower end to what
        // goes out at the upper.
        let (mut low, mut high) = (downstream, upstream);
        let mut node = self.near_node(upstream, downstream);
        let mut slope = 0.0;
        for _ in 0..MOST_STEPS {
            let (a, b) = dual.flows(upstream.into(), Slope::new(node, 1.0), downstream.into());
            let gain = a - b;
            slope = gain.slope();
            if gain.re > 0.0 {
                low = node;
            } else if gain.re < 0.0 {
                high = node;
            } else {
                break;
            }
            // far away, where a flow is steep, its square is nearly straight
            let squares = a * a - b * b;
            let newton = [gain, squares].map(|f| node - f.re / f.slope());
            let inside = newton.into_iter().find(|next| *next > low && *next < high);
            let next = inside.unwrap_or(0.5 * (low + high));
            let near = (next - node).abs() <= NEAR * node;
            node = next;
            if near {
                break;
            }
        }
        (node, slope)
    }
}

/// A hose behind a valve; its state is what a pressure sensor at its beginning reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hose<S> {
    /// None where it restricts nothing.
    tube: Option<Passage<S>>,
    tapped: bool,
}

impl<S: Scalar> Hose<S> {
    /// A hose of a conductance; a `tapped` one has the pressure sensor at the valve's end.
    pub(super) fn new(conductance: S, passage: Passage<S>, tapped: bool) -> Self {
        Self { tube: (conductance.re() < NONE).then_some(passage), tapped }
    }
}

fn hose<S: Scalar>(values: &[S], passage: Passage<S>) -> Box<dyn Effect<S>> {
    Box::new(Hose::new(values[0], passage, values[1].re() >= AT_VALVE))
}

fn make<S: Scalar>(values: &[S], gas: &Gas) -> Box<dyn Effect<S>> {
    hose(values, tube(values[0], gas.temperature))
}

fn pipe<S: Scalar>(values: &[S], gas: &Gas) -> Box<dyn Effect<S>> {
    hose(values, Passage::Pipe(Pipe::new(values[0], values[2], gas.temperature)))
}

impl<S: Scalar> Effect<S> for Hose<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Valve { fed } = at {
            own[0] = *fed;
        }
    }

    fn through(
        &self,
        gas: &Gas,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        venting: bool,
    ) -> S {
        match &self.tube {
            Some(tube) => mass_flow(gas, opening, tube, upstream, downstream, venting),
            None => opening.mass_flow(gas, upstream, downstream),
        }
    }

    fn taps(&self) -> bool {
        self.tapped && self.tube.is_some()
    }

    fn between(
        &self,
        gas: &Gas,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        venting: bool,
    ) -> S {
        match &self.tube {
            Some(tube) => node(gas, opening, tube, upstream, downstream, venting),
            None => downstream,
        }
    }

    fn behind(&self, there: S, flow: S) -> S {
        self.tube.as_ref().map_or(there, |tube| tube.other_end(there, flow))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gas() -> Gas {
        Gas::new(101_325.0, 293.15, 287.05, 1.4)
    }

    fn flow(area: f64, conductance: f64, p: [f64; 2], tube_first: bool) -> f64 {
        mass_flow(&gas(), &Opening::Area(area), &tube(conductance, 293.15), p[0], p[1], tube_first)
    }

    #[test]
    fn the_smaller_of_two_decides() {
        let gas = gas();
        let area = 8e-6;
        let open = gas.mass_flow(area, 8e5, 2e5);
        assert!((flow(area, 1e-3, [8e5, 2e5], false) / open - 1.0).abs() < 1e-6);
        let narrow = tube(1e-10, 293.15).mass_flow(8e5, 2e5);
        assert!((flow(area, 1e-10, [8e5, 2e5], false) / narrow - 1.0).abs() < 1e-3);
        for (p, first) in [
            ([8e5, 2e5], false),
            ([8e5, 7.9e5], false),
            ([3e5, 1e5], true),
            ([3e5, 2.9999e5], true),
        ] {
            let both = flow(area, 1.2e-8, p, first);
            let free = gas.mass_flow(area, p[0], p[1]);
            assert!(both > 0.3 * free && both < free, "{p:?}: {both} of {free}");
            assert_eq!(flow(area, 1.2e-8, [p[1], p[0]], !first), -both);
        }
    }

    #[test]
    fn nothing_flows_between_equal_pressures_or_through_nothing() {
        assert_eq!(flow(8e-6, 1.2e-8, [5e5, 5e5], false), 0.0);
        assert!(flow(0.0, 1.2e-8, [8e5, 2e5], false).abs() < 1e-18);
        assert!(flow(0.0, 1.2e-8, [8e5, 2e5], true).abs() < 1e-18);
    }

    #[test]
    fn a_pressure_that_is_no_number_gives_a_flow_that_is_none() {
        for p in [[f64::NAN, 2e5], [8e5, f64::NAN], [f64::NAN; 2]] {
            assert!(flow(8e-6, 1.2e-8, p, false).is_nan() && flow(8e-6, 1.2e-8, p, true).is_nan());
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let gas = gas();
        let run = |x: [f64; 4]| {
            mass_flow(&gas, &Opening::Area(x[0]), &tube(x[1], 293.15), x[2], x[3], false)
        };
        for x in
            [[8e-6, 1.2e-8, 8e5, 2e5], [2e-6, 1.2e-8, 8e5, 7.8e5], [8e-6, 1.2e-8, 3e5, 2.9995e5]]
        {
            for k in 0..4 {
                let mut d = x.map(Slope::from);
                d[k].eps = [1.0];
                let exact =
                    mass_flow(&gas, &Opening::Area(d[0]), &tube(d[1], 293.15), d[2], d[3], false)
                        .slope();
                let h = 1e-6 * x[k];
                let (mut up, mut down) = (x, x);
                up[k] += h;
                down[k] -= h;
                let difference = (run(up) - run(down)) / (2.0 * h);
                assert!(
                    (exact - difference).abs() < 1e-4 * exact.abs() + 1e-16,
                    "{x:?} {k}: {exact} {difference}"
                );
            }
        }
    }
}
