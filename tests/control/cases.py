"""Every controller, made new, for one plant or with gains of a batch."""

import math

import numpy as np

import pamrs
from pamrs.control import (
    PID,
    AdaptiveSliding,
    AirModel,
    ArmModel,
    ByLength,
    Cascade,
    DeadZoneCompensation,
    Feedforward,
    FeedforwardPressure,
    FullTorque,
    Fuzzy,
    HysteresisCompensation,
    Neural,
    Parallel,
    PressureLoop,
    Recruitment,
    Reference,
    RigController,
    RigModel,
    Sliding,
    cascaded_pid,
)
from tests.tables import rows_of

SHOULDER = pamrs.rigs.shoulder()
FULL = ArmModel.from_rig(SHOULDER)
SIMPLIFIED = ArmModel.from_rig(SHOULDER, torque="simplified")
GAYLORD = ArmModel.from_rig(SHOULDER, torque="gaylord")
AIR = AirModel(SHOULDER)
#: Another torque than that of FULL, so that a feedforward has two branches.
LENGTHENING = FullTorque(SHOULDER.with_parameters({"muscle.modulus_scale": 0.8}), lengthening=True)
DIAGNOSED = SHOULDER.with_effect(
    "muscle_hysteresis", {"friction_constant": 15.0, "friction_pressure": 8e-5, "presliding": 1e-3}
).with_effect("valve_dead_zone", {"half_width": 0.04})
PERIOD = 0.005
PAIR = RigModel(pamrs.rigs.named("antagonistic_joint"))
ARM = RigModel(pamrs.rigs.named("two_joint_arm"))
REGULATED = RigModel(pamrs.rigs.named("regulated_joint"), pressure_limit=1e6)
MASS = RigModel(pamrs.rigs.named("hanging_mass"))
WHOLE = RigModel(pamrs.rigs.named("recruitment"))
BUNDLE = RigModel(pamrs.rigs.named("recruitment"), active=("pair_1", "pair_3"))


def stiffer(time):
    """A stiffness [N m/rad] that rises."""
    return 15.0 + time


def rows(x):
    """A gain of a batch of plants for both joints of the arm."""
    return np.tile(x, 2) if isinstance(x, np.ndarray) else x


# name -> a function of a factor on its gains (a float or an array)
CONTROLLERS = {
    "pid": lambda x: PID(2.0 * x, 1.5, 0.1, period=PERIOD),
    "pid back-calculation": lambda x: PID(
        1.0 * x, 0.3, 0.05, anti_windup="back_calculation", period=PERIOD, angle_filter=0.01
    ),
    "pid measured rate": lambda x: PID(2.0, 1.5, 0.2 * x, period=PERIOD, measured_rate=True),
    "fuzzy": lambda x: Fuzzy(1.0 * x, 0.5, 0.5, period=PERIOD, output_filter=0.02),
    "fuzzy quoted": lambda x: Fuzzy(
        1.0, 0.5 * x, 0.5 * x, table="quoted", period=PERIOD, output_filter=0.02
    ),
    "feedforward": lambda x: Feedforward(FULL, AIR, 1.0 * x, period=PERIOD),
    "feedforward friction": lambda x: Feedforward(
        FULL.scaled(x), AIR, 5.0, friction=True, pressure_filter=0.01, period=PERIOD
    ),
    "feedforward measured": lambda x: Feedforward(
        FULL, AIR, 1.0 * x, motion="measured", lengthening=LENGTHENING, period=PERIOD
    ),
    "feedforward + pid": lambda x: Parallel(
        Feedforward(FULL, AIR, 1.0, period=PERIOD), PID(x, 0.3, period=PERIOD)
    ),
    "feedforward + fuzzy": lambda x: Parallel(
        Feedforward(FULL, AIR, 2.0 * x, period=PERIOD), Fuzzy(0.8, 0.5, 0.5, period=PERIOD)
    ),
    "feedforward + cascade": lambda x: Parallel(
        Feedforward(FULL, AIR, 0.5, period=PERIOD), cascaded_pid(1.38e6, kp=6e5 * x, period=PERIOD)
    ),
    "feedforward pressure": lambda x: Cascade(
        FeedforwardPressure(FULL.scaled(x), friction=True, period=PERIOD)
    ),
    "cascaded pid": lambda x: cascaded_pid(1.38e6, kp=6e5 * x, period=PERIOD),
    "cascaded pi": lambda x: cascaded_pid(1.38e6, kp=1e5 * x, ki=1e5, kd=0.0, period=PERIOD),
    "pressure loop": lambda x: PressureLoop(2e-4 * x, 2e-4, period=PERIOD),
    "sliding": lambda x: Cascade(Sliding(SIMPLIFIED, slope=5.0 * x, period=PERIOD)),
    "sliding signum": lambda x: Cascade(
        Sliding(FULL, boundary_layer=0.0, switching=2e4 * x, period=PERIOD)
    ),
    "sliding estimates": lambda x: Cascade(Sliding(SIMPLIFIED.scaled(x), period=PERIOD)),
    "adaptive": lambda x: Cascade(
        AdaptiveSliding(SIMPLIFIED, (1.0, 5.0, 300.0 * x), period=PERIOD)
    ),
    "adaptive free": lambda x: Cascade(
        AdaptiveSliding(SIMPLIFIED, (x, x, x), bounds=None, hold_at_limit=False, period=PERIOD)
    ),
    "adaptive published": lambda x: Cascade(
        AdaptiveSliding.published(SIMPLIFIED, 1, slope=4.0 * x, period=PERIOD)
    ),
    "neural zero": lambda x: Cascade(Neural(SIMPLIFIED, slope=3.0 * x, period=PERIOD)),
    "neural model": lambda x: Cascade(
        Neural(FULL, start="model", gains=(300.0, 2e4, 3e5 * x), period=PERIOD)
    ),
    "neural gaylord": lambda x: Cascade(
        Neural(GAYLORD, start="model", bounds=None, switching=4e5 * x, period=PERIOD)
    ),
    "hysteresis sliding": lambda x: HysteresisCompensation(
        Cascade(Sliding(FULL, slope=5.0 * x, period=PERIOD)), DIAGNOSED
    ),
    "hysteresis feedforward": lambda x: HysteresisCompensation(
        Feedforward(FULL, AIR, 5.0 * x, period=PERIOD), DIAGNOSED, source="measured"
    ),
    "rig pair sliding": lambda x: RigController(
        PAIR, PAIR.law("sliding", slope=8.0 * x, period=PERIOD), stiffness=15.0
    ),
    "rig pair feedforward": lambda x: RigController(
        PAIR, PAIR.law("feedforward", period=PERIOD), stiffness=stiffer, km=20.0 * x
    ),
    "rig pair neural": lambda x: RigController(
        PAIR, PAIR.law("neural", switching=4e4 * x, start="model", period=PERIOD)
    ),
    "rig arm feedforward": lambda x: RigController(
        ARM, ARM.law("feedforward", period=PERIOD), km=20.0 * x
    ),
    "rig arm sliding": lambda x: RigController(
        ARM, ARM.law("sliding", slope=rows(5.0 * x), period=PERIOD)
    ),
    "rig arm adaptive": lambda x: RigController(
        ARM, ARM.law("adaptive", slope=rows(5.0 * x), period=PERIOD)
    ),
    "rig arm neural": lambda x: RigController(
        ARM, ARM.law("neural", start="model", slope=rows(3.0 * x), period=PERIOD)
    ),
    "rig arm neural zero": lambda x: RigController(
        ARM, ARM.law("neural", slope=rows(3.0 * x), period=PERIOD)
    ),
    "rig regulated adaptive": lambda x: RigController(
        REGULATED, REGULATED.law("adaptive", slope=5.0 * x, period=PERIOD)
    ),
    "rig bundle sliding": lambda x: RigController(
        BUNDLE, BUNDLE.law("sliding", switching=2e4 * x, period=PERIOD)
    ),
    "rig whole recruited": lambda x: RigController(
        WHOLE,
        WHOLE.law("sliding", switching=2e4 * x, period=PERIOD),
        shares=Recruitment(
            WHOLE.torques_of("shoulder"),
            WHOLE.pressure_limit,
            period=PERIOD,
            dwell=0.1,
            add_at=0.3,
            drop_at=0.2,
        ),
    ),
    "rig mass by length": lambda x: ByLength(
        Cascade(
            Sliding(MASS.arm, slope=5.0 * x, switching=4e3, boundary_layer=0.01, period=PERIOD),
            MASS.pressure_loop("", period=PERIOD),
        ),
        MASS.rig,
    ),
    "rig mass adaptive": lambda x: RigController(
        MASS, MASS.law("adaptive", slope=5.0 * x, period=PERIOD)
    ),
    "dead zone": lambda x: DeadZoneCompensation(PID(2.0 * x, 1.5, 0.1, period=PERIOD), DIAGNOSED),
}


def smooth(time):
    """From the stop at 15 deg smoothly up to 75 deg in 4 s, then slow waves about there."""
    low, high, rise = math.radians(15.0), math.radians(75.0), 4.0
    if time < rise:
        w = math.pi / rise
        half = 0.5 * (high - low)
        return Reference(
            low + half * (1.0 - math.cos(w * time)),
            half * w * math.sin(w * time),
            half * w * w * math.cos(w * time),
        )
    a, w, since = math.radians(10.0), 1.2, time - rise
    return Reference(
        high - a * (1.0 - math.cos(w * since)),
        -a * w * math.sin(w * since),
        -a * w * w * math.cos(w * since),
    )


def samples(count, seed=0, shape=()):
    """Made-up measurements that move like an arm, for tests without a plant."""
    rng = np.random.default_rng(seed)
    offset, noise = rng.normal(scale=0.2, size=shape), rng.normal(scale=1e-3, size=(count, *shape))
    for k in range(count):
        t = k * PERIOD
        yield {
            "joint_angle": 0.9 + offset + 0.5 * np.sin(1.3 * t) + noise[k],
            "joint_rate": 0.65 * np.cos(1.3 * t) + 0.0 * offset,
            "muscle_pressure": 4e5 * (1.0 + 0.5 * np.sin(1.1 * t + offset)),
            "supply_pressure": 1.3e6 + 0.0 * offset,
        }


def told(name, sample):
    """A sample with the channels' names of the rig that a controller is for."""
    if not name.startswith("rig "):
        return sample
    renamed = {}
    for channel in CHANNELS[name.split()[1]]:
        word, _, block = channel.partition(".")
        if word == "length":
            renamed[channel] = 0.275 - 0.03 * sample["joint_angle"]
            continue
        # no two blocks see the same
        renamed[channel] = sample[word] * (1.0 + 0.01 * len(block)) if block else sample[word]
    return renamed


def commands(answer):
    """The commands of an answer by name: one, or those of a rig."""
    if not isinstance(answer, dict):
        return {"": answer}
    found = {}
    for word, value in answer.items():
        parts = value.items() if isinstance(value, dict) else [("", value)]
        found |= {f"{word}.{name}": command for name, command in parts}
    return found


#: What the controllers of each rig read.
CHANNELS = rows_of(__file__, "channels")


def singles(measurement, row=None):
    """One plant of a batch of measurements, as floats."""
    return {
        name: float(value if row is None else value[row]) for name, value in measurement.items()
    }
