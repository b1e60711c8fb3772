//! The model of a fit, with the halo table that its line of sight may be made of.

use std::path::{Path, PathBuf};

use haloray::config::{LineOfSightConfig, SheetModel};
use haloray::cosmology::Background;
use haloray::halo::HaloCatalogue;
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::io::{ExposureKeywords, SHEET_COLUMN, read_haloes, read_line_of_sight};
use haloray::mapping::HaloSight;
use haloray::mapping::multiplane::{LineOfSight, Sheets};
use haloray::mapping::tidal::LineOfSightKind;
use haloray::{Error, Result};

/// Puts the halo table of the command line, or that of the model's file by its place beside that file, into the description.
pub fn choose_table(
    description: &mut ModelDescription,
    option: Option<&Path>,
    model: Option<&str>,
) -> Result<()> {
    let los = &mut description.line_of_sight;
    match option {
        Some(table) if los.model == LineOfSightKind::Haloes => los.file = Some(table.into()),
        Some(table) => {
            let allowed = "left out unless the model's line_of_sight.model is \"haloes\"";
            return Err(Error::Argument {
                option: "--haloes".into(),
                value: table.display().to_string(),
                allowed: allowed.into(),
            });
        }
        None => {
            let folder = model.map(Path::new).and_then(Path::parent);
            if let (Some(file), Some(folder)) = (&mut los.file, folder) {
                *file = folder.join(&*file);
            }
        }
    }
    Ok(())
}

/// Compiles the model; where its line of sight is made of haloes, these are read. Redshifts that it leaves out are those of the
/// image.
pub fn compile(description: &ModelDescription, image: &ExposureKeywords) -> Result<CompiledModel> {
    let in_model = |error: Error| error.in_model(&description.name);
    let los = &description.line_of_sight;
    if los.model != LineOfSightKind::Haloes {
        return CompiledModel::new(description).map_err(in_model);
    }
    let missing = |what: &str, allowed: &str| in_model(Error::out_of_range(what, "missing", allowed));
    let file: &PathBuf = los.file.as_ref().ok_or_else(|| {
        missing("line_of_sight.file", "a halo table, in the model or after --haloes (a run.h5 holds one)")
    })?;
    let redshift = |own: Option<f64>, of_image: Option<f64>, key: &str, keyword: &str| {
        own.or(of_image).ok_or_else(|| missing(key, &format!("given, or {keyword} in the image")))
    };
    let z_source = redshift(los.z_source, image.z_source, "line_of_sight.z_source", "ZSOURCE")?;
    let z_lens = redshift(los.z_lens, image.z_lens, "line_of_sight.z_lens", "ZLENS")?;
    let background = los.cosmology.unwrap_or_else(Background::paper);
    let haloes = read_haloes(file, z_source, &background)?;
    let written_for = read_line_of_sight(file);
    let reference = los.reference.or(written_for.as_ref().map(|sight| sight.reference)).unwrap_or_default();
    let sheets = match los.sheets {
        Some(own) => own.sheets(),
        None => sheets_of(written_for.as_ref(), &haloes).map_err(in_model)?,
    };
    let sight = LineOfSight::along(reference, &haloes, &sheets)?;
    let haloes = HaloSight::new(sight, z_lens).map_err(in_model)?;
    CompiledModel::through_haloes(description, haloes).map_err(in_model)
}

/// The sheets of the run that wrote a table; on the axis for a table of unknown origin.
fn sheets_of(written_for: Option<&LineOfSightConfig>, haloes: &HaloCatalogue) -> Result<Sheets> {
    Ok(match written_for.map(|sight| (sight.sheets, sight.is_beside_axis())) {
        None | Some((SheetModel::OnAxis, false)) => Sheets::OnAxis,
        Some((SheetModel::OnAxis, true)) => Sheets::OnRay,
        Some((SheetModel::None, _)) => Sheets::None,
        Some((SheetModel::MeanDensity, _)) => {
            let own = haloes.extra.iter().find(|(name, _)| name == SHEET_COLUMN);
            let kappa = own.ok_or_else(|| {
                let allowed =
                    "given: the table was drawn for sheets of the mean density and does not hold them";
                Error::out_of_range("line_of_sight.sheets", "missing", allowed)
            })?;
            Sheets::Expected(kappa.1.clone())
        }
    })
}
