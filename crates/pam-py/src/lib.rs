//! Python bindings of `pam-core`: convert arguments, release the GIL, map errors. No physics here.

mod batch;
mod convert;
mod gas;
mod joint;
mod lanes;
mod muscle;
mod rig;
mod simulator;

use pyo3::prelude::*;

/// Whether this processor runs what is compiled for x86-64-v3.
#[pyfunction]
fn x86_64_v3() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("f16c")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("movbe");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// The compiled core of pamrs.
#[pymodule(gil_used = false)]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<rig::Rig>()?;
    m.add_class::<muscle::Muscle>()?;
    m.add_class::<muscle::ForceTable>()?;
    m.add_class::<gas::Gas>()?;
    m.add_class::<joint::Joint>()?;
    m.add_class::<simulator::Simulator>()?;
    m.add_class::<batch::Batch>()?;
    m.add_function(wrap_pyfunction!(rig::blocks, m)?)?;
    m.add_function(wrap_pyfunction!(rig::effects, m)?)?;
    m.add_function(wrap_pyfunction!(lanes::side_by_side, m)?)?;
    m.add_function(wrap_pyfunction!(x86_64_v3, m)?)?;
    Ok(())
}
