//! Files of results, read back.

use std::collections::BTreeMap;
use std::path::PathBuf;

use haloray::io::{AttributeValue, RunFileReader, read_posterior as read_draws};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

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

/// What a file says of itself as a whole, which has places of its own in Python.
const PROVENANCE: [&str; 4] = ["haloray_version", "git_revision", "seed", "config_toml"];

/// The attributes of groups and the units of what they hold, by path.
#[derive(Default)]
struct Attached {
    groups: Vec<(String, Vec<(String, AttributeValue)>)>,
    units: Vec<(String, String)>,
}

impl Attached {
    fn gather(
        &mut self,
        file: &RunFileReader,
        path: &str,
        members: &[(String, Node)],
    ) -> haloray::Result<()> {
        let mut found = file.read_attributes(path)?;
        found.retain(|(name, _)| path != "/" || !PROVENANCE.contains(&name.as_str()));
        self.groups.push((path.to_owned(), found));
        for (name, node) in members {
            let full = if path == "/" { name.clone() } else { format!("{path}/{name}") };
            if let Node::Group(members) = node {
                self.gather(file, &full, members)?;
            } else if let Ok(AttributeValue::Text(unit)) = file.read_attribute(&full, "unit") {
                self.units.push((full, unit));
            }
        }
        Ok(())
    }
}

fn attributes<'py>(
    py: Python<'py>,
    groups: Vec<(String, Vec<(String, AttributeValue)>)>,
) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (path, found) in groups {
        let own = PyDict::new(py);
        for (name, value) in found {
            match value {
                AttributeValue::F64(value) => own.set_item(name, value)?,
                AttributeValue::I64(value) => own.set_item(name, value)?,
                AttributeValue::U64(value) => own.set_item(name, value)?,
                AttributeValue::Text(value) => own.set_item(name, value)?,
            }
        }
        all.set_item(path, own)?;
    }
    Ok(all)
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

/// The groups of a run's file as dictionaries, its configuration, what is attached to groups, and units.
#[pyfunction]
pub fn read_groups(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyTuple>> {
    let (members, toml, attached) = run(py, None, |_| {
        let file = RunFileReader::open(&path)?;
        let members = group(&file, "/")?;
        let mut attached = Attached::default();
        attached.gather(&file, "/", &members)?;
        Ok((members, file.provenance()?.config_toml, attached))
    })?;
    (
        into_dict(py, members)?,
        toml,
        attributes(py, attached.groups)?,
        attached.units.into_iter().collect::<BTreeMap<_, _>>(),
    )
        .into_pyobject(py)
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
