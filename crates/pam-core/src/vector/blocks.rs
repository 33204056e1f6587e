//! The blocks of several plants side by side: the equations of [`crate::blocks`] without branches.
//! A test holds each rig's rates against those of [`crate::plant`].

use super::num::{Mask, Num, Registers};
use crate::blocks::arm::one_link::Stops;
use crate::blocks::gas::{Gas, LAMINAR_RATIO};
use crate::chebyshev::{interpolate, lobatto};
use pulp::Simd;

/// So many that the flow is right to 1e-11.
const NODES: usize = 12;

/// Flow through orifices of one gas. `psi^2/(1 - r)` is a polynomial over the subsonic ratios.
#[derive(Debug, Clone)]
pub(crate) struct Orifice {
    critical_ratio: f64,
    per_half_width: f64,
    /// Where the middle of the curve is, in half-widths, below zero.
    middle: f64,
    curve: [f64; NODES],
    choked: f64,
    laminar: f64,
    factor: f64,
}

impl Orifice {
    pub fn new(gas: &Gas) -> Self {
        let low = gas.critical_ratio();
        let (middle, half) = (0.5 * (LAMINAR_RATIO + low), 0.5 * (LAMINAR_RATIO - low));
        // psi^2 = s (s - r) gamma/(gamma - 1) with s = r^(1/gamma); the difference without loss.
        let node = |j: usize| {
            let ratio = middle + half * lobatto(j, NODES - 1);
            let log = (ratio - 1.0).ln_1p();
            let power = (log / gas.gamma).exp();
            let difference = ratio * (log * (1.0 / gas.gamma - 1.0)).exp_m1();
            [power * difference * (gas.gamma / (gas.gamma - 1.0)) / (1.0 - ratio)]
        };
        let curve = interpolate(&std::array::from_fn::<_, NODES, _>(node)).map(|[c]| c);
        Self {
            critical_ratio: low,
            per_half_width: 1.0 / half,
            middle: -middle / half,
            curve,
            choked: gas.psi(0.0),
            laminar: gas.psi(LAMINAR_RATIO) / (1.0 - LAMINAR_RATIO),
            factor: gas.choked_flow(1.0, 1.0) / gas.psi(0.0),
        }
    }

    /// What [`Self::mass_flow`] takes in the place of a discharge area [m2].
    #[inline(always)]
    pub fn conductance<S: Simd, R: Registers>(&self, area: Num<S, R>) -> Num<S, R> {
        area * self.factor
    }

    /// Mass flow [kg/s] from `upstream` to `downstream`, as [`Gas::mass_flow`].
    #[inline(always)]
    pub fn mass_flow<S: Simd, R: Registers>(
        &self,
        conductance: Num<S, R>,
        upstream: Num<S, R>,
        downstream: Num<S, R>,
    ) -> Num<S, R> {
        let high = upstream.or_above(downstream);
        let ratio = upstream.or_below(downstream) / high;
        let flow = conductance * high * self.psi(ratio);
        downstream.at_most(upstream).select(flow, -flow)
    }

    #[inline(always)]
    fn psi<S: Simd, R: Registers>(&self, ratio: Num<S, R>) -> Num<S, R> {
        let choked = ratio.constant(self.choked);
        if ratio.constant(self.critical_ratio).less(ratio).nowhere() {
            return choked;
        }
        let subsonic = ratio.or_above(self.critical_ratio).or_below(LAMINAR_RATIO);
        let place = subsonic.times_plus(self.per_half_width, self.middle);
        let curved = ((-subsonic + 1.0) * place.polynomial(&self.curve)).sqrt();
        let straight = (-ratio + 1.0) * self.laminar;
        let open = ratio.at_most(ratio.constant(LAMINAR_RATIO)).select(curved, straight);
        ratio.at_most(ratio.constant(self.critical_ratio)).select(choked, open)
    }
}

/// A tube, as [`crate::blocks::tube::Tube`].
#[derive(Clone, Copy)]
pub(crate) struct Tube<S: Simd, R: Registers> {
    pub flow_factor: Num<S, R>,
    pub critical_ratio: Num<S, R>,
}

impl<S: Simd, R: Registers> Tube<S, R> {
    #[inline(always)]
    pub fn mass_flow(&self, upstream: Num<S, R>, downstream: Num<S, R>) -> Num<S, R> {
        let high = upstream.or_above(downstream);
        let ratio = upstream.or_below(downstream) / high;
        let flow = self.flow_factor * high * self.psi(ratio);
        downstream.at_most(upstream).select(flow, -flow)
    }

    #[inline(always)]
    fn psi(&self, ratio: Num<S, R>) -> Num<S, R> {
        let edge = ratio.constant(LAMINAR_RATIO);
        let curved = ratio.or_above(self.critical_ratio).or_below(edge);
        let x = (curved - self.critical_ratio) / (-self.critical_ratio + 1.0);
        let ellipse = x.times_from(x, 1.0).sqrt();
        // Beyond the edge the ellipse stands at its value there.
        let straight = ellipse * (-ratio + 1.0) / (1.0 - LAMINAR_RATIO);
        ratio.at_most(edge).select(ellipse, straight)
    }
}

/// Where the air comes from, as [`crate::blocks::supply::Supply`].
#[derive(Clone, Copy)]
pub(crate) enum Supply<S: Simd, R: Registers> {
    /// Fall of the pressure per mass that leaves [Pa/kg].
    Tank(Num<S, R>),
    Constant,
    Regulator {
        time_constant: Num<S, R>,
        droop: Num<S, R>,
    },
}

impl<S: Simd, R: Registers> Supply<S, R> {
    #[inline(always)]
    pub fn pressure_rate(
        &self,
        pressure: Num<S, R>,
        outflow: Num<S, R>,
        set: Num<S, R>,
    ) -> Num<S, R> {
        match self {
            Self::Tank(stiffness) => -(outflow * *stiffness),
            Self::Constant => pressure.constant(0.0),
            Self::Regulator { time_constant, droop } => {
                droop.times_from(outflow, set - pressure) / *time_constant
            }
        }
    }
}

/// How the torque of a weight follows the angle.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Turns {
    /// Not at all: it hangs.
    Not,
    /// By the sine of angles up to [`super::num::NEAR`].
    Near,
    /// By the sine of any angle.
    Far,
}

/// What moves: an arm of one link, or a mass that hangs from the muscle (without inertia of its
/// own, and always pulled straight down).
#[derive(Clone, Copy)]
pub(crate) struct Body<S: Simd, R: Registers> {
    /// One over the inertia [1/(kg m2)], or over the mass [1/kg].
    pub mobility: Num<S, R>,
    /// Torque of the weight where it pulls across [N m], or the weight itself [N].
    pub weight: Num<S, R>,
    /// How the weight follows the angle.
    pub turns: Turns,
    /// How far it is from straight down where the angle is zero [rad].
    pub tilt: Num<S, R>,
    /// Some lane is so.
    pub tilted: bool,
    pub viscous: Num<S, R>,
    pub coulomb: Num<S, R>,
    /// Some lane has Coulomb friction.
    pub rubs: bool,
    /// One over the speed that Coulomb friction takes to turn [s/rad].
    pub coulomb_slope: f64,
    pub stops: Option<Stops>,
    /// Stiffness of the spring across the joint [N m/rad], and where it is at rest [rad].
    pub spring: [Num<S, R>; 2],
    /// Some lane has such a spring.
    pub springs: bool,
}

impl<S: Simd, R: Registers> Body<S, R> {
    #[inline(always)]
    pub fn acceleration(&self, angle: Num<S, R>, rate: Num<S, R>, torque: Num<S, R>) -> Num<S, R> {
        // What resists is known before the torque is.
        let mut across = match self.turns {
            Turns::Not => rate.constant(1.0),
            Turns::Near => angle.sin_near(),
            Turns::Far => angle.sin(),
        };
        if self.tilted {
            // what is not tilted keeps the bits that it has alone
            let plumb = self.tilt.abs().at_most(angle.constant(0.0));
            across = plumb.select(across, (angle + self.tilt).sin());
        }
        let mut resists = self.weight * across;
        resists = self.viscous.times_plus(rate, resists);
        if self.rubs {
            resists = self.coulomb.times_plus((rate * self.coulomb_slope).tanh(), resists);
        }
        if self.springs {
            let [stiffness, rest] = self.spring;
            resists = stiffness.times_plus(angle - rest, resists);
        }
        if let Some(stops) = &self.stops {
            resists = resists - stop_torque(stops, angle, rate);
        }
        (torque - resists) * self.mobility
    }
}

/// Torque of the stops [N m], which never pull.
#[inline(always)]
fn stop_torque<S: Simd, R: Registers>(
    stops: &Stops,
    angle: Num<S, R>,
    rate: Num<S, R>,
) -> Num<S, R> {
    let zero = angle.constant(0.0);
    let (low, high) = (angle.constant(stops.min_angle), angle.constant(stops.max_angle));
    let (below, above): (Mask<S, R>, Mask<S, R>) = (angle.less(low), high.less(angle));
    if below.nowhere() && above.nowhere() {
        return zero;
    }
    let damping = rate * stops.damping;
    let up = (low - angle).times_plus(stops.stiffness, -damping).or_above(zero);
    let down = (angle - high).times_plus(stops.stiffness, damping).or_above(zero);
    below.select(up, above.select(-down, zero))
}
