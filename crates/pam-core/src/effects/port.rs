//! Where an effect meets its rig: the ports of the blocks, and what it sees there.

use crate::blocks::chamber::ChamberState;
use crate::blocks::gas::Gas;
use crate::blocks::supply::Supply;
use crate::blocks::valve::Opening;
use crate::scalar::{constant, Scalar};
use serde::Serialize;
use std::fmt::Debug;

/// A place in the equations of a rig at which an effect acts. Some need a form with a certain number
/// of states; a rig with an effect of another number is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Port {
    /// Valve: the way from the command to the opening.
    Command,
    /// Valve: the share of its largest area that an opening gives. One effect at most.
    Area,
    /// Valve: what its flow passes through. One effect at most, with one state: what a pressure
    /// sensor in front of it reads.
    Passage,
    /// Valve: what its flow passes through where it vents. One effect at most, here or at the
    /// passage.
    Exhaust,
    /// Valve: a path beside its opening, from the supply to the chamber and from the chamber to the
    /// ambient.
    Clearance,
    /// Supply or chamber: gas lost to the ambient.
    Leak,
    /// Supply or chamber: gas that comes in from nowhere.
    Inflow,
    /// Supply: what it is asked for, and what fills it.
    Feed,
    /// Line: the law of its flow. One effect at most.
    Law,
    /// Chamber: the balance that gives its pressure. One effect at most.
    Balance,
    /// Muscle: the pressure that its force is that of.
    Gauge,
    /// Muscle: the bladder's part of its force.
    Bladder,
    /// Muscle: a force of its own.
    Force,
    /// Muscle: what gives between it and its load. One effect at most, with one state: by how much
    /// [m].
    Give,
    /// Joint: a torque between its two links.
    Torque,
    /// Joint: a torque from outside on its link.
    Push,
    /// Joint: what its link weighs beside what its first moment and payload do.
    Weight,
    /// Arm: the mass at the end of a link.
    Payload,
    /// Arm: a part of that mass that hangs on a cord. One effect at most, with two states: angle and
    /// rate of the cord.
    Hanging,
    /// Arm: what it stands on. One effect at most, with two states: angle and rate.
    Mounting,
    /// Chamber: what its pressure sensor reads. One effect at most, with one state: the reading.
    Reading,
    /// Chamber: what its thermometer reads. One effect at most, with one state: the reading.
    Thermometer,
    /// Joint: what the sensor of its angle reads. One effect at most.
    Encoder,
    /// Chamber: what its gauge reads too much. Rig: what its load cell, or the sensors of its joints'
    /// torques, do. One effect at most.
    Zero,
    /// The clock of what is recorded.
    Clock,
    /// Valve: how late it sees its command.
    Late,
    /// Valve: positions that it takes at instants of its own. One at most: its spool.
    Switching,
}

impl Port {
    /// How many states an effect that acts here has at each block; None where any number will do.
    #[must_use]
    pub const fn states(self) -> Option<usize> {
        match self {
            Self::Passage | Self::Reading | Self::Thermometer | Self::Give => Some(1),
            Self::Hanging | Self::Mounting => Some(2),
            _ => None,
        }
    }
}

/// What an effect sees of the block that it acts on. Pressures absolute [Pa] where nothing else is
/// said.
#[derive(Debug, Clone, Copy)]
pub enum At<S> {
    /// A supply.
    Supply {
        /// Its pressure.
        pressure: S,
        /// Sum of the openings through which its valves fill from it, 0 to 1 each.
        opening: S,
    },
    /// A valve or a line.
    Valve {
        /// Pressure of what it feeds.
        fed: S,
    },
    /// A chamber.
    Chamber {
        /// Its pressure.
        pressure: S,
        /// Pressure before its valve; its own without one.
        supply: S,
        /// Opening of its valves, -1 to 1 each.
        opening: S,
        /// Rate of its volume [m3/s].
        volume_rate: S,
    },
    /// A group of muscles.
    Muscle(AtMuscle<S>),
    /// A joint.
    Joint {
        /// Gauge pressure [bar], the mean over the muscles that pull on it.
        pressure: S,
        /// Angle [rad].
        angle: S,
        /// Rate [rad/s].
        rate: S,
        /// Torques that the muscles put on it, all counted as positive [N m]; zero where
        /// nobody asks what they pull.
        load: S,
    },
    /// The arm.
    Arm {
        /// Torque on the first joint that holds it against gravity [N m].
        weight: S,
    },
}

/// What an effect sees of a group of muscles.
#[derive(Debug, Clone, Copy)]
pub struct AtMuscle<S> {
    /// Gauge pressure that the force is that of [Pa].
    pub gauge: S,
    /// Contraction ratio [1].
    pub contraction: S,
    /// Length [m].
    pub length: S,
    /// Rate of the length [m/s].
    pub rate: S,
    /// Stretch since the step began [m].
    pub stretched: S,
    /// What the effect acts on, of one muscle [N]: at [`Port::Force`] its force before this effect,
    /// in the order in which they act; at [`Port::Bladder`] the bladder's part of it. Only effects
    /// with states see it in [`Effect::start`] and [`Effect::rates`].
    pub force: S,
    /// Fall of the force of one muscle without effects with its shortening, and of its air [N/m];
    /// only what gives between it and its load sees it.
    pub stiffness: S,
}

/// A hanging mass at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Cord<S> {
    /// Along the cord, away from the link: across and up.
    pub along: [S; 2],
    /// Across the cord.
    pub across: [S; 2],
    /// Damping, as an acceleration across the cord [m/s2].
    pub damping: S,
    /// Centripetal acceleration [m/s2].
    pub centripetal: S,
    length: S,
}

impl<S: Scalar> Cord<S> {
    /// A cord of a length [m] and damping ratio at an angle [rad] and its rate, under gravity
    /// [m/s2].
    #[inline]
    pub fn new(length: S, damping_ratio: S, gravity: f64, angle: S, rate: S) -> Self {
        let (sin, cos) = angle.sin_cos();
        let damping = damping_ratio * (length * gravity.abs()).sqrt() * rate * 2.0;
        Self {
            along: [sin, -cos],
            across: [cos, sin],
            damping,
            centripetal: length * rate * rate,
            length,
        }
    }

    /// Angular acceleration [rad/s2] where the upper end accelerates [m/s2], gravity counted as an
    /// acceleration upwards.
    #[inline]
    pub fn acceleration(&self, felt: [S; 2]) -> S {
        -(felt[0] * self.across[0] + felt[1] * self.across[1] + self.damping) / self.length
    }
}

/// Extremes of a block, for the fastest rate of what acts there.
#[derive(Debug, Clone, Copy)]
pub struct Extremes {
    /// Highest pressure that is to be reckoned with [Pa, absolute], and that of the ambient.
    pub pressure: f64,
    /// Ambient pressure [Pa].
    pub ambient: f64,
    /// Range of the joint's angle [rad], zeros for one without stops.
    pub angles: (f64, f64),
    /// Largest contraction ratio [1].
    pub contraction: f64,
    /// Valves at the block.
    pub valves: usize,
    /// Largest torque that muscles put on a joint [N m].
    pub load: f64,
}

/// An effect that is switched on, with its parameters in a scalar type: what it does at its ports,
/// what it remembers, how fast it is. `own` are its states at one block; what is not said does
/// nothing.
pub trait Effect<S: Scalar>: Debug + Send + Sync {
    /// Write its states where a recording begins: nothing has moved for long.
    fn start(&self, _gas: &Gas, _at: &At<S>, _own: &mut [S]) {}

    /// Write the rates of its states.
    fn rates(&self, _at: &At<S>, _own: &[S], _rates: &mut [S]) {}

    /// [`Port::Command`]: normalised position of the valve so long [s] after a step began with the
    /// states `own`, the position that comes in being held.
    fn position(&self, _own: &[S], input: S, _age: f64) -> S {
        input
    }

    /// [`Port::Command`]: bring the states to the end of a step [s]; the position there.
    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        self.position(own, input, step)
    }

    /// [`Port::Switching`]: bring the states to the end of a step of a time from a time on [s], and
    /// tell the positions that it takes in it, each with how long after the step began [s]. `input`
    /// is the position that comes in so long after that, `change` when it jumps. Where it stands is
    /// [`Self::position`].
    fn switched_to(
        &self,
        _own: &mut [S],
        _input: &dyn Fn(f64) -> S,
        _change: Option<S>,
        _over: (f64, f64),
        _tell: &mut dyn FnMut(S, f64),
    ) {
    }

    /// [`Port::Area`]: share of the largest area [1] where the table says `share`, above zero where
    /// that is.
    fn area(&self, share: S, _venting: bool) -> S {
        share
    }

    /// [`Port::Passage`], [`Port::Exhaust`]: mass flow [kg/s] through an opening between two
    /// pressures; against the arrow of the passage where it vents.
    fn through(
        &self,
        gas: &Gas,
        opening: &Opening<S>,
        upstream: S,
        downstream: S,
        _venting: bool,
    ) -> S {
        opening.mass_flow(gas, upstream, downstream)
    }

    /// [`Port::Passage`]: whether the pressure sensor sits between the valve and what the flow
    /// passes through.
    fn taps(&self) -> bool {
        false
    }

    /// [`Port::Passage`]: pressure there, with the arguments of [`Self::through`].
    fn between(
        &self,
        _gas: &Gas,
        _opening: &Opening<S>,
        _upstream: S,
        downstream: S,
        _venting: bool,
    ) -> S {
        downstream
    }

    /// [`Port::Passage`]: pressure at the other end, for the pressure there and a mass flow [kg/s]
    /// to that end.
    fn behind(&self, there: S, _flow: S) -> S {
        there
    }

    /// [`Port::Law`]: mass flow [kg/s] between two pressures, in the direction of `own`, the flow
    /// by the line's own law; `unit` is that from [`BAR`] above the ambient to the ambient.
    fn along(&self, _gas: &Gas, own: S, _unit: S, _from: S, _to: S) -> S {
        own
    }

    /// [`Port::Clearance`]: discharge area [m2] of either path at a normalised position.
    fn clearance(&self, _gas: &Gas, _position: S) -> S {
        constant(0.0)
    }

    /// [`Port::Leak`]: mass flow to the ambient [kg/s].
    fn leak(&self, _gas: &Gas, _pressure: S) -> S {
        constant(0.0)
    }

    /// [`Port::Inflow`]: mass flow in [kg/s].
    fn inflow(&self, _at: &At<S>, _own: &[S]) -> S {
        constant(0.0)
    }

    /// [`Port::Feed`]: change the mass flow that is drawn [kg/s] and the set pressure of a supply.
    fn feed(&self, _own: &[S], _pressure: S, _drawn: &mut S, _set: &mut S) {}

    /// [`Port::Feed`]: change how a supply answers.
    fn answers(&self, _supply: &mut Supply<S>) {}

    /// [`Port::Feed`]: bring the states to the end of a step [s] from one pressure to another;
    /// where it switched on the way, a mass flow [kg/s] and the time for which the supply gets it
    /// [s], negative where it had got too much.
    fn switched(
        &self,
        _gas: &Gas,
        _own: &mut [S],
        _from: S,
        _to: S,
        _step: f64,
    ) -> Option<(S, f64)> {
        None
    }

    /// [`Port::Balance`]: rate of the pressure [Pa/s], and what it adds to the rate of the mass
    /// [kg/s]. `fixed` is the rate by fixed coefficients.
    fn balance(
        &self,
        _gas: &Gas,
        _chamber: &ChamberState<S>,
        _wall: S,
        _mass: S,
        fixed: S,
    ) -> (S, S) {
        (fixed, constant(0.0))
    }

    /// [`Port::Balance`]: mass [kg] where a recording begins, of the one at rest temperature.
    fn initial_mass(&self, _gas: &Gas, rest: S) -> S {
        rest
    }

    /// [`Port::Gauge`]: gauge pressure that the force is that of [Pa].
    fn gauge(&self, gauge: S) -> S {
        gauge
    }

    /// [`Port::Bladder`]: what it adds to the force of one muscle [N] whose bladder's part is
    /// `bladder`.
    fn bladder(&self, _own: &[S], _bladder: S, _contraction: S) -> S {
        constant(0.0)
    }

    /// [`Port::Force`]: what it adds to the force of one muscle [N].
    fn force(&self, _at: &AtMuscle<S>, _own: &[S]) -> S {
        constant(0.0)
    }

    /// Bring the states to the end of a step in which a muscle of a rest length [m] moved between
    /// two contraction ratios.
    fn moved(&self, _own: &mut [S], _from: S, _to: S, _rest_length: f64) {}

    /// [`Port::Torque`]: what it adds to the torque of a joint [N m].
    fn torque(&self, _at: &At<S>, _own: &[S]) -> S {
        constant(0.0)
    }

    /// [`Port::Push`]: torque from outside [N m] at a time [s].
    fn push(&self, _time: f64) -> S {
        constant(0.0)
    }

    /// [`Port::Weight`]: torque [N m] on the joint of a link, and on all before it, where the link
    /// stands at an angle from the direction of gravity [rad] and weighs `level` where it is level
    /// [N m].
    fn weight(&self, _direction: S, _level: S) -> S {
        constant(0.0)
    }

    /// [`Port::Payload`]: what it adds to the mass [kg] at a time [s]; infinite times ask for what
    /// is there in the end.
    fn payload(&self, _time: f64) -> S {
        constant(0.0)
    }

    /// [`Port::Hanging`]: share of the mass that hangs [1].
    fn hanging(&self) -> S {
        constant(0.0)
    }

    /// [`Port::Hanging`]: the cord, under gravity [m/s2].
    fn cord(&self, _gravity: f64, _own: &[S]) -> Option<Cord<S>> {
        None
    }

    /// [`Port::Mounting`]: angular acceleration [rad/s2] under a torque [N m]; its states are angle
    /// and rate.
    fn mounting(&self, _own: &[S], _torque: S) -> S {
        constant(0.0)
    }

    /// [`Port::Reading`], [`Port::Thermometer`]: what the sensor reads after a step [s] from one
    /// pressure, or temperature, to another.
    fn read(&self, _reading: S, _from: S, to: S, _step: f64) -> S {
        to
    }

    /// [`Port::Reading`], [`Port::Thermometer`]: how far the sensor lags [s].
    fn lag(&self) -> S {
        constant(0.0)
    }

    /// [`Port::Encoder`]: what the sensor adds to a true angle [rad], and its slope by the angle,
    /// which is above -1.
    fn misread(&self, _angle: S) -> (S, S) {
        (constant(0.0), constant(0.0))
    }

    /// [`Port::Zero`]: what the sensor reads too much [Pa, N or N m] at a time [s].
    fn drift(&self, _time: f64) -> S {
        constant(0.0)
    }

    /// [`Port::Clock`]: how late pressures and angles are recorded at a time [s].
    fn clock(&self, _time: f64) -> (S, S) {
        (constant(0.0), constant(0.0))
    }

    /// [`Port::Late`]: how late a valve sees its command [s].
    fn late(&self) -> S {
        constant(0.0)
    }

    /// Write the rates of states that [`Self::follow`] or [`Self::read`] moves in closed form,
    /// where a linear model asks for them; `input` is the position, or the pressure [Pa], that
    /// comes in.
    fn linear_rates(&self, _own: &[S], _input: S, _rates: &mut [S]) {}

    /// Fastest rate of what it moves by itself [1/s].
    fn fastest(&self) -> f64 {
        0.0
    }

    /// Flow ports: largest change of the flow with the pressure of its block [kg/(s Pa)].
    fn steepest(&self, _gas: &Gas, _most: &Extremes) -> f64 {
        0.0
    }

    /// [`Port::Balance`]: fastest rate of a chamber of a volume [m3] with a wall [m2].
    fn wall_rate(&self, _gas: &Gas, _volume: f64, _wall: f64) -> f64 {
        0.0
    }

    /// Largest damping and stiffness: of one muscle [N s/m] and by its contraction ratio [N], of a
    /// joint [N m s/rad] and [N m/rad].
    fn resistance(&self, _most: &Extremes) -> (f64, f64) {
        (0.0, 0.0)
    }

    /// Stiffness of one muscle's friction before it slips [N/m] at a gauge pressure [Pa] at which
    /// it pulls with a force [N].
    fn presliding(&self, _gauge: f64, _force: f64) -> f64 {
        0.0
    }

    /// [`Port::Mounting`]: how much a torque accelerates it [1/(kg m2)]. [`Port::Give`]: how much a
    /// pull stretches it at most [m/N].
    fn mobility(&self) -> f64 {
        0.0
    }

    /// [`Port::Hanging`]: fastest rate [1/s], the link's inertia without the hanging mass being
    /// smaller by a ratio.
    fn swing_rate(&self, _gravity: f64, _ratio: f64) -> f64 {
        0.0
    }

    /// What its coefficients multiply, for an effect that is a sum of terms.
    fn terms(&self, _at: &At<S>, _own: &[S]) -> Vec<S> {
        Vec::new()
    }
}

/// One bar [Pa].
pub(crate) const BAR: f64 = 1e5;
/// One litre [m3].
pub(crate) const LITRE: f64 = 1e-3;
/// A first state that says that something has begun.
pub(crate) const BEGUN: f64 = 1.0;

/// Whether the first state says so.
pub(crate) fn begun<S: Scalar>(own: &[S]) -> bool {
    own[0].re() == BEGUN
}
