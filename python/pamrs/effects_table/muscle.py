"""Effects on what a muscle pulls."""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.entry import EffectInfo
from pamrs.effects_table.entry import EffectParameter as Parameter

__all__ = ["MUSCLE"]

MUSCLE: Final[tuple[EffectInfo, ...]] = (
    EffectInfo(
        id="muscle_hysteresis",
        name="rate-independent friction of the braid (pressure-scaled Maxwell-slip)",
        block="muscle",
        at="muscle",
        equation="F_h = (W0 + c pg) mean(clip(z_i)), z_i' = L'/d_i until |z_i| = 1; four elements, d/8 to d",
        fingerprint="less pull while contracting, more while extending; the loop does not depend on speed; after a "
        "reversal the force changes over a finite distance",
        separates="joint Coulomb friction has neither presliding nor growth with pressure; creep and damping depend on time and speed",
        parameters=(
            Parameter("friction_constant", "N", 5.0, 0.0, 1e4, (2.0,), "half width of one muscle's loop at zero pressure", 0.0),
            Parameter(
                "friction_pressure",
                "m2",
                5e-5,
                0.0,
                1.0,
                (2e-5,),
                "growth of the half width with gauge pressure",
                0.0,
                same_everywhere=True,
            ),
            Parameter("presliding", "m", 1e-3, 1e-6, 0.1, (5e-4, 3e-3), "distance over which the loop closes after a reversal"),
        ),
        reference="Vo-Minh et al. (2011); Al-Bender, Lampaert & Swevers (2005); Robinson (2014) (2.36) as a special case",
        rivals=("joint_coulomb_stribeck", "muscle_creep", "muscle_rate_damping"),
        experiment="Drive a slow triangle with nested smaller loops at two speeds a decade apart: hysteresis does not change with speed, "
        "creep and damping do; repeat with the muscle vented to see joint friction alone.",
        excitation=(("kind", "nested_triangle"), ("periods_s", (50.0, 5.0)), ("levels", 4)),
    ),
    EffectInfo(
        id="muscle_creep",
        name="creep and relaxation of the muscle (standard linear solid)",
        block="muscle",
        at="muscle",
        equation="F_c = k (L - L_d), L_d' = (L - L_d)/tau",
        fingerprint="at constant pressure the joint goes on in the direction of its last change; after a partial return it creeps back",
        separates="a leak moves the pressure; hysteresis does not depend on time; softening is only there below the largest stretch",
        parameters=(
            Parameter("stiffness", "N/m", 500.0, 0.0, 1e7, (200.0, 2000.0), "spring in series with the damper, one muscle", 0.0),
            Parameter("time_constant", "s", 3.0, 1e-3, 1e6, (1.0, 10.0), "time in which it relaxes", time_constant=True),
        ),
        reference="Findley, Lai & Onaran (1976); Schulte (1961)",
        rivals=("leak_muscle", "muscle_hysteresis", "mullins_softening"),
    ),
    EffectInfo(
        id="muscle_rate_damping",
        name="viscous damping of the muscle, by pressure and direction",
        block="muscle",
        at="muscle",
        equation="F_v = (b0 + b1 pg) L', times s while lengthening",
        fingerprint="the loop grows with speed; oscillations die out faster at higher pressure and slower while lengthening",
        separates="the braid's friction does not depend on speed; "
        "the joint's own viscous friction depends neither on pressure nor on moment arm",
        parameters=(
            Parameter("damping_constant", "N s/m", 200.0, 0.0, 1e7, (100.0,), "of one muscle without pressure", 0.0),
            Parameter("damping_pressure", "m s", 5e-4, 0.0, 10.0, (5e-4,), "growth with gauge pressure [N s/m by Pa]", 0.0),
            Parameter("lengthening_share", "1", 1.0, 0.0, 10.0, (1.0,), "damping while lengthening by that while contracting"),
        ),
        reference="Reynolds, Repperger, Phillips & Bandry (2003)",
        rivals=("muscle_hysteresis", "viscous friction of the joint"),
    ),
    EffectInfo(
        id="activation_pressure",
        name="pressure that is needed before the muscle pulls",
        block="muscle",
        at="muscle",
        equation="F = F(p_e, L), p_e = max(pg - p_th, 0), rounded over a tenth of p_th",
        fingerprint="no motion up to a pressure, then as modelled with the pressure shifted",
        separates="a constant torque shifts each angle by another pressure, clearest with another payload or co-contraction; "
        "errors of the zeros show when vented, at a known angle",
        parameters=(Parameter("threshold", "Pa", 2e4, 0.0, 1e7, (1e4, 5e4), "gauge pressure that is lost", 0.0),),
        reference="Tsagarakis & Caldwell (2000); Hocking & Wereley (2013)",
        rivals=("a constant torque", "a pressure zero that is off", "an angle zero that is off"),
    ),
    EffectInfo(
        id="mullins_softening",
        name="softening of the bladder where it was stretched before (Mullins)",
        block="muscle",
        at="muscle",
        equation="F_b -> F_b (1 - D tanh((e_m - e)/w)), e_m = largest contraction since the start",
        fingerprint="the first stroke of a recording is weaker than all later ones up to the same contraction",
        separates="creep comes back within minutes and at any stretch; wrong moduli do not depend on the past",
        parameters=(
            Parameter("softening", "1", 0.2, 0.0, 1.0, (0.1, 0.3), "share of the bladder's force that is lost", 0.0),
            Parameter("contraction_width", "1", 0.03, 1e-4, 10.0, (0.03,), "contraction below the largest over which it is lost"),
        ),
        reference="Ogden & Roxburgh (1999); Diani, Fayolle & Gilormini (2009)",
        rivals=("muscle_creep", "bladder moduli that are off"),
    ),
    EffectInfo(
        id="pam_crowding_contact",
        label="fibre crowding contact",
        name="contact of a swelling muscle with its neighbours or the frame",
        block="muscle",
        at="muscle",
        equation="F_cr = -A pg d (d/0.1)^(n-1) (1 - m L'/sqrt(L'^2 + v^2)), d = max(e - e_c, 0), rounded over 0.005, v = 3 mm/s",
        fingerprint="beyond one contraction the pull falls short, the more the higher the pressure, in both directions",
        separates="an end stop is at one angle and does not depend on pressure; cubic moduli have no onset",
        parameters=(
            Parameter("contact_area", "m2", 1e-3, 0.0, 1.0, (5e-4, 3e-3), "loss per pressure and contraction, secant at 0.1", 0.0),
            Parameter("onset_contraction", "1", 0.12, -1.0, 1.0, (0.04, 0.08, 0.15), "contraction at which they touch"),
            Parameter(
                "exponent",
                "1",
                1.0,
                1.0,
                2.0,
                (1.5,),
                "of the depth: 1 where flat sides touch, 1.5 round ones, 2 pointed ones",
                prior=(1.5, 0.25),  # swollen muscles are round, and press like round bodies (Hertz)
            ),
            Parameter("rubbing", "1", 0.0, 0.0, 1.0, (0.1,), "friction where they touch, as a share of the loss"),
        ),
        reference="Robinson, Kothera & Wereley (2015)",
        rivals=("joint_end_stop", "bladder moduli that are off"),
    ),
)
"""In the order of the catalogue."""
