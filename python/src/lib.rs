//! The native half of the Python package `haloray`: arrays and names in, the library's results out, no physics.
//!
//! Everything here is called by the modules of `haloray/`, which turn units, objects and shapes into what stands in the
//! signatures: float64 columns, names, numbers. Long work goes through [`watch::run`].

mod arrays;
mod checks;
mod config;
mod ensemble;
mod errors;
mod fit;
mod haloes;
mod lens;
mod log_posterior;
mod mock;
mod read;
mod run;
mod sight;
mod store;
mod threads;
mod watch;

use mimalloc::MiMalloc;
use pyo3::prelude::*;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

#[pymodule]
fn _haloray(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("git_revision", haloray::io::Provenance::new(None, "").git_revision)?;
    module.add("lens_model_names", haloray::io::lens_model_names())?;
    module.add_class::<config::Config>()?;
    module.add_class::<haloes::Catalogue>()?;
    module.add_class::<sight::Sight>()?;
    module.add_class::<lens::Lens>()?;
    module.add_class::<fit::Observation>()?;
    module.add_class::<log_posterior::LogPosterior>()?;
    module.add_class::<ensemble::EnsemblePlan>()?;
    module.add_function(wrap_pyfunction!(lens::lens_argument_unit, module)?)?;
    module.add_function(wrap_pyfunction!(haloes::populate, module)?)?;
    module.add_function(wrap_pyfunction!(run::image, module)?)?;
    module.add_function(wrap_pyfunction!(run::write_image, module)?)?;
    module.add_function(wrap_pyfunction!(run::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(mock::mock, module)?)?;
    module.add_function(wrap_pyfunction!(mock::mock_instrument, module)?)?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(fit::draw_statistics, module)?)?;
    module.add_function(wrap_pyfunction!(fit::models, module)?)?;
    module.add_function(wrap_pyfunction!(fit::model_text, module)?)?;
    module.add_function(wrap_pyfunction!(read::read_groups, module)?)?;
    module.add_function(wrap_pyfunction!(read::read_posterior, module)?)?;
    module.add_function(wrap_pyfunction!(threads::set_threads, module)?)?;
    module.add_function(wrap_pyfunction!(threads::number_of_threads, module)?)?;
    module.add_function(wrap_pyfunction!(checks::seconds_of_rays, module)?)?;
    module.add_function(wrap_pyfunction!(checks::foreign_functions, module)?)
}
