//! Pressures that a muscle may have.

/// Lowest gauge pressure [Pa]: vacuum at standard ambient pressure.
pub const LOWEST_PRESSURE: f64 = -101_325.0;
/// Highest gauge pressure [Pa] that is taken for an input and not for a mistake of unit.
pub const HIGHEST_PRESSURE: f64 = 1.0e8;
