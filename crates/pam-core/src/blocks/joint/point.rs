//! What every joint gives at an angle.

/// Shortening and moment arms at one angle.
#[derive(Debug, Clone, Copy)]
pub struct JointPoint<S> {
    /// Shortening of the muscle [m].
    pub shortening: S,
    /// Moment arm dd/dtheta [m]: rate of shortening per rate of angle.
    pub moment_arm: S,
    /// Torque per pull [m]: the moment arm, less what the printed equations lose.
    pub torque_arm: S,
}
