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
from pamrs.control._protocol import commands_of
from tests.tables import rows_of

SHOULDER = pamrs.rigs.shoulder()
FULL = ArmModel.from_rig(SHOULDER)
SIMPLIFIED = ArmModel.from_rig(SHOULDER, torque="simplified")
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


def forward(km, model=FULL, **options):
    """A feedforward of the shoulder."""
    return Feedforward(model, AIR, km, period=PERIOD, **options)


def follow(law, model, *gains, **options):
    """A law that asks for a pressure, and the loop that makes it."""
    return Cascade(law(model, *gains, period=PERIOD, **options))


def whole(model, kind, *, stiffness=None, km=20.0, shares=None, **gains):
    """A law for every command of a rig."""
    law = model.law(kind, period=PERIOD, **gains)
    return RigController(model, law, stiffness=stiffness, km=km, shares=shares)


def recruited():
    """How the groups of a bundle are recruited."""
    torques, quick = WHOLE.torques_of("shoulder"), {"dwell": 0.1, "add_at": 0.3, "drop_at": 0.2}
    return Recruitment(torques, WHOLE.pressure_limit, period=PERIOD, **quick)


def by_length(slope):
    """A law that is told the shortening of the muscle of a mass."""
    surface = {"slope": slope, "switching": 4e3, "boundary_layer": 0.01}
    law, loop = Sliding(MASS.arm, **surface, period=PERIOD), MASS.pressure_loop("", period=PERIOD)
    return ByLength(Cascade(law, loop), MASS.rig)


BACK = {"anti_windup": "back_calculation", "angle_filter": 0.01}
# name -> a function of a factor on its gains (a float or an array)
CONTROLLERS = {
    "pid": lambda x: PID(2.0 * x, 1.5, 0.1, period=PERIOD),
    "pid back-calculation": lambda x: PID(1.0 * x, 0.3, 0.05, period=PERIOD, **BACK),
    "pid measured rate": lambda x: PID(2.0, 1.5, 0.2 * x, period=PERIOD, measured_rate=True),
    "fuzzy": lambda x: Fuzzy(1.0 * x, 0.5, 0.5, period=PERIOD, output_filter=0.02),
    "feedforward": lambda x: forward(1.0 * x),
    "feedforward friction": lambda x: forward(
        5.0, FULL.scaled(x), friction=True, pressure_filter=0.01
    ),
    "feedforward measured": lambda x: forward(x, motion="measured", lengthening=LENGTHENING),
    "feedforward + pid": lambda x: Parallel(forward(1.0), PID(x, 0.3, period=PERIOD)),
    "feedforward + fuzzy": lambda x: Parallel(
        forward(2.0 * x), Fuzzy(0.8, 0.5, 0.5, period=PERIOD)
    ),
    "feedforward + cascade": lambda x: Parallel(
        forward(0.5), cascaded_pid(1.38e6, kp=6e5 * x, period=PERIOD)
    ),
    "feedforward pressure": lambda x: follow(FeedforwardPressure, FULL.scaled(x), friction=True),
    "cascaded pid": lambda x: cascaded_pid(1.38e6, kp=6e5 * x, period=PERIOD),
    "cascaded pi": lambda x: cascaded_pid(1.38e6, kp=1e5 * x, ki=1e5, kd=0.0, period=PERIOD),
    "pressure loop": lambda x: PressureLoop(2e-4 * x, 2e-4, period=PERIOD),
    "sliding": lambda x: follow(Sliding, SIMPLIFIED, slope=5.0 * x),
    "sliding signum": lambda x: follow(Sliding, FULL, boundary_layer=0.0, switching=2e4 * x),
    "sliding estimates": lambda x: follow(Sliding, SIMPLIFIED.scaled(x)),
    "adaptive": lambda x: follow(AdaptiveSliding, SIMPLIFIED, (1.0, 5.0, 300.0 * x)),
    "adaptive free": lambda x: follow(
        AdaptiveSliding, SIMPLIFIED, (x, x, x), bounds=None, hold_at_limit=False
    ),
    "neural zero": lambda x: follow(Neural, SIMPLIFIED, slope=3.0 * x),
    "neural model": lambda x: follow(Neural, FULL, start="model", gains=(300.0, 2e4, 3e5 * x)),
    "hysteresis sliding": lambda x: HysteresisCompensation(
        follow(Sliding, FULL, slope=5.0 * x), DIAGNOSED
    ),
    "hysteresis feedforward": lambda x: HysteresisCompensation(
        forward(5.0 * x), DIAGNOSED, source="measured"
    ),
    "rig pair sliding": lambda x: whole(PAIR, "sliding", slope=8.0 * x, stiffness=15.0),
    "rig pair feedforward": lambda x: whole(PAIR, "feedforward", stiffness=stiffer, km=20.0 * x),
    "rig pair neural": lambda x: whole(PAIR, "neural", switching=4e4 * x, start="model"),
    "rig arm feedforward": lambda x: whole(ARM, "feedforward", km=20.0 * x),
    "rig arm sliding": lambda x: whole(ARM, "sliding", slope=rows(5.0 * x)),
    "rig arm adaptive": lambda x: whole(ARM, "adaptive", slope=rows(5.0 * x)),
    "rig arm neural": lambda x: whole(ARM, "neural", start="model", slope=rows(3.0 * x)),
    "rig arm neural zero": lambda x: whole(ARM, "neural", slope=rows(3.0 * x)),
    "rig regulated adaptive": lambda x: whole(REGULATED, "adaptive", slope=5.0 * x),
    "rig bundle sliding": lambda x: whole(BUNDLE, "sliding", switching=2e4 * x),
    "rig whole recruited": lambda x: whole(WHOLE, "sliding", switching=2e4 * x, shares=recruited()),
    "rig mass by length": lambda x: by_length(5.0 * x),
    "rig mass adaptive": lambda x: whole(MASS, "adaptive", slope=5.0 * x),
}


def smooth(time):
    """From the stop at 15 deg smoothly up to 75 deg in 4 s, then slow waves about there."""
    low, size, w, since = math.radians(15.0), math.radians(30.0), math.pi / 4.0, time
    if time >= 4.0:
        low, size, w, since = math.radians(75.0), -math.radians(10.0), 1.2, time - 4.0
    cosine, sine = math.cos(w * since), math.sin(w * since)
    return Reference(low + size * (1.0 - cosine), size * w * sine, size * w * w * cosine)


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
        # no two blocks see the same
        value = 0.275 - 0.03 * sample["joint_angle"] if word == "length" else sample[word]
        renamed[channel] = value * (1.0 + 0.01 * len(block)) if block else value
    return renamed


def commands(answer):
    """The commands of an answer by name: one, or those of a rig."""
    return dict(commands_of(answer)) if isinstance(answer, dict) else {"": answer}


#: What the controllers of each rig read.
CHANNELS = rows_of(__file__, "channels")


def singles(measurement, row=None):
    """One plant of a batch of measurements, as floats."""
    return {
        name: float(value if row is None else value[row]) for name, value in measurement.items()
    }
