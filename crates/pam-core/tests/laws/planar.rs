//! Laws of the planar arm: structure of its equations, energy, the closed forms of one and two
//! links, errors.

use nalgebra::{SMatrix, SVector};
use pam_core::blocks::arm::one_link::{Mounting, OneLink};
use pam_core::blocks::arm::planar::{Link, PlanarArm, Spring, Stops};
use pam_core::dual::Slope;
use pam_core::scalar::{constant, Scalar};
use pam_core::simulate::integrate::Rk4;
use pam_core::Error;
use proptest::prelude::*;

const GRAVITY: f64 = 9.80665;

type Numbers = [f64; 5];

/// A link of `[length, mass, centre / length, inertia, payload]`.
fn link(numbers: &Numbers, friction: [f64; 2]) -> Link<f64> {
    let &[length, mass, share, inertia, payload] = numbers;
    let [viscous, coulomb] = friction;
    let (centre, coulomb_speed) = (share * length, 0.02);
    Link {
        length,
        mass,
        centre,
        inertia,
        payload,
        viscous,
        coulomb,
        coulomb_speed,
        stops: None,
        spring: Spring::none(),
    }
}

/// The same arm in any number type.
fn arm<S: Scalar, const N: usize>(links: &[Link<f64>; N]) -> PlanarArm<S, N> {
    let links = links.map(|l| Link {
        length: constant(l.length),
        mass: constant(l.mass),
        centre: constant(l.centre),
        inertia: constant(l.inertia),
        payload: constant(l.payload),
        viscous: constant(l.viscous),
        coulomb: constant(l.coulomb),
        coulomb_speed: l.coulomb_speed,
        stops: l.stops,
        spring: Spring { stiffness: constant(l.spring.stiffness), angle: constant(l.spring.angle) },
    });
    PlanarArm::new(links, GRAVITY).unwrap()
}

/// `values` that move with `rates`.
fn moving<const N: usize>(values: &SVector<f64, N>, rates: &SVector<f64, N>) -> SVector<Slope, N> {
    values.zip_map(rates, Slope::new)
}

fn unit<const N: usize>(k: usize) -> SVector<f64, N> {
    SVector::from_fn(|i, _| f64::from(u8::from(i == k)))
}

prop_compose! {
    fn numbers()(
        length in 0.1..0.8_f64, mass in 0.2..8.0_f64, share in -0.2..1.0_f64,
        inertia in 0.002..0.3_f64,
        payload in prop_oneof![Just(0.0), 0.0..10.0_f64],
    ) -> Numbers {
        [length, mass, share, inertia, payload]
    }
}

/// Numbers of links, angles, rates and accelerations.
type Case<const N: usize> = ([Numbers; N], [[f64; 3]; N]);

fn case<const N: usize>() -> impl Strategy<Value = Case<N>> {
    let motion = (-3.0..3.0_f64, -6.0..6.0_f64, -30.0..30.0_f64).prop_map(|(q, r, a)| [q, r, a]);
    let numbers = prop::collection::vec(numbers(), N).prop_map(|v| v.try_into().unwrap());
    (numbers, prop::collection::vec(motion, N).prop_map(|v| v.try_into().unwrap()))
}

fn motion<const N: usize>(rows: &[[f64; 3]; N]) -> [SVector<f64, N>; 3] {
    [0, 1, 2].map(|k| SVector::from_fn(|i, _| rows[i][k]))
}

/// Every law that holds at one instant.
#[allow(clippy::too_many_lines, reason = "one law after another of the same drawn case")]
fn check_laws<const N: usize>((numbers, rows): &Case<N>) -> Result<(), TestCaseError> {
    let links = numbers.map(|n| link(&n, [0.7, 1.5]));
    let [q, r, a] = motion(rows);
    let (plain, dual) = (arm::<f64, N>(&links), arm::<Slope, N>(&links));
    let h = plain.mass_matrix(&q);
    let c = plain.coriolis_matrix(&q, &r);
    let (mass, speed) = (h.amax(), h.amax() * r.amax());

    // Symmetric and positive definite.
    prop_assert_eq!(h, h.transpose());
    prop_assert!(
        nalgebra::Cholesky::new(nalgebra::DMatrix::from_fn(N, N, |i, j| h[(i, j)])).is_some()
    );

    // H' - 2C is skew, and C is that of the Christoffel symbols of H.
    let h_rate = dual.mass_matrix(&moving(&q, &r)).map(|v| v.slope());
    let skew = h_rate - c * 2.0;
    prop_assert!((skew + skew.transpose()).amax() < 1e-13 * speed.max(1.0));
    let slope: [SMatrix<f64, N, N>; N] =
        std::array::from_fn(|k| dual.mass_matrix(&moving(&q, &unit(k))).map(|v| v.slope()));
    let christoffel = SMatrix::<f64, N, N>::from_fn(|i, j| {
        (0..N).map(|k| 0.5 * (slope[k][(i, j)] + slope[j][(i, k)] - slope[i][(k, j)]) * r[k]).sum()
    });
    prop_assert!((christoffel - c).amax() < 1e-13 * speed.max(1.0));

    // Energies: those of H, and those of bodies whose places are differentiated along the motion.
    let kinetic = plain.kinetic_energy(&q, &r);
    prop_assert!(
        (kinetic - 0.5 * (r.transpose() * h * r)[0]).abs()
            < 1e-12 * mass * r.norm_squared().max(1.0)
    );
    let ends = dual.positions(&moving(&q, &r));
    let (mut base, mut turn) = ([Slope::new(0.0, 0.0); 2], 0.0);
    let (mut bodies, mut potential) = (0.0, 0.0);
    for (i, l) in links.iter().enumerate() {
        turn += r[i];
        let end = [ends[(0, i)], ends[(1, i)]];
        let centre = [0, 1].map(|k| base[k] + (end[k] - base[k]) * (l.centre / l.length));
        for (m, place) in [(l.mass, centre), (l.payload, end)] {
            bodies += 0.5 * m * (place[0].slope().powi(2) + place[1].slope().powi(2));
            potential += m * GRAVITY * place[1].re;
        }
        bodies += 0.5 * l.inertia * turn * turn;
        base = end;
    }
    prop_assert!((kinetic - bodies).abs() < 1e-12 * mass * r.norm_squared().max(1.0));
    prop_assert!(
        (plain.potential_energy(&q) - potential).abs() < 1e-11 * potential.abs().max(100.0)
    );

    // G is the slope of the potential energy.
    let g = plain.gravity_torque(&q);
    for k in 0..N {
        prop_assert!(
            (dual.potential_energy(&moving(&q, &unit(k))).slope() - g[k]).abs()
                < 1e-11 * g.amax().max(100.0)
        );
    }

    // Inverse dynamics is H q'' + C q' + G + friction, and acceleration its inverse.
    let torque = plain.inverse_dynamics(&q, &r, &a);
    let friction = plain.friction_torque(&r);
    let sum = h * a + c * r + g + friction;
    prop_assert!((torque - sum).amax() < 1e-12 * sum.amax().max(mass * r.norm_squared()).max(1.0));
    let back = plain.acceleration(&q, &r, &torque).unwrap();
    let eigenvalues = nalgebra::DMatrix::from_fn(N, N, |i, j| h[(i, j)]).symmetric_eigenvalues();
    let (low, high) = (eigenvalues.min(), eigenvalues.max());
    let scale =
        (high * (1.0 + a.amax() + r.norm_squared()) + torque.amax() + friction.amax()) / low;
    prop_assert!((back - a).amax() < 1e-14 * scale, "{}", (back - a).amax());

    // Power: d/dt energy = tau q' - friction q', and friction never gives.
    let (place, rate) = (moving(&q, &r), moving(&r, &a));
    let power = (dual.kinetic_energy(&place, &rate) + dual.potential_energy(&place)).slope();
    let flow = torque.abs().dot(&r.abs()).max(speed * r.norm_squared()).max(1.0);
    prop_assert!((power - (torque - friction).dot(&r)).abs() < 1e-12 * flow);
    prop_assert!(friction.iter().zip(r.iter()).all(|(f, r)| f * r >= 0.0));

    // Forward and inverse are inverses in values and derivatives: friction, H, C and G all move
    // here.
    let pull = moving(&torque, &unit(0));
    let lifted = dual.acceleration(&place, &rate, &pull).unwrap();
    let slopes = lifted.map(|v| v.slope()).amax();
    prop_assert!((lifted.map(|v| v.re()) - back).amax() <= 1e-14 * scale);
    let returned = dual.inverse_dynamics(&place, &rate, &lifted).map(|v| v.slope()) - unit::<N>(0);
    prop_assert!(
        returned.amax() < 1e-13 * mass * (scale + slopes) * (1.0 + r.amax()),
        "{}",
        returned.amax()
    );
    Ok(())
}

/// A payload is a point mass added to its link.
fn check_payload<const N: usize>((numbers, rows): &Case<N>) -> Result<(), TestCaseError> {
    let loaded = numbers.map(|n| link(&n, [0.0; 2]));
    let rigid = loaded.map(|l| {
        let mass = l.mass + l.payload;
        let centre = (l.mass * l.centre + l.payload * l.length) / mass;
        let inertia = l.inertia
            + l.mass * (l.centre - centre).powi(2)
            + l.payload * (l.length - centre).powi(2);
        Link { mass, centre, inertia, payload: 0.0, ..l }
    });
    let [q, r, a] = motion(rows);
    let (one, two) = (arm::<f64, N>(&loaded), arm::<f64, N>(&rigid));
    let (one, two) = (one.inverse_dynamics(&q, &r, &a), two.inverse_dynamics(&q, &r, &a));
    prop_assert!((one - two).amax() < 1e-12 * one.amax().max(1e3));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None,
        ..ProptestConfig::default() })]

    #[test]
    fn laws_of_one_link(case in case::<1>()) { check_laws(&case)?; }

    #[test]
    fn laws_of_two_links(case in case::<2>()) { check_laws(&case)?; check_payload(&case)?; }

    #[test]
    fn laws_of_three_links(case in case::<3>()) { check_laws(&case)?; check_payload(&case)?; }

    #[test]
    fn laws_of_six_links(case in case::<6>()) { check_laws(&case)?; check_payload(&case)?; }

    #[test]
    fn one_link_is_the_one_link_arm(
        numbers in numbers(), angle in -3.0..3.0_f64, rate in -3.0..3.0_f64,
        torque in -500.0..500.0_f64,
    ) {
        let stops = Stops { min_angle: 0.26, max_angle: 2.0, stiffness: 2e4, damping: 60.0 };
        let spring = Spring { stiffness: 35.0, angle: 0.4 };
        let l = Link { stops: Some(stops), spring, ..link(&numbers, [3.0, 1.5]) };
        let one = OneLink {
            inertia: l.inertia + l.mass * l.centre * l.centre,
            first_moment: l.mass * l.centre,
            length: l.length,
            payload: l.payload,
            viscous: l.viscous,
            coulomb: l.coulomb,
            coulomb_speed: l.coulomb_speed,
            gravity: GRAVITY,
            spring,
            mounting: Mounting::plumb(),
        };
        let planar = arm::<f64, 1>(&[l]);
        let [q, r, t] = [angle, rate, torque].map(SVector::<f64, 1>::new);
        let expected = one.acceleration(angle, rate, torque, stops.torque(angle, rate));
        prop_assert_eq!(planar.acceleration(&q, &r, &t).unwrap()[0], expected);
        prop_assert_eq!(planar.mass_matrix(&q)[0], one.total_inertia());
        let tilted = OneLink { mounting: Mounting::new(0.4, 0.0), ..one };
        let expected = tilted.acceleration(angle, rate, torque, stops.torque(angle, rate));
        let found = planar.tilted(0.4).acceleration(&q, &r, &t).unwrap()[0];
        prop_assert!((found - expected).abs() < 1e-12 * expected.abs().max(1e3));
    }

    /// Spong, Hutchinson & Vidyasagar, ch. 7, planar elbow manipulator: the first angle from the
    /// horizontal.
    #[test]
    fn two_links_are_the_textbooks(case in case::<2>()) {
        let (mut numbers, rows) = case;
        for n in &mut numbers {
            n[4] = 0.0;
        }
        let links = numbers.map(|n| link(&n, [0.0; 2]));
        let [q, r, a] = motion(&rows);
        let [(m1, lc1), (m2, lc2)] = [0, 1].map(|k| (links[k].mass, links[k].centre));
        let l1 = links[0].length;
        let (i1, i2) = (links[0].inertia, links[1].inertia);
        let (q1, q2) = (q[0] - std::f64::consts::FRAC_PI_2, q[1]);
        let d11 = m1 * lc1.powi(2) + m2 * (l1.powi(2) + lc2.powi(2) + 2.0 * l1 * lc2 * q2.cos())
            + i1 + i2;
        let d12 = m2 * (lc2.powi(2) + l1 * lc2 * q2.cos()) + i2;
        let d22 = m2 * lc2.powi(2) + i2;
        let h = -m2 * l1 * lc2 * q2.sin();
        let g1 = (m1 * lc1 + m2 * l1) * GRAVITY * q1.cos() + m2 * lc2 * GRAVITY * (q1 + q2).cos();
        let g2 = m2 * lc2 * GRAVITY * (q1 + q2).cos();
        let tau1 = d11 * a[0] + d12 * a[1] + h * r[1] * r[0] + h * (r[1] + r[0]) * r[1] + g1;
        let tau2 = d12 * a[0] + d22 * a[1] - h * r[0] * r[0] + g2;
        let planar = arm::<f64, 2>(&links);
        let torque = planar.inverse_dynamics(&q, &r, &a);
        prop_assert!((torque - SVector::<f64, 2>::new(tau1, tau2)).amax() < 1e-12
            * torque.amax().max(1e3));
        let c = planar.coriolis_matrix(&q, &r);
        let book = SMatrix::<f64, 2, 2>::new(h * r[1], h * (r[1] + r[0]), -h * r[0], 0.0);
        prop_assert!((c - book).amax() < 1e-12 * book.amax().max(10.0));
    }
}

const CHAIN: [Numbers; 3] =
    [[0.33, 3.0, 0.5, 0.03, 0.0], [0.33, 2.5, 0.45, 0.025, 1.0], [0.18, 1.0, 0.5, 0.004, 4.0]];

/// States after `steps` over 1 s from one start; `M = 2 N`.
fn fall<const N: usize, const M: usize>(
    arm: &PlanarArm<f64, N>,
    steps: u32,
) -> Vec<SVector<f64, M>> {
    let mut states =
        vec![SVector::<f64, M>::from_fn(|i, _| if i < N { 1.2 - 0.3 * i as f64 } else { 0.5 })];
    let mut method = Rk4::new(M);
    for k in 0..steps as usize {
        let mut next = states[k];
        method.step(next.as_mut_slice(), 1.0 / f64::from(steps), |_, s, out| {
            let q = SVector::<f64, N>::from_column_slice(&s[..N]);
            let r = SVector::<f64, N>::from_column_slice(&s[N..]);
            let a = arm.acceleration(&q, &r, &SVector::zeros()).unwrap();
            out[..N].copy_from_slice(r.as_slice());
            out[N..].copy_from_slice(a.as_slice());
        });
        states.push(next);
    }
    states
}

fn energy<const N: usize, const M: usize>(arm: &PlanarArm<f64, N>, state: &SVector<f64, M>) -> f64 {
    let (q, r) = (state.fixed_rows::<N>(0).into_owned(), state.fixed_rows::<N>(N).into_owned());
    arm.kinetic_energy(&q, &r) + arm.potential_energy(&q)
}

#[test]
fn energy_is_kept_and_states_converge_with_order_four() {
    let swing = arm::<f64, 3>(&CHAIN.map(|n| link(&n, [0.0; 2])));
    let runs = [500, 1000, 2000].map(|n| fall::<3, 6>(&swing, n));
    let [coarse, middle, fine] = [0, 1, 2].map(|k| runs[k][runs[k].len() - 1]);
    let order = ((coarse - middle).norm() / (middle - fine).norm()).log2();
    assert!((3.7..4.3).contains(&order), "order {order}");
    let drift = runs.map(|states| {
        let start = energy(&swing, &states[0]);
        states.iter().map(|s| (energy(&swing, s) - start).abs()).fold(0.0, f64::max)
    });
    let orders = [(drift[0] / drift[1]).log2(), (drift[1] / drift[2]).log2()];
    assert!(orders.iter().all(|o| *o > 3.7), "orders {orders:?} of the energy, drifts {drift:?} J");
    assert!(drift[2] < 1e-6, "{drift:?} J at 0.5 ms");
}

#[test]
fn friction_dissipates() {
    let swing = arm::<f64, 3>(&CHAIN.map(|n| link(&n, [0.3, 0.5])));
    let energies: Vec<_> = fall::<3, 6>(&swing, 4000).iter().map(|s| energy(&swing, s)).collect();
    assert!(energies.windows(2).all(|e| e[1] <= e[0] + 1e-12), "energy rises");
    assert!(energies[4000] < energies[0] - 1.0);
}

#[test]
fn stops_push_their_own_joint_back() {
    let stops = Stops { min_angle: -0.1, max_angle: 1.0, stiffness: 2e4, damping: 60.0 };
    let mut links = CHAIN.map(|n| link(&n, [0.0; 2]));
    links[1].stops = Some(stops);
    let held = arm::<f64, 3>(&links);
    let (q, r) = (SVector::<f64, 3>::new(3.0, 1.01, -2.0), SVector::<f64, 3>::new(0.0, 0.5, 0.0));
    assert_eq!(held.stop_torque(&q, &r), SVector::<f64, 3>::new(0.0, stops.torque(1.01, 0.5), 0.0));
    let free = arm::<f64, 3>(&CHAIN.map(|n| link(&n, [0.0; 2])));
    let zero = SVector::zeros();
    let expected = free.acceleration(&q, &r, &held.stop_torque(&q, &r)).unwrap();
    assert!((held.acceleration(&q, &r, &zero).unwrap() - expected).amax() < 1e-9);
    let torque = held.inverse_dynamics(&q, &r, &expected);
    assert!(torque.amax() < 1e-9, "forward and inverse agree at a stop: {torque}");
}

#[test]
fn a_hanging_arm_rests_below_its_joint() {
    let still = arm::<f64, 3>(&CHAIN.map(|n| link(&n, [0.3, 0.5])));
    let zero = SVector::<f64, 3>::zeros();
    assert_eq!(still.acceleration(&zero, &zero, &zero).unwrap(), zero);
    let ends = still.positions(&SVector::<f64, 3>::new(
        std::f64::consts::FRAC_PI_2,
        0.0,
        std::f64::consts::FRAC_PI_2,
    ));
    let expected = SMatrix::<f64, 2, 3>::new(0.33, 0.66, 0.66, 0.0, 0.0, 0.18);
    assert!((ends - expected).amax() < 1e-15, "across, then up: {ends}");
}

#[test]
fn bad_input_is_named() {
    let good = CHAIN.map(|n| link(&n, [0.3, 0.5]));
    let stops = Stops { min_angle: 0.2, max_angle: 2.0, stiffness: 2e4, damping: 60.0 };
    let named = |change: &dyn Fn(&mut Link<f64>), expected: &str| {
        let mut links = good;
        change(&mut links[1]);
        match PlanarArm::new(links, GRAVITY) {
            Err(Error::Parameter { name, .. }) => {
                assert_eq!(name, format!("arm.links[1].{expected}"))
            }
            other => panic!("{expected}: {other:?}"),
        }
    };
    named(&|l| l.length = f64::NAN, "length");
    named(&|l| l.mass = -1.0, "mass");
    named(&|l| l.centre = f64::INFINITY, "centre");
    named(&|l| l.inertia = -1e-9, "inertia");
    named(&|l| l.payload = -0.1, "payload");
    named(&|l| l.viscous = -0.1, "viscous");
    named(&|l| l.coulomb = f64::NAN, "coulomb");
    named(&|l| l.coulomb_speed = 0.0, "coulomb_speed");
    named(&|l| l.stops = Some(Stops { min_angle: f64::NAN, ..stops }), "stops.min_angle");
    named(&|l| l.stops = Some(Stops { max_angle: 0.1, ..stops }), "stops.max_angle");
    named(&|l| l.stops = Some(Stops { stiffness: -1.0, ..stops }), "stops.stiffness");
    named(&|l| l.stops = Some(Stops { damping: -1.0, ..stops }), "stops.damping");
    let message = PlanarArm::new(good, f64::NAN).unwrap_err().to_string();
    assert!(message.starts_with("arm.gravity = NaN is not allowed"), "{message}");
    assert!(matches!(PlanarArm::<f64, 0>::new([], GRAVITY), Err(Error::Length { .. })));

    let planar = arm::<f64, 3>(&good);
    let (fine, bad) = (SVector::<f64, 3>::repeat(0.4), SVector::<f64, 3>::new(0.4, f64::NAN, 0.4));
    let cases = [
        ([bad, fine, fine], "angle[1]"),
        ([fine, bad, fine], "rate[1]"),
        ([fine, fine, bad], "torque[1]"),
    ];
    for ([q, r, t], expected) in cases {
        match planar.acceleration(&q, &r, &t) {
            Err(Error::Parameter { name, .. }) => assert_eq!(name, expected),
            other => panic!("{expected}: {other:?}"),
        }
    }
}

/// Point masses on massless links: nothing resists the folding of links that are in line.
#[test]
fn an_arm_without_inertia_is_refused() {
    let bare = [[0.4, 0.0, 0.5, 0.0, 0.0], [0.3, 0.0, 0.5, 0.0, 5.0]].map(|n| link(&n, [0.0; 2]));
    let planar = arm::<f64, 2>(&bare);
    let zero = SVector::<f64, 2>::zeros();
    for k in 0..200 {
        // In line in any direction: rounding may leave a pivot on either side of zero.
        let q = SVector::<f64, 2>::new(
            0.03 * f64::from(k),
            if k % 2 == 0 { 0.0 } else { std::f64::consts::PI },
        );
        let error = planar.acceleration(&q, &zero, &zero).unwrap_err();
        assert!(error.to_string().contains("pivot 1 of the arm's mass matrix"), "{error}");
    }
    assert!(planar.acceleration(&SVector::<f64, 2>::new(0.7, 1.0), &zero, &zero).is_ok());
}
