//! The draws of a posterior as netCDF-4, which ArviZ opens: `az.from_netcdf("posterior.nc")`.

use std::path::Path;

use hdf5::{Datatype, File, Group};

use crate::error::{Error, Result};
use crate::inference::sample::{Chain, Chains};
use crate::io::containers::{
    AttributeValue, Provenance, Values, hdf5_objects as objects, hdf5_reading as reading,
    netcdf_objects as netcdf, refuse_non_finite,
};

/// Group of the parameters, as ArviZ names it.
const POSTERIOR: &str = "posterior";
/// Group of what the sampler noted, as ArviZ names it.
const SAMPLE_STATS: &str = "sample_stats";

/// One quantity of a posterior.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorVariable {
    /// Name, without '/'.
    pub name: String,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Label for figures, in the markup of [`crate::plot`].
    pub label: String,
    /// Draws, a vector a chain, all of one length.
    pub draws: Vec<Vec<f64>>,
}

/// Writes the variables over (chain, draw) to `/posterior`, and to `/sample_stats` the log-posterior `lp` in
/// latent coordinates, `log_likelihood` and what else the sampler noted (`diverging`, `energy`,
/// `acceptance_rate`, `tree_depth`).
///
/// `attributes` go to `/posterior`. Write inside [`Staging`](crate::io::Staging) or
/// [`write_atomically`](crate::io::write_atomically). The walkers of an ensemble are chains here; the attribute
/// `group_size` says how many consecutive ones move together.
///
/// # Errors
/// [`Error::Write`]; [`Error::OutOfRange`] if a variable has other chains or draws than `chains`; [`Error::Table`] for a draw that
/// is no finite number.
pub fn write_posterior(
    path: &Path,
    provenance: &Provenance,
    variables: &[PosteriorVariable],
    chains: &Chains,
    attributes: &[(&str, AttributeValue)],
) -> Result<()> {
    for variable in variables {
        for (chain, draws) in variable.draws.iter().enumerate() {
            refuse_non_finite(path, &format!("{} of chain {}", variable.name, chain + 1), draws)?;
        }
    }
    let file = objects::create(path)?;
    objects::write_provenance(path, &file, provenance)?;
    let writer = Writer { path, shape: (chains.chains.len(), chains.draws()), text16: netcdf::text16(path)? };
    let posterior = writer.group(&file, POSTERIOR)?;
    let library: [(&str, AttributeValue); 2] =
        [("inference_library", "haloray".into()), ("group_size", (chains.group_size as i64).into())];
    for (name, value) in library.iter().chain(attributes) {
        objects::write_attribute(path, &posterior, name, value)?;
    }
    for variable in variables {
        let dataset = writer.variable(&posterior, &variable.name, &variable.draws)?;
        for (name, value) in [("unit", &variable.unit), ("label", &variable.label)] {
            objects::write_attribute(path, &dataset, name, &AttributeValue::Text(value.clone()))?;
        }
    }
    let stats = writer.group(&file, SAMPLE_STATS)?;
    let of = |value: &dyn Fn(&Chain) -> Vec<f64>| chains.chains.iter().map(value).collect::<Vec<_>>();
    writer.variable(&stats, "lp", &of(&|chain| chain.log_density(chains.dimension)))?;
    writer.variable(&stats, "log_likelihood", &of(&|chain| chain.log_likelihood.clone()))?;
    if chains.chains.iter().all(|chain| chain.energy.len() == chain.len()) {
        writer.variable(&stats, "energy", &of(&|chain| chain.energy.clone()))?;
        writer.variable(&stats, "acceptance_rate", &of(&|chain| chain.acceptance.clone()))?;
        let integers =
            |value: &dyn Fn(&Chain) -> Vec<i8>| chains.chains.iter().map(value).collect::<Vec<_>>();
        let divergent = integers(&|chain| chain.divergent.iter().map(|&is| i8::from(is)).collect());
        let diverging = writer.variable(&stats, "diverging", &divergent)?;
        // How xarray marks truth values, which netCDF lacks.
        objects::write_attribute(path, &diverging, "dtype", &"bool".into())?;
        let depth = integers(&|chain| chain.tree_depth.iter().map(|&depth| depth as i8).collect());
        writer.variable(&stats, "tree_depth", &depth)?;
    }
    drop((posterior, stats));
    objects::close(path, file)
}

/// What every variable of the file shares.
struct Writer<'a> {
    path: &'a Path,
    /// Chains and draws.
    shape: (usize, usize),
    text16: Datatype,
}

impl Writer<'_> {
    fn group(&self, file: &File, name: &str) -> Result<Group> {
        let group = objects::group_or_new(self.path, file, name)?;
        netcdf::write_dimension(self.path, &group, &self.text16, "chain", self.shape.0, 0)?;
        netcdf::write_dimension(self.path, &group, &self.text16, "draw", self.shape.1, 1)?;
        Ok(group)
    }

    fn variable<T: hdf5::H5Type + Clone>(
        &self,
        group: &Group,
        name: &str,
        draws: &[Vec<T>],
    ) -> Result<hdf5::Dataset> {
        let (chains, length) = self.shape;
        if draws.len() != chains || draws.iter().any(|chain| chain.len() != length) {
            let what = format!("the number of draws of {name}");
            let given = draws.iter().map(Vec::len).sum::<usize>();
            return Err(Error::out_of_range(&what, given, &format!("{length} in each of {chains} chains")));
        }
        let dimensions = [("chain", chains), ("draw", length)];
        netcdf::write_variable(self.path, group, name, &draws.concat(), &dimensions)
    }
}

/// Reads the variables of `/posterior` in the order they were written.
///
/// # Errors
/// [`Error::Read`] or [`Error::File`].
pub fn read_posterior(path: &Path) -> Result<Vec<PosteriorVariable>> {
    let file = reading::open(path)?;
    let group = file.group(POSTERIOR).map_err(|error| reading::damaged(path, &error))?;
    let mut variables = Vec::new();
    for dataset in reading::members(path, &group)?.1 {
        let [_, length] = dataset.shape()[..] else { continue };
        let Values::F64(values) = reading::read_values(path, &dataset)? else { continue };
        let text = |name: &str| match dataset.attribute(name) {
            Ok(attribute) => match reading::attribute_value(path, &attribute)? {
                AttributeValue::Text(text) => Ok::<String, Error>(text),
                _ => Ok(String::new()),
            },
            Err(_) => Ok(String::new()),
        };
        let draws = values.chunks((length as usize).max(1)).map(<[f64]>::to_vec).collect();
        let (unit, label) = (text("unit")?, text("label")?);
        variables.push(PosteriorVariable { unit, label, name: dataset.name().into(), draws });
    }
    Ok(variables)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chains() -> Chains {
        let chain = |shift: f64| Chain {
            z: vec![shift, 0.5, shift + 1.0, -0.5, shift, 0.0],
            log_likelihood: vec![-1.0, -2.0, shift],
            energy: vec![3.0, 2.0, 1.0],
            acceptance: vec![0.9, 0.8, 0.7],
            divergent: vec![false, true, false],
            tree_depth: vec![3, 10, 2],
        };
        Chains { dimension: 2, group_size: 1, chains: vec![chain(0.0), chain(0.1)] }
    }

    fn variable(name: &str) -> PosteriorVariable {
        let draws = vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]];
        PosteriorVariable { name: name.into(), unit: "arcsec".into(), label: "θ_{E}".into(), draws }
    }

    #[test]
    fn variables_come_back_in_their_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("posterior.nc");
        let variables = [variable("theta_e_arcsec"), variable("gamma1_los"), variable("aaa")];
        let provenance = Provenance::new(Some(3), "seed = 3\n");
        let attributes = [("converged", AttributeValue::from("false"))];
        write_posterior(&path, &provenance, &variables, &chains(), &attributes).unwrap();
        assert_eq!(read_posterior(&path).unwrap(), variables);

        let file = hdf5::File::open(&path).unwrap();
        let dataset = |name: &str| file.dataset(name).unwrap();
        assert_eq!(dataset("sample_stats/tree_depth").read_raw::<i64>().unwrap(), [3, 10, 2, 3, 10, 2]);
        assert_eq!(dataset("sample_stats/diverging").read_raw::<i8>().unwrap(), [0, 1, 0, 0, 1, 0]);
        assert_eq!(dataset("sample_stats/lp").read_raw::<f64>().unwrap()[1], -2.0 - 0.5 * 1.25);
        assert_eq!(dataset("sample_stats/lp").shape(), [2, 3]);
        for group in [POSTERIOR, SAMPLE_STATS] {
            for (number, name) in ["chain", "draw"].into_iter().enumerate() {
                let scale = dataset(&format!("{group}/{name}"));
                let class = scale.attr("CLASS").unwrap();
                assert_eq!(
                    class.read_scalar::<hdf5::types::FixedAscii<16>>().unwrap().as_str(),
                    "DIMENSION_SCALE"
                );
                assert_eq!(scale.attr("_Netcdf4Dimid").unwrap().read_scalar::<i32>().unwrap(), number as i32);
            }
        }
        assert_eq!(dataset("posterior/aaa").attr("DIMENSION_LIST").unwrap().shape(), [2]);
    }

    #[test]
    fn the_same_draws_give_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| {
            let path = folder.path().join(name);
            let provenance = Provenance::new(None, "");
            write_posterior(&path, &provenance, &[variable("a")], &chains(), &[]).unwrap();
            std::fs::read(path).unwrap()
        };
        assert!(write("a.nc") == write("b.nc"));
    }

    #[test]
    fn chains_of_other_lengths_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut short = variable("a");
        short.draws[1].pop();
        let path = folder.path().join("a.nc");
        let refused = write_posterior(&path, &Provenance::new(None, ""), &[short], &chains(), &[]);
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("of a is 5, but must be 3 in each of 2 chains"), "{message}");
    }

    /// Leaves the file in the folder named by HALORAY_POSTERIOR_FOLDER, for `data/netcdf/check_posterior.py`.
    #[test]
    #[ignore = "needs ArviZ beside it: just arviz"]
    fn leaves_a_file_for_arviz() {
        let folder = std::env::var("HALORAY_POSTERIOR_FOLDER").unwrap();
        let path = Path::new(&folder).join("posterior.nc");
        let attributes = [("converged", AttributeValue::from("true"))];
        let variables = [variable("theta_e_arcsec"), variable("gamma1_los")];
        write_posterior(&path, &Provenance::new(Some(1), "a = 1\n"), &variables, &chains(), &attributes)
            .unwrap();
    }
}
