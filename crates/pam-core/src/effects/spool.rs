//! What the spool of a valve does by itself. It stands in the `[valve]` of a rig and in no
//! catalogue; it acts at the ports of its valve as an effect does, behind all effects on its
//! command.
//!
//! `second_order`: a mass on a spring between two stops ([`crate::blocks::spool`]).
//!
//! The others switch: a coil pulls a spool from one position to another, and a spring brings it
//! back. The coil has current while the position that comes in is above one half, or, with a
//! carrier of frequency `f` and phase `phi`, from each `t_k = (k + phi)/f` for the share `d` of
//! `1/f` that comes in at `t_k` (the duty, latched once a period as timers do). The spool switches
//! when the coil has had (or lacked) current for the opening (closing) delay; a pulse, or a gap,
//! that is not longer moves nothing: below a duty of `f` times the opening delay such a valve does
//! not open. Delays and dead region as in R. B. van Varseveld & G. M. Bone, "Accurate position
//! control of a pneumatic actuator using on/off solenoid valves", IEEE/ASME Trans. Mechatronics 2,
//! 1997. A form is called after the paths that are open with current and without; with `either` a
//! valve has two coils, one for each sign of what comes in.

use super::{
    begun, Effect, EffectInfo, EffectParameter, EffectState, Form, Make, Port, Role, BEGINNING,
    BEGUN,
};
use crate::blocks::gas::Gas;
use crate::blocks::spool::moved;
use crate::key;
use crate::made_by;
use crate::scalar::{constant, Scalar};
use std::f64::consts::TAU;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "spool",
    block: "valve",
    at: "valve",
    source: "Richer & Hurmuzlu (2000); van Varseveld & Bone (1997)",
    order: u8::MAX,
    forms: &[
        SECOND_ORDER,
        switching("fill_closed", made_by!(make_switching::<_, 1, 0>)),
        switching("fill_vent", made_by!(make_switching::<_, 1, -1>)),
        switching("vent_closed", made_by!(make_switching::<_, -1, 0>)),
        switching("vent_fill", made_by!(make_switching::<_, -1, 1>)),
        switching("closed_fill", made_by!(make_switching::<_, 0, 1>)),
        switching("closed_vent", made_by!(make_switching::<_, 0, -1>)),
        switching("either_closed", made_by!(make_switching::<_, EITHER, 0>)),
    ],
    ..EffectInfo::USUAL
};

const SECOND_ORDER: Form = Form {
    name: "second_order",
    parameters: &[
        EffectParameter::of(key!("valve", "natural_frequency"), 100.0),
        EffectParameter::of(key!("valve", "damping_ratio"), 0.7),
    ],
    states: &[
        BEGINNING,
        EffectState { name: "position", role: Role::Opens },
        EffectState { name: "rate", role: Role::Opens },
    ],
    integrates: false,
    ports: &[Port::Command],
    make: made_by!(make),
};

const fn keeps(name: &'static str) -> EffectState {
    EffectState { name, role: Role::Keeps }
}

const DELAYS_AND_CARRIER: &[EffectParameter] = &[
    EffectParameter::of(key!("valve", "opening_delay"), 0.0),
    EffectParameter::of(key!("valve", "closing_delay"), 0.0),
    EffectParameter::of(key!("valve", "carrier_frequency"), 0.0),
    EffectParameter::of(key!("valve", "carrier_phase"), 0.0),
];

const SWITCHING_STATES: &[EffectState] = &[
    BEGINNING,
    keeps("position"),
    keeps("aim"),
    keeps("aimed_at"),
    keeps("duty"),
    keeps("periods"),
];

const fn switching(name: &'static str, make: Make) -> Form {
    Form {
        name,
        parameters: DELAYS_AND_CARRIER,
        states: SWITCHING_STATES,
        integrates: false,
        ports: &[Port::Switching],
        make,
    }
}

/// A mass on a spring; its states say that it has begun, where it is, and how fast it moves.
#[derive(Debug, Clone, Copy)]
struct SecondOrder<S> {
    /// Natural frequency [rad/s].
    natural: S,
    damping: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(SecondOrder { natural: values[0] * TAU, damping: values[1] })
}

impl<S: Scalar> SecondOrder<S> {
    fn moved(&self, own: &[S], input: S, age: f64) -> [S; 2] {
        if begun(own) {
            moved([own[1], own[2]], input, self.natural, self.damping, age)
        } else {
            [input, constant(0.0)]
        }
    }
}

impl<S: Scalar> Effect<S> for SecondOrder<S> {
    fn position(&self, own: &[S], input: S, age: f64) -> S {
        self.moved(own, input, age)[0]
    }

    fn follow(&self, own: &mut [S], input: S, step: f64) -> S {
        let [position, rate] = self.moved(own, input, step);
        own.copy_from_slice(&[constant(BEGUN), position, rate]);
        position
    }

    fn linear_rates(&self, own: &[S], input: S, out: &mut [S]) {
        let Self { natural, damping } = *self;
        out[1] = own[2];
        out[2] = natural * natural * (input - own[1]) - damping * natural * own[2] * 2.0;
    }

    fn fastest(&self) -> f64 {
        let (natural, damping) = (self.natural.re(), self.damping.re());
        natural * (damping + (damping * damping - 1.0).max(0.0).sqrt()).max(1.0)
    }
}

/// Two coils, one for each sign.
const EITHER: i8 = 2;
/// Below it a coil has no current where no carrier makes pulses.
const HALF: f64 = 0.5;
/// What lies nearer to the end of a step than this share of it lies in the next one.
const ON_EDGE: f64 = 1e-9;

/// A spool that switches. Its states say that it has begun, where it is, where the coil's current
/// takes it, since when [s], the duty of this period of the carrier, and which period is next.
#[derive(Debug, Clone, Copy)]
struct Switching<S, const WITH: i8, const WITHOUT: i8> {
    opening_delay: S,
    closing_delay: S,
    frequency: S,
    phase: S,
}

fn make_switching<S: Scalar, const WITH: i8, const WITHOUT: i8>(
    values: &[S],
    _gas: &Gas,
) -> Box<dyn Effect<S>> {
    Box::new(Switching::<S, WITH, WITHOUT> {
        opening_delay: values[0],
        closing_delay: values[1],
        frequency: values[2],
        phase: values[3],
    })
}

/// What happens next.
#[derive(Clone, Copy)]
enum Next {
    /// What comes in becomes another.
    Change,
    /// A period of the carrier begins.
    Period,
    /// The pulse of this period ends.
    Off,
    /// The spool switches.
    Turn,
}

impl<S: Scalar, const WITH: i8, const WITHOUT: i8> Switching<S, WITH, WITHOUT> {
    /// Where no current leaves it.
    const REST: f64 = WITHOUT as f64;

    fn pulses(&self) -> bool {
        self.frequency.re() > 0.0
    }

    /// Where current takes it, for what comes in.
    fn taken(input: f64) -> f64 {
        if WITH == EITHER {
            input.signum()
        } else {
            f64::from(WITH)
        }
    }

    /// What comes in as a duty: one coil knows no negative one.
    fn duty(input: S) -> S {
        if WITH != EITHER && input.re() < 0.0 {
            constant(0.0)
        } else {
            input
        }
    }

    /// Where a coil that is not pulsed takes it.
    fn level(input: S) -> f64 {
        let duty = Self::duty(input).re();
        if duty.abs() > HALF {
            Self::taken(duty)
        } else {
            Self::REST
        }
    }

    /// Where the pulses of a duty take it while they last.
    fn pulsed(duty: f64) -> f64 {
        if duty.abs() > 0.0 {
            Self::taken(duty)
        } else {
            Self::REST
        }
    }

    /// Beginning of a period of the carrier [s].
    fn period(&self, number: f64) -> S {
        (self.phase + number) / self.frequency
    }

    /// Where it goes from a position, and how long after the coil says so [s].
    fn turn(&self, position: f64, aim: f64) -> (f64, S) {
        let rest = Self::REST;
        if position != rest {
            (rest, self.closing_delay) // from one coil to the other it goes through the middle
        } else {
            (aim, self.opening_delay)
        }
    }

    /// Its states where a run begins: the coil is as it is, and has been for long.
    fn begin(&self, own: &mut [S], input: S, time: f64) {
        let duty = Self::duty(input);
        let (mut aim, mut number) = (Self::level(input), 0.0);
        if self.pulses() {
            let periods = time * self.frequency.re() - self.phase.re();
            number = (periods + ON_EDGE).floor();
            let on = periods - number < duty.re().abs();
            aim = if on { Self::pulsed(duty.re()) } else { Self::REST };
            number += 1.0;
        }
        let states = [BEGUN, aim, aim, time].map(constant);
        own[..4].copy_from_slice(&states);
        (own[4], own[5]) = (duty, constant(number));
    }

    /// What happens first, and when [s].
    fn next(&self, own: &[S], change: Option<S>) -> Option<(Next, S)> {
        let (position, aim) = (own[1].re(), own[2].re());
        let mut found: Option<(Next, S)> = change.map(|at| (Next::Change, at));
        let mut earlier = |next: Next, at: S| {
            if found.is_none_or(|(_, first)| at.re() < first.re()) {
                found = Some((next, at));
            }
        };
        if self.pulses() {
            earlier(Next::Period, self.period(own[5].re()));
            let duty = own[4].abs();
            if aim != Self::REST && duty.re() < 1.0 {
                earlier(Next::Off, self.period(own[5].re() - 1.0) + duty / self.frequency);
            }
        }
        if position != aim {
            earlier(Next::Turn, own[3] + self.turn(position, aim).1);
        }
        found
    }
}

/// The coil takes a spool somewhere from an instant on.
fn aim_at<S: Scalar>(own: &mut [S], aim: f64, at: S) {
    if own[2].re() != aim {
        (own[2], own[3]) = (constant(aim), at);
    }
}

impl<S: Scalar, const WITH: i8, const WITHOUT: i8> Effect<S> for Switching<S, WITH, WITHOUT> {
    fn position(&self, own: &[S], input: S, _age: f64) -> S {
        if begun(own) {
            own[1]
        } else {
            constant(Self::level(input))
        }
    }

    fn switched_to(
        &self,
        own: &mut [S],
        input: &dyn Fn(f64) -> S,
        change: Option<S>,
        (time, step): (f64, f64),
        tell: &mut dyn FnMut(S, f64),
    ) {
        if !begun(own) {
            self.begin(own, input(0.0), time);
            tell(constant(0.0), own[1].re());
        }
        let end = time + step * (1.0 - ON_EDGE);
        let mut change = if self.pulses() { None } else { change };
        if !self.pulses() && change.is_none() {
            aim_at(own, Self::level(input(0.0)), constant(time));
        }
        while let Some((next, at)) = self.next(own, change.map(|after| after + time)) {
            if at.re() >= end {
                break;
            }
            let after = (at.re() - time).max(0.0);
            match next {
                Next::Change => {
                    change = None;
                    aim_at(own, Self::level(input(step)), at);
                }
                Next::Period => {
                    own[4] = Self::duty(input(after));
                    own[5] += 1.0;
                    aim_at(own, Self::pulsed(own[4].re()), at);
                }
                Next::Off => aim_at(own, Self::REST, at),
                Next::Turn => {
                    let to = self.turn(own[1].re(), own[2].re()).0;
                    own[1] = constant(to);
                    if to != own[2].re() && (own[3] + self.opening_delay).re() < at.re() {
                        own[3] = at - self.opening_delay; // one coil has let go, the other pulls
                    }
                    tell(at - at.re() + after, own[1].re());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    type Filling<S> = Switching<S, 1, 0>;

    /// Positions and the instants at which they are taken over some steps.
    fn run<S: Scalar, const WITH: i8, const WITHOUT: i8>(
        spool: &Switching<S, WITH, WITHOUT>,
        steps: usize,
        step: f64,
        input: impl Fn(f64) -> S,
    ) -> Vec<(S, f64)> {
        let (mut own, mut found) = (vec![constant(0.0); 6], Vec::new());
        for k in 0..steps {
            let time = k as f64 * step;
            let mut tell = |after: S, position| found.push((after + time, position));
            let at = |age: f64| input(time + age);
            spool.switched_to(&mut own, &at, None, (time, step), &mut tell);
        }
        found
    }

    /// How long it was open from 0.1 s to the end.
    fn open(found: &[(f64, f64)], end: f64) -> f64 {
        let ends = found.iter().skip(1).map(|(at, _)| *at).chain([end]);
        let share =
            |((at, position), end): (&(f64, f64), f64)| (end.max(0.1) - at.max(0.1)) * position;
        found.iter().zip(ends).map(share).sum()
    }

    fn filling(opening: f64, closing: f64, frequency: f64) -> Filling<f64> {
        Switching { opening_delay: opening, closing_delay: closing, frequency, phase: 0.0 }
    }

    #[test]
    fn a_duty_opens_it_by_its_share_less_what_opening_takes() {
        let (opening, closing, frequency) = (3e-3, 1e-3, 50.0);
        let spool = filling(opening, closing, frequency);
        for step in [0.8e-3, 1e-3, 5e-3, 20e-3, 40e-3] {
            let steps = (1.0 / step + 0.5) as usize;
            for duty in [0.0, 0.1, 0.149, 0.2, 0.5, 0.94, 0.96, 1.0] {
                let found = run(&spool, steps, step, |_| duty);
                let share = open(&found, 1.0) / 0.9;
                let pulse = duty / frequency;
                let wanted = if pulse <= opening {
                    0.0
                } else if 1.0 / frequency - pulse <= closing {
                    1.0
                } else {
                    duty + (closing - opening) * frequency
                };
                assert!((share - wanted).abs() < 1e-9, "{step} {duty}: {share}");
            }
        }
    }

    #[test]
    fn the_instants_do_not_depend_on_the_steps() {
        let spool = filling(2e-3, 1e-3, 70.0);
        let duty = |time: f64| 0.5 + 0.3 * (9.0 * time).sin();
        let fine = run(&spool, 4000, 1e-4, duty);
        for steps in [37, 100, 400] {
            let coarse = run(&spool, steps, 0.4 / steps as f64, duty);
            assert_eq!(coarse.len(), fine.len());
            assert!(coarse.iter().zip(&fine).all(|(a, b)| (a.0 - b.0).abs() < 1e-12 && a.1 == b.1));
        }
    }

    #[test]
    fn without_a_carrier_it_switches_late_and_short_pulses_move_nothing() {
        let spool = filling(3e-3, 1e-3, 0.0);
        let current =
            |time: f64| if (0.01..0.012).contains(&time) || time > 0.0199 { 1.0 } else { 0.0 };
        let found = run(&spool, 30, 1e-3, current);
        assert_eq!(found.len(), 2);
        assert!((found[1].0 - 0.023).abs() < 1e-12 && found[1].1 == 1.0);
    }

    #[test]
    fn two_coils_go_through_the_middle() {
        let spool = Switching::<f64, EITHER, 0> {
            opening_delay: 3e-3,
            closing_delay: 1e-3,
            frequency: 0.0,
            phase: 0.0,
        };
        let found = run(&spool, 30, 1e-3, |time| if time < 0.0099 { 1.0 } else { -1.0 });
        let near = |k: usize, at: f64, p: f64| (found[k].0 - at).abs() < 1e-12 && found[k].1 == p;
        assert!(near(0, 0.0, 1.0) && near(1, 0.011, 0.0) && near(2, 0.013, -1.0), "{found:?}");
        // 3/2: without current it vents
        let valve = Switching::<f64, 1, -1> {
            opening_delay: 3e-3,
            closing_delay: 1e-3,
            frequency: 0.0,
            phase: 0.0,
        };
        let found = run(&valve, 30, 1e-3, |time| if time < 0.0099 { 0.0 } else { 1.0 });
        assert_eq!((found[0].1, found[1].1, found.len()), (-1.0, 1.0, 2));
    }

    #[test]
    fn instants_move_with_delays_duty_carrier_and_phase() {
        let plain = [2e-3, 1e-3, 60.0, 0.3, 0.4];
        let instants = |v: [f64; 5]| {
            let spool = Filling::<f64> {
                opening_delay: v[0],
                closing_delay: v[1],
                frequency: v[2],
                phase: v[3],
            };
            run(&spool, 50, 1e-3, |_| v[4])
        };
        for k in 0..5 {
            let v: [Slope; 5] =
                std::array::from_fn(|i| Slope::new(plain[i], f64::from(u8::from(i == k))));
            let spool = Filling::<Slope> {
                opening_delay: v[0],
                closing_delay: v[1],
                frequency: v[2],
                phase: v[3],
            };
            let exact = run(&spool, 50, 1e-3, |_| v[4]);
            let h = 1e-6 * plain[k];
            let (mut more, mut less) = (plain, plain);
            (more[k], less[k]) = (plain[k] + h, plain[k] - h);
            let (more, less) = (instants(more), instants(less));
            assert!(exact.len() > 3 && exact.len() == more.len());
            for ((exact, more), less) in exact.iter().zip(&more).zip(&less).skip(1) {
                let wanted = (more.0 - less.0) / (2.0 * h);
                assert!((exact.0.slope() - wanted).abs() < 1e-6 * (1.0 + wanted.abs()), "{k}");
            }
        }
    }
}
