//! What to do about each error, chosen by its variant alone.

use super::{Error, FileFault, TableKind};

impl Error {
    /// One line that helps: where the allowed values are listed, what a file must hold, what to try.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Argument { .. } => "`--help` after the subcommand explains its arguments",
            Self::Config { cause, .. } => cause.hint(),
            Self::MassDefinition { .. } => {
                "sheth99 and press74 go with mass_definition = \"fof\", tinker08 with \"200c\""
            }
            Self::OutOfRange { .. } | Self::Toml { .. } => {
                "`haloray schema KEY` explains a key of a configuration, `haloray schema all` every one"
            }
            Self::ModelName { .. } => "`haloray fit --list` explains the built-in models",
            Self::Model { .. } => {
                "`haloray fit --list --model NAME` prints a model to compare with; `haloray fit --list` explains the priors"
            }
            Self::File { fault: FileFault::LensModel, .. } => {
                "`haloray lens --help` shows a lens model as JSON, with all it may hold"
            }
            Self::File { fault: FileFault::Observation, .. } => {
                "`haloray fit --help` lists the keywords and extensions that an image needs: EXPTIME, BKGRMS, PSFFWHM or PSF, MASK"
            }
            Self::File { fault: FileFault::PsfKernel, .. } => {
                "a PSF kernel is a square image of odd size, on the pixels of the image or whole parts of them; an extension PSF sums to 1"
            }
            Self::Table { kind: TableKind::Haloes, .. } => {
                "a halo table has z,theta_x_arcsec,theta_y_arcsec and r_s_arcsec,alpha_rs_arcsec or m200c_msun,c200c"
            }
            Self::Table { kind: TableKind::Lightcone, .. } => {
                "a light cone has right ascension, declination, redshift and mass; `haloray extract --help` says how to name columns, units and definitions"
            }
            Self::Table { kind: TableKind::Points, .. } => "a points table has theta_x_arcsec,theta_y_arcsec",
            Self::Table { kind: TableKind::Truth, .. } => {
                "a truth.csv has image,gamma1_los,gamma2_los and, if known, quality"
            }
            Self::Table { kind: TableKind::Other, .. } => {
                "a table has columns of equal length and different names; .csv, .h5 and .fits hold one"
            }
            Self::File { fault: FileFault::UnknownFormat, .. } => {
                "tables are .csv, .h5 or .fits files; images are .fits files, lens models .json (`haloray lens --help`)"
            }
            Self::File { fault: FileFault::Damaged, .. } => {
                "the file is damaged, or of a rare kind that is not read; make or copy it again"
            }
            Self::File { fault: FileFault::TooLarge, .. } => {
                "what a file declares is compared with its size and the free memory before it is read"
            }
            Self::File { fault: FileFault::Content, .. } => {
                "the file is whole, but not one that this command reads; docs/FILES.md says what each holds"
            }
            Self::Read { .. } => {
                "check the path and its permissions; files named in a configuration are looked for beside it"
            }
            Self::OutputPlace { .. } => {
                "choose another place (-o, in Python output); its parent folder must exist and be writable"
            }
            Self::Write { .. } | Self::StandardOutput { .. } => "is the disk full?",
            Self::Cancelled => "the same command begins again, or continues where it can",
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_hint_follows_the_variant_whatever_the_words() {
        let words = "PSF truncated kernel --option";
        let path = Path::new("a.fits");
        for (fault, start) in [
            (FileFault::Damaged, "the file is damaged"),
            (FileFault::PsfKernel, "a PSF kernel"),
            (FileFault::Observation, "`haloray fit --help`"),
            (FileFault::UnknownFormat, "tables are"),
        ] {
            assert!(Error::file(fault, path, words).hint().starts_with(start));
        }
        let haloes = Error::table(path, "line 3", words).in_table(TableKind::Haloes);
        assert!(haloes.hint().starts_with("a halo table has z,"));
        let of_option = Error::out_of_range("h0", 0, "positive").named("h0", "--h0");
        assert!(of_option.hint().starts_with("`--help`"));
        assert_eq!(of_option.to_string(), "--h0 is 0, but must be positive");
    }
}
