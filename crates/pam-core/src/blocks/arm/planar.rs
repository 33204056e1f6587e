//! Planar arm of `N` links in series, with payloads, friction and elastic stops.
//!
//! `H(q) q'' + C(q, q') q' + G(q) = tau - c q' - f tanh(q'/w) + tau_stop - k (q - q_k)` (Spong,
//! Hutchinson & Vidyasagar, *Robot Modeling and Control*, ch. 7). `q_1` is measured from the gravity
//! vector (of a tilted base from an angle to it), as in the one-link arm, `q_k` from the link
//! before; positive torque raises `q`. In the links' directions `phi_i = q_1 + ... + q_i`, with
//! `mu_i` all mass carried at the end of link `i` (its payload and every link beyond),
//!
//! - `A_ii = I_i + m_i c_i^2 + mu_i l_i^2`, `B_i = m_i c_i + mu_i l_i`, `A_ij = l_i B_j` for
//!   `i < j`;
//! - kinetic energy `1/2 sum A_ij cos(phi_i - phi_j) phi_i' phi_j'`, potential energy
//!   `-g sum B_i cos phi_i`;
//! - Christoffel symbols leave `C_ij = A_ij sin(phi_i - phi_j) phi_j'`, so that `H' - 2C` is skew.
//!
//! `phi` is linear in `q` with ones, so that `H_ab` and `C_ab` in `q` are sums of those in `phi`
//! over all `i >= a`, `j >= b`, the Christoffel property included. Everything has fixed size:
//! nothing allocates. Accelerations are solved for in `phi`, where no sum cancels, by Cholesky's
//! method without square roots (`L D L^T`), written here because nalgebra's asks for more of a
//! number than [`Scalar`] does; for one link it is the division of [`super::one_link::OneLink`].

pub use super::one_link::{Spring, Stops};
use crate::error::{check_range, Error, Result};
use crate::key;
use crate::keys::Key;
use crate::scalar::{constant, Scalar};
use nalgebra::{SMatrix, SVector};

/// One link and the joint at its base.
#[derive(Debug, Clone, Copy)]
pub struct Link<S> {
    /// Distance from its joint to its end, where the next joint and the payload are [m].
    pub length: S,
    /// Mass [kg].
    pub mass: S,
    /// Distance of the centre of mass from the joint, towards the end [m].
    pub centre: S,
    /// Inertia about the centre of mass [kg m2].
    pub inertia: S,
    /// Payload mass at the end [kg].
    pub payload: S,
    /// Viscous friction of the joint [N m s/rad].
    pub viscous: S,
    /// Coulomb friction of the joint [N m].
    pub coulomb: S,
    /// Speed over which Coulomb friction changes sign [rad/s].
    pub coulomb_speed: f64,
    /// Stops of the joint angle; `None` for a joint that turns freely.
    pub stops: Option<Stops>,
    /// Spring across the joint.
    pub spring: Spring<S>,
}

/// A planar arm of `N` links.
#[derive(Debug, Clone, Copy)]
pub struct PlanarArm<S, const N: usize> {
    links: [Link<S>; N],
    gravity: f64,
    /// Angle of the first link from the gravity vector where its joint's is zero [rad].
    base_angle: S,
    /// `A`, both triangles [kg m2].
    coupling: SMatrix<S, N, N>,
    /// `B` [kg m].
    moment: SVector<S, N>,
}

/// Directions of the links.
struct Pose<S, const N: usize> {
    sin: SVector<S, N>,
    cos: SVector<S, N>,
}

impl<S: Scalar, const N: usize> Pose<S, N> {
    fn new(angle: &SVector<S, N>, base: S) -> Self {
        let (mut sin, mut cos) = (zeros(), zeros());
        let mut direction = base;
        for i in 0..N {
            direction += angle[i];
            (sin[i], cos[i]) = direction.sin_cos();
        }
        Self { sin, cos }
    }

    fn cos_between(&self, i: usize, j: usize) -> S {
        self.cos[i] * self.cos[j] + self.sin[i] * self.sin[j]
    }

    fn sin_between(&self, i: usize, j: usize) -> S {
        self.sin[i] * self.cos[j] - self.cos[i] * self.sin[j]
    }
}

impl<S: Scalar, const N: usize> PlanarArm<S, N> {
    /// An arm from its links, base first, under gravity [m/s2].
    ///
    /// # Errors
    /// [`Error::Parameter`] with the argument's name for a value that is not finite or outside its
    /// range, [`Error::Length`] for no link.
    pub fn new(links: [Link<S>; N], gravity: f64) -> Result<Self> {
        if N == 0 {
            let why = "an arm has at least one".into();
            return Err(Error::Length { name: "arm.links".into(), found: 0, expected: 1, why });
        }
        key!("arm", "gravity").check("arm.gravity", gravity)?;
        for (k, link) in links.iter().enumerate() {
            link.check(k)?;
        }
        Ok(Self::assembled(links, gravity, constant(0.0)))
    }

    /// The same on a base whose zero is an angle [rad] off the gravity vector.
    #[must_use]
    pub fn tilted(self, base_angle: S) -> Self {
        Self { base_angle, ..self }
    }

    /// Angle of the first link from the gravity vector where its joint's is zero [rad].
    pub fn base_angle(&self) -> S {
        self.base_angle
    }

    /// The same with another payload at the end of a link; one that cannot be shows in the mass
    /// matrix.
    #[must_use]
    pub fn with_payload(&self, link: usize, payload: S) -> Self {
        let mut links = self.links;
        if let Some(link) = links.get_mut(link) {
            link.payload = payload;
        }
        Self::assembled(links, self.gravity, self.base_angle)
    }

    fn assembled(links: [Link<S>; N], gravity: f64, base_angle: S) -> Self {
        let (mut coupling, mut moment) = (SMatrix::from_element(constant(0.0)), zeros());
        let mut beyond = constant::<S>(0.0);
        for i in (0..N).rev() {
            let Link { length, mass, centre, inertia, payload, .. } = links[i];
            let carried = payload + beyond;
            coupling[(i, i)] = inertia + mass * centre * centre + carried * (length * length);
            moment[i] = mass * centre + carried * length;
            for j in i + 1..N {
                coupling[(i, j)] = length * moment[j];
                coupling[(j, i)] = coupling[(i, j)];
            }
            beyond = carried + mass;
        }
        Self { links, gravity, base_angle, coupling, moment }
    }

    /// The links, base first.
    pub fn links(&self) -> &[Link<S>; N] {
        &self.links
    }

    /// Gravity [m/s2].
    pub fn gravity(&self) -> f64 {
        self.gravity
    }

    /// Mass matrix `H` [kg m2] at joint angles [rad].
    pub fn mass_matrix(&self, angle: &SVector<S, N>) -> SMatrix<S, N, N> {
        let mut mass = outward_sums(self.mass_of_links(&Pose::new(angle, self.base_angle)));
        mass.fill_lower_triangle_with_upper_triangle(); // the two differ by the order of rounding
        mass
    }

    /// Coriolis matrix `C` [kg m2/s] of the Christoffel symbols, at joint angles [rad] and rates
    /// [rad/s].
    pub fn coriolis_matrix(&self, angle: &SVector<S, N>, rate: &SVector<S, N>) -> SMatrix<S, N, N> {
        let (pose, turn) = (Pose::new(angle, self.base_angle), running_sum(rate));
        let mut c = SMatrix::from_element(constant(0.0));
        for i in 0..N {
            for j in (0..N).filter(|&j| j != i) {
                c[(i, j)] = self.coupling[(i, j)] * pose.sin_between(i, j) * turn[j];
            }
        }
        outward_sums(c)
    }

    /// Gravity torques `G` [N m]: what holds the arm at rest.
    pub fn gravity_torque(&self, angle: &SVector<S, N>) -> SVector<S, N> {
        outward_sum(self.weight_on_links(&Pose::new(angle, self.base_angle)))
    }

    /// Friction torques [N m] at joint rates [rad/s], positive against positive rates.
    #[inline]
    pub fn friction_torque(&self, rate: &SVector<S, N>) -> SVector<S, N> {
        SVector::from_fn(|i, _| {
            let link = &self.links[i];
            link.viscous * rate[i] + link.coulomb * (rate[i] / link.coulomb_speed).tanh()
        })
    }

    /// Torques of the springs across the joints [N m], towards their rest.
    #[inline]
    pub fn spring_torque(&self, angle: &SVector<S, N>) -> SVector<S, N> {
        SVector::from_fn(|i, _| self.links[i].spring.torque(angle[i]))
    }

    /// Torques of the stops [N m].
    #[inline]
    pub fn stop_torque(&self, angle: &SVector<S, N>, rate: &SVector<S, N>) -> SVector<S, N> {
        SVector::from_fn(|i, _| match &self.links[i].stops {
            Some(stops) => stops.torque(angle[i], rate[i]),
            None => constant(0.0),
        })
    }

    /// Kinetic energy [J].
    pub fn kinetic_energy(&self, angle: &SVector<S, N>, rate: &SVector<S, N>) -> S {
        let (pose, turn) = (Pose::new(angle, self.base_angle), running_sum(rate));
        let mut twice = constant::<S>(0.0);
        for i in 0..N {
            twice += self.coupling[(i, i)] * turn[i] * turn[i];
            for j in i + 1..N {
                twice += self.coupling[(i, j)] * pose.cos_between(i, j) * turn[i] * turn[j] * 2.0;
            }
        }
        twice * 0.5
    }

    /// Potential energy of gravity [J], zero with every mass at the height of the first joint;
    /// without that of springs and stops.
    pub fn potential_energy(&self, angle: &SVector<S, N>) -> S {
        let pose = Pose::new(angle, self.base_angle);
        (0..N).fold(constant(0.0), |sum, i| sum - self.moment[i] * self.gravity * pose.cos[i])
    }

    /// Ends of the links [m], the first joint at the origin: column `k` is the place of joint
    /// `k + 1`, both counted from 0, the last column the tip. Rows: across (where positive angles
    /// point) and up.
    pub fn positions(&self, angle: &SVector<S, N>) -> SMatrix<S, 2, N> {
        let pose = Pose::new(angle, self.base_angle);
        let (mut across, mut up) = (constant::<S>(0.0), constant::<S>(0.0));
        let mut ends = SMatrix::from_element(constant(0.0));
        for i in 0..N {
            across += self.links[i].length * pose.sin[i];
            up -= self.links[i].length * pose.cos[i];
            (ends[(0, i)], ends[(1, i)]) = (across, up);
        }
        ends
    }

    /// Angular accelerations [rad/s2] of the joints under joint torques [N m]; friction, springs and
    /// stops are added here.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names the argument that is not finite, or the pivot of a mass
    /// matrix that is not positive definite (a link without inertia).
    pub fn acceleration(
        &self,
        angle: &SVector<S, N>,
        rate: &SVector<S, N>,
        torque: &SVector<S, N>,
    ) -> Result<SVector<S, N>> {
        let pose = Pose::new(angle, self.base_angle);
        let (friction, stop) = (self.friction_torque(rate), self.stop_torque(angle, rate));
        let (velocity, weight) = (self.velocity_on_links(&pose, rate), self.weight_on_links(&pose));
        let own = self.spring_torque(angle).zip_map(&friction, |s, f| s - f);
        let (drive, stop) = (reactions(torque.zip_map(&own, |t, o| t + o)), reactions(stop));
        let net = SVector::from_fn(|i, _| drive[i] - velocity[i] - weight[i] + stop[i]);
        let turn =
            solve(&self.mass_of_links(&pose), net).map_err(|e| named(e, angle, rate, torque))?;
        let result =
            SVector::<S, N>::from_fn(|i, _| if i > 0 { turn[i] - turn[i - 1] } else { turn[i] });
        let Some(k) = result.iter().position(|a| !a.re().is_finite()) else { return Ok(result) };
        let error =
            Error::parameter(format!("acceleration[{k}]"), result[k].re(), "a finite number");
        Err(named(error, angle, rate, torque))
    }

    /// Angular accelerations [rad/s2] of the joints by joint torques [N m] alone, without weight,
    /// motion, friction and stops.
    ///
    /// # Errors
    /// As [`Self::acceleration`].
    pub fn response(&self, angle: &SVector<S, N>, torque: &SVector<S, N>) -> Result<SVector<S, N>> {
        let turn =
            solve(&self.mass_of_links(&Pose::new(angle, self.base_angle)), reactions(*torque))?;
        Ok(SVector::<S, N>::from_fn(|i, _| if i > 0 { turn[i] - turn[i - 1] } else { turn[i] }))
    }

    /// Joint torques [N m] that give joint accelerations [rad/s2], friction, springs and stops
    /// overcome.
    pub fn inverse_dynamics(
        &self,
        angle: &SVector<S, N>,
        rate: &SVector<S, N>,
        acceleration: &SVector<S, N>,
    ) -> SVector<S, N> {
        let pose = Pose::new(angle, self.base_angle);
        let (friction, stop) = (self.friction_torque(rate), self.stop_torque(angle, rate));
        let (velocity, weight) = (self.velocity_on_links(&pose, rate), self.weight_on_links(&pose));
        let (mass, turn) = (self.mass_of_links(&pose), running_sum(acceleration));
        let joints: SVector<S, N> = outward_sum(SVector::from_fn(|i, _| {
            (0..N).fold(constant::<S>(0.0), |sum, j| sum + mass[(i, j)] * turn[j])
                + velocity[i]
                + weight[i]
        }));
        let spring = self.spring_torque(angle);
        SVector::from_fn(|i, _| joints[i] + friction[i] - spring[i] - stop[i])
    }

    /// Mass matrix of the links' directions.
    #[inline]
    fn mass_of_links(&self, pose: &Pose<S, N>) -> SMatrix<S, N, N> {
        SMatrix::from_fn(|i, j| match i == j {
            true => self.coupling[(i, j)],
            false => self.coupling[(i, j)] * pose.cos_between(i, j),
        })
    }

    /// Torque of gravity on the joint of a link [N m] where the link is level.
    pub fn level_weight(&self, link: usize) -> S {
        self.moment[link] * self.gravity
    }

    /// Torques of gravity on the links.
    #[inline]
    fn weight_on_links(&self, pose: &Pose<S, N>) -> SVector<S, N> {
        SVector::from_fn(|i, _| self.moment[i] * self.gravity * pose.sin[i])
    }

    /// `C phi'` of the links, without the matrix.
    #[inline]
    fn velocity_on_links(&self, pose: &Pose<S, N>, rate: &SVector<S, N>) -> SVector<S, N> {
        let turn = running_sum(rate);
        let mut torque = zeros::<S, N>();
        for i in 0..N {
            for j in i + 1..N {
                let pull = self.coupling[(i, j)] * pose.sin_between(i, j);
                torque[i] += pull * turn[j] * turn[j];
                torque[j] -= pull * turn[i] * turn[i];
            }
        }
        torque
    }
}

impl<S: Scalar> Link<S> {
    fn check(&self, index: usize) -> Result<()> {
        // The full name is only made when there is something wrong.
        let range = |field: &str, value: f64, low: f64, high: f64, unit: &str| {
            check_range(field, value, low, high, unit).or_else(|_| {
                check_range(&format!("arm.links[{index}].{field}"), value, low, high, unit)
            })
        };
        let number = |key: &Key, value: f64| {
            (key.check(key.name, value))
                .or_else(|_| key.check(&format!("arm.links[{index}].{}", key.name), value))
        };
        number(key!("link", "length"), self.length.re())?;
        number(key!("link", "mass"), self.mass.re())?;
        number(key!("link", "centre"), self.centre.re())?;
        number(key!("link", "inertia"), self.inertia.re())?;
        number(key!("link", "payload"), self.payload.re())?;
        number(key!("link", "viscous"), self.viscous.re())?;
        number(key!("link", "coulomb"), self.coulomb.re())?;
        number(key!("link", "coulomb_speed"), self.coulomb_speed)?;
        range("spring.stiffness", self.spring.stiffness.re(), 0.0, 1e9, "N m/rad")?;
        range("spring.angle", self.spring.angle.re(), -100.0, 100.0, "rad")?;
        if let Some(stops) = &self.stops {
            range("stops.min_angle", stops.min_angle, -100.0, 100.0, "rad")?;
            range("stops.max_angle", stops.max_angle, stops.min_angle, 100.0, "rad")?;
            range("stops.stiffness", stops.stiffness, 0.0, 1e9, "N m/rad")?;
            range("stops.damping", stops.damping, 0.0, 1e9, "N m s/rad")?;
        }
        Ok(())
    }
}

#[inline]
fn zeros<S: Scalar, const N: usize>() -> SVector<S, N> {
    SVector::from_element(constant(0.0))
}

/// Rates (or accelerations) of the links' directions from those of the joints.
#[inline]
fn running_sum<S: Scalar, const N: usize>(rate: &SVector<S, N>) -> SVector<S, N> {
    let mut sum = *rate;
    for i in 1..N {
        sum[i] = sum[i - 1] + rate[i];
    }
    sum
}

/// Torques of the joints from torques on the links: each joint carries its link and all beyond.
#[inline]
fn outward_sum<S: Scalar, const N: usize>(mut torque: SVector<S, N>) -> SVector<S, N> {
    for i in (1..N).rev() {
        let beyond = torque[i];
        torque[i - 1] += beyond;
    }
    torque
}

/// Torques on the links from torques of the joints: each joint's reaction is on the link before.
#[inline]
fn reactions<S: Scalar, const N: usize>(mut torque: SVector<S, N>) -> SVector<S, N> {
    for i in 1..N {
        let reaction = torque[i];
        torque[i - 1] -= reaction;
    }
    torque
}

/// [`outward_sum`] on both sides of a matrix.
fn outward_sums<S: Scalar, const N: usize>(mut matrix: SMatrix<S, N, N>) -> SMatrix<S, N, N> {
    for _ in 0..2 {
        for j in 0..N {
            let sum = outward_sum(matrix.column(j).into_owned());
            matrix.set_column(j, &sum);
        }
        matrix = matrix.transpose();
    }
    matrix
}

/// `h^-1 b` by `L D L^T`.
#[inline]
fn solve<S: Scalar, const N: usize>(
    h: &SMatrix<S, N, N>,
    mut b: SVector<S, N>,
) -> Result<SVector<S, N>> {
    let (mut lower, mut pivot) = (*h, zeros::<S, N>());
    for j in 0..N {
        let mut d = h[(j, j)];
        for k in 0..j {
            d -= lower[(j, k)] * lower[(j, k)] * pivot[k];
        }
        // Less than rounding leaves of the diagonal is zero; NaN fails too.
        let positive = d.re() > h[(j, j)].re() * (4.0 * N as f64 * f64::EPSILON);
        if !positive {
            let allowed =
                "> 0 kg m2 (the mass matrix is not positive definite: a link without inertia)";
            return Err(Error::parameter(
                format!("pivot {j} of the arm's mass matrix"),
                d.re(),
                allowed,
            ));
        }
        pivot[j] = d;
        for i in j + 1..N {
            let mut sum = h[(i, j)];
            for k in 0..j {
                sum -= lower[(i, k)] * lower[(j, k)] * pivot[k];
            }
            lower[(i, j)] = sum / d;
        }
        for k in 0..j {
            let known = b[k];
            b[j] -= lower[(j, k)] * known;
        }
    }
    for i in (0..N).rev() {
        b[i] /= pivot[i];
        for k in i + 1..N {
            let known = b[k];
            b[i] -= lower[(k, i)] * known;
        }
    }
    Ok(b)
}

/// The first argument that is not finite, otherwise the error itself.
#[cold]
fn named<S: Scalar, const N: usize>(
    error: Error,
    angle: &SVector<S, N>,
    rate: &SVector<S, N>,
    torque: &SVector<S, N>,
) -> Error {
    for (name, values) in [("angle", angle), ("rate", rate), ("torque", torque)] {
        if let Some(k) = values.iter().position(|v| !v.re().is_finite()) {
            return Error::parameter(format!("{name}[{k}]"), values[k].re(), "a finite number");
        }
    }
    error
}
