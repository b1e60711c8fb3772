//! Files of results, read back.

use std::path::PathBuf;

use haloray::io::{RunFileReader, read_posterior as read_draws};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::OrRaise;
use crate::watch::run;

/// What a group of a run's file holds.
enum Node {
    Group(Vec<(String, Node)>),
    Column(Vec<f64>),
    Map(Vec<f64>, (usize, usize)),
    Text(Vec<String>),
}

/// Reads what stands in a group; what is of another form than haloray writes is left out.
fn group(file: &RunFileReader, path: &str) -> haloray::Result<Vec<(String, Node)>> {
    let mut members = Vec::new();
    for name in file.names(path)? {
        let full = format!("{}/{name}", path.trim_end_matches('/'));
        let node = if let Ok(values) = file.read_1d(path, &name) {
            Node::Column(values)
        } else if let Ok((values, shape)) = file.read_2d(path, &name) {
            Node::Map(values, shape)
        } else if let Ok(text) = file.read_text(path, &name) {
            Node::Text(text)
        } else if file.names(&full).is_ok() {
            Node::Group(group(file, &full)?)
        } else {
            continue;
        };
        members.push((name, node));
    }
    Ok(members)
}

fn into_dict(py: Python<'_>, members: Vec<(String, Node)>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (name, node) in members {
        match node {
            Node::Group(members) => dict.set_item(name, into_dict(py, members)?)?,
            Node::Column(values) => dict.set_item(name, PyArray1::from_vec(py, values))?,
            Node::Map(values, (ny, nx)) => {
                dict.set_item(name, PyArray1::from_vec(py, values).reshape([ny, nx])?)?;
            }
            Node::Text(text) => dict.set_item(name, PyList::new(py, text)?)?,
        }
    }
    Ok(dict)
}

/// The groups of a run's file as dictionaries, and its configuration.
#[pyfunction]
pub fn read_groups(py: Python<'_>, path: PathBuf) -> PyResult<(Bound<'_, PyDict>, String)> {
    let (members, toml) = run(py, None, |_| {
        let file = RunFileReader::open(&path)?;
        Ok((group(&file, "/")?, file.provenance()?.config_toml))
    })?;
    Ok((into_dict(py, members)?, toml))
}

/// (name, unit, draws (chain, draw)) of every quantity of a posterior.nc.
#[pyfunction]
pub fn read_posterior(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyList>> {
    let variables = read_draws(&path).or_raise(py)?;
    let all = PyList::empty(py);
    for variable in variables {
        let shape = [variable.draws.len(), variable.draws.first().map_or(0, Vec::len)];
        let draws = PyArray1::from_vec(py, variable.draws.concat()).reshape(shape)?;
        all.append((variable.name, variable.unit, draws))?;
    }
    Ok(all)
}
