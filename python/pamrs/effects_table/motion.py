"""Effects on joint and arm."""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.entry import EffectInfo
from pamrs.effects_table.entry import EffectParameter as Parameter

__all__ = ["MOTION"]

MOTION: Final[tuple[EffectInfo, ...]] = (
    EffectInfo(
        id="joint_coulomb_stribeck",
        label="joint friction (Coulomb, Stribeck)",
        name="stiction of the joint above its Coulomb friction (Stribeck)",
        block="joint",
        at="joint",
        equation="tau = -(f_s - f) exp(-(w/w_s)^2) tanh(10 w/w_s), beside f of the arm",
        fingerprint="the joint stands while the pressure moves, then breaks away; largest at each return, the same at all pressures",
        separates="friction of the braid grows with pressure and doubles with co-contraction; "
        "a dead band holds the pressure itself; a push from outside does not come again with the command",
        parameters=(
            Parameter("stiction", "N m", 1.0, 0.0, 1e6, (0.5, 3.0), "static friction above the Coulomb friction", 0.0),
            Parameter("stribeck_speed", "rad/s", 0.05, 1e-3, 1e3, (0.02, 0.1), "speed over which it fades"),
        ),
        reference="Armstrong-Helouvry, Dupont & Canudas de Wit (1994)",
        rivals=("muscle_hysteresis", "supply_regulator_deadband", "external_torque"),
    ),
    EffectInfo(
        id="joint_end_stop",
        name="stop of the joint before the nominal one",
        block="joint",
        at="joint",
        equation="tau = -k d (d/10 deg)^(n-1) (1 + c d'), d the depth beyond the stop (rounded over 0.2 deg), never a pull",
        fingerprint="motion ends or rebounds at one angle, at all pressures, and the pressure does not move it further",
        separates="crowding grows with pressure and has no rebound; the end of the muscle's stroke is smooth",
        parameters=(
            Parameter("stiffness", "N m/rad", 500.0, 0.0, 1e9, (200.0, 2000.0), "of the stop, the secant at a depth of 10 deg", 0.0),
            Parameter("angle", "rad", 1.2, -7.0, 7.0, (1.2,), "where it is met", role="place", channel="joint_angle"),
            Parameter("dissipation", "s/rad", 0.5, 0.0, 1e4, (0.5,), "growth of its torque with the speed of the blow"),
            Parameter("exponent", "1", 1.0, 1.0, 4.0, (1.5,), "of the depth: 1 a spring, 2 to 3 rubber that is compressed"),
            Parameter("side", "1", 1.0, -1.0, 1.0, (-1.0, 1.0), "1: an upper stop, -1: a lower one", role="side"),
        ),
        reference="Hunt & Crossley (1975)",
        rivals=("pam_crowding_contact", "the end of the muscle's stroke"),
    ),
    EffectInfo(
        id="payload_swing",
        name="payload that swings on a cord",
        block="arm",
        at="joint",
        place="the last joint",
        equation="mu = s m_p on a cord l: l phi'' = -(a + g) t - 2 z sqrt(g/l) l phi', pull on the link along the cord",
        fingerprint="after each manoeuvre a slightly damped oscillation near sqrt(g/l)/(2 pi) that no pressure changes",
        separates="a base that gives way rings faster and depends less on the pose; "
        "the arm on its muscles rings faster at higher pressure",
        parameters=(
            Parameter("swinging_share", "1", 0.5, 0.0, 1.0, (0.2, 0.8), "share of the payload that swings", 0.0),
            Parameter("length", "m", 0.3, 1e-3, 100.0, (0.15, 0.5), "of the cord", expected=(0.1, 0.5), scan=(0.06, 1.5, 14)),
            Parameter("damping_ratio", "1", 0.02, 0.0, 10.0, (0.02,), "of the pendulum", expected=(0.0, 0.03), tried=0.08),
        ),
        reference="Landau & Lifshitz, Mechanics, section 5 (double pendulum)",
        rivals=("base_flexibility", "the arm's own swing on its muscles"),
    ),
    EffectInfo(
        id="payload_change",
        name="payload that changes during a recording",
        block="arm",
        at="joint",
        place="the last joint",
        needs=(("load", "mass"), ("joint", "")),
        equation="m_p -> m_p + dm from a time on (over 20 ms); the hanging mass of a load",
        fingerprint="from a moment on another torque holds the same pose, in proportion to the weight's lever; inertia changes too",
        separates="an external torque does not change with the pose; a wrong payload is wrong from the start",
        parameters=(
            Parameter(
                "mass_change",
                "kg",
                1.0,
                -1e6,
                1e6,
                (-2.0, 2.0),
                "what is added (negative: taken away)",
                0.0,
                tried=0.3,
                same_everywhere=True,
            ),
            Parameter("time", "s", 5.0, -1e9, 1e9, (5.0, 15.0), "when, from the start of the recording", role="time"),
        ),
        reference="Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, ch. 7",
        rivals=("external_torque", "a payload that is off"),
    ),
    EffectInfo(
        id="external_torque",
        name="push from outside",
        block="arm",
        at="joint",
        equation="tau_ext from a time on, for a duration, edges over a rise; up to three times",
        fingerprint="a torque that begins and ends at moments which no command explains, and that does not repeat with the command",
        separates="stiction repeats with the command; a payload's change stays and follows the pose",
        parameters=(
            Parameter("torque", "N m", 5.0, -1e9, 1e9, (-5.0, 5.0), "of the push", 0.0, tried=1.0),
            Parameter("time", "s", 5.0, -1e9, 1e9, (5.0, 15.0), "when it begins, from the start of the recording", role="time"),
            Parameter("duration", "s", 1.0, 0.0, 1e9, (0.5, 3.0), "how long it lasts", role="duration", tried=1.0),
            Parameter("torque_2", "N m", 0.0, -1e9, 1e9, (0.0,), "of a second push", 0.0, repeats="torque"),
            Parameter("time_2", "s", 0.0, -1e9, 1e9, (0.0,), "when the second begins", repeats="time"),
            Parameter("duration_2", "s", 1.0, 0.0, 1e9, (1.0,), "how long the second lasts", repeats="duration"),
            Parameter("torque_3", "N m", 0.0, -1e9, 1e9, (0.0,), "of a third push", 0.0, repeats="torque"),
            Parameter("time_3", "s", 0.0, -1e9, 1e9, (0.0,), "when the third begins", repeats="time"),
            Parameter("duration_3", "s", 1.0, 0.0, 1e9, (1.0,), "how long the third lasts", repeats="duration"),
            Parameter("rise", "s", 0.02, 0.02, 1e9, (0.02,), "of each edge: short for a blow, long for a hand", role="rise", tried=0.4),
        ),
        reference="Ohnishi, Shibata & Murakami (1996), disturbance torque",
        rivals=("joint_coulomb_stribeck", "payload_change"),
    ),
    EffectInfo(
        id="base_flexibility",
        name="mounting that gives way",
        block="arm",
        at="",
        equation="q'' + 2 z w q' + w^2 q = -c w^2 tau_1; the first link stands at theta + q, sensor and muscles see theta",
        fingerprint="after fast moves a ringing in a narrow band, where base and arm swing together, below the base's own frequency; "
        "the arm's inertia seems too large below it, too small above",
        separates="a swinging payload is slower and follows the posture; tendons ring faster at higher pressure",
        parameters=(
            Parameter("compliance", "rad/(N m)", 5e-5, 0.0, 1.0, (2e-5, 2e-4), "turn of the base by a torque", 0.0),
            Parameter("natural_frequency", "Hz", 8.0, 1e-2, 1e3, (5.0, 12.0), "of the base without the arm", expected=(3.0, 15.0)),
            Parameter("damping_ratio", "1", 0.03, 0.0, 10.0, (0.03,), "of the base", expected=(0.0, 0.05)),
        ),
        reference="Spong (1987), elastic joint with the spring in the base",
        rivals=("payload_swing", "tendons that give way"),
    ),
)
"""In the order of the chain."""
