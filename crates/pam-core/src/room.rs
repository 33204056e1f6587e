//! Room whose size a caller decides: asked for before it is taken, so that too much of it is an
//! error and not the end of the process.

use crate::{Error, Result};

/// Bytes that one piece of room may have: 2 GB.
const MOST_BYTES: usize = 2_000_000_000;

/// Number of values that some factors multiply to, where there may be so many.
///
/// # Errors
/// [`Error::Room`] that names what they are.
pub(crate) fn counted<T>(name: &str, factors: &[usize]) -> Result<usize> {
    let most = MOST_BYTES / std::mem::size_of::<T>().max(1);
    let count = factors.iter().try_fold(1_usize, |all, factor| all.checked_mul(*factor));
    let allowed = || format!("at most {most} (2 GB)");
    count.filter(|count| *count <= most).ok_or_else(|| refused(name, factors, allowed()))
}

/// So many copies of a value; `factors` are multiplied to their number.
///
/// # Errors
/// As [`counted`], and where there is no memory for it.
pub(crate) fn room<T: Clone>(name: &str, factors: &[usize], value: T) -> Result<Vec<T>> {
    let count = counted::<T>(name, factors)?;
    let mut taken = Vec::new();
    if taken.try_reserve_exact(count).is_err() {
        return Err(refused(name, factors, "as many as there is memory for".into()));
    }
    taken.resize(count, value);
    Ok(taken)
}

fn refused(name: &str, factors: &[usize], allowed: String) -> Error {
    let count = factors.iter().map(|factor| *factor as f64).product();
    Error::Room { name: name.into(), count, allowed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_too_large_is_an_error_that_names_it() {
        for factors in [&[usize::MAX, 2][..], &[100_000_000, 401], &[250_000_001]] {
            let found = room("plants", factors, 0.0_f64).map(|taken| taken.len());
            let told = found.map_err(|error| error.to_string());
            assert!(told.is_err_and(|text| text.contains("plants") && text.contains("2 GB")));
        }
        assert_eq!(room("nothing", &[0, usize::MAX], 1_u8), Ok(Vec::new()));
    }

    proptest! {
        #[test]
        fn what_fits_is_as_many_as_asked_for(a in 0_usize..40, b in 0_usize..40) {
            prop_assert_eq!(room("x", &[a, b], 7_u16), Ok(vec![7; a * b]));
        }
    }
}
