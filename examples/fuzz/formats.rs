//! The formats of input: sound seeds, how the library reads them, and a command that reads them.

use std::path::Path;

use haloray::config::{Preset, load};
use haloray::cosmology::Background;
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::io::{read_haloes, read_lens_model, read_observation, read_points, read_text};

/// One kind of input.
pub struct Format {
    /// In the table of counts.
    pub name: &'static str,
    /// The name under which it is read.
    pub file: &'static str,
    /// Sound files, relative to the repository.
    pub seeds: &'static [(&'static str, &'static [u8])],
    /// Reads it, whatever comes of that.
    pub library: fn(&Path),
    /// Arguments of the binary, separated by spaces.
    pub command: &'static str,
    /// What a successful command leaves.
    pub outputs: &'static [&'static str],
}

macro_rules! seeds {
    ($($name:literal),* $(,)?) => { &[$(($name, include_bytes!(concat!("../../data/", $name)))),*] };
}

const RAYS: &[&str] = &["out.csv", "out.csv.provenance.toml"];

/// A lens model as `haloray lens` takes it.
const LENS: &[u8] = br#"{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["LOS_MINIMAL", "EPL", "SHEAR"],
"kwargs_lens": [{"kappa_od": 0.01, "gamma1_od": 0.01, "gamma2_od": 0.0, "omega_od": 0.0, "kappa_los": 0.0, "gamma1_los": 0.03,
"gamma2_los": -0.02, "omega_los": 0.0}, {"theta_E": 1.2, "gamma": 2.0, "e1": 0.1, "e2": 0.0, "center_x": 0.0, "center_y": 0.0},
{"gamma1": 0.02, "gamma2": 0.01, "ra_0": 0.0, "dec_0": 0.0}], "cosmology": {"H0": 67.4, "Om0": 0.315}}"#;
/// The same lens in planes.
const PLANES: &[u8] =
    br#"{"z_source": 1.5, "lens_model_list": ["SIE", "NFW"], "lens_redshift_list": [0.5, 0.7],
"kwargs_lens": [{"theta_E": 1.2, "e1": 0.1, "e2": 0.0, "center_x": 0.0, "center_y": 0.0},
{"Rs": 2.0, "alpha_Rs": 0.1, "center_x": 1.0, "center_y": -0.5}]}"#;
const CONFIG: &[u8] = b"[haloes]\nmin_point_shear = 1e-3\nprofile = \"nfw\"\n[line_of_sight]\nz_lens = 0.5\nz_source = 1.5\n\
[image]\npixels = 12\n[maps]\npoints = 9\n[instrument]\npixel_scale_arcsec = 0.08\npsf_fwhm_arcsec = 0.1\nexposure_s = 5400.0\n";
/// Haloes and points in CSV by masses, with comments, quoted text and columns of their own.
const MASSES: &[u8] = b"# haloes\nz,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c,name\n0.5,1,2,1e12,8,\"a, b\"\n0.7,-3,0.5,2e11,9,c\n";
const POINTS: &[u8] = b"theta_x_arcsec,theta_y_arcsec,id\n0,0,1\n1,0.5,2\n-0.3,1.1,3\n";

fn haloes(path: &Path) {
    let _ = read_haloes(path, 1.5, &Background::paper());
}

fn image(path: &Path) {
    let _ = read_observation(path);
}

/// All of them.
pub const FORMATS: [Format; 10] = [
    Format {
        name: "halo table, CSV",
        file: "in.csv",
        seeds: &[
            ("masses", MASSES),
            ("pandas", include_bytes!("../../data/inputs/pandas.csv")),
            ("trailing", include_bytes!("../../data/inputs/haloes_trailing_comma.csv")),
        ],
        library: haloes,
        command: "trace --haloes in.csv --points points.csv --z-source 1.5 --order 1 -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "halo table, ECSV",
        file: "in.ecsv",
        seeds: seeds!["inputs/astropy.ecsv", "inputs/astropy_comma.ecsv"],
        library: haloes,
        command: "trace --haloes in.ecsv --points points.csv --z-source 1.5 -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "halo table, FITS",
        file: "in.fits",
        seeds: seeds!["inputs/astropy.fits", "inputs/haloes_unit_deg.fits"],
        library: haloes,
        command: "trace --haloes in.fits --points points.csv --z-source 1.5 -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "halo table, HDF5",
        file: "in.h5",
        seeds: seeds![
            "inputs/astropy.h5",
            "inputs/h5py_records.h5",
            "inputs/h5py_columns.h5",
            "inputs/haloes_unit_deg.h5",
            "inputs/vlen_unit_segv.h5",
            "inputs/declared_1e12_rows.h5",
        ],
        library: haloes,
        command: "trace --haloes in.h5 --points points.csv --z-source 1.5 -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "points, CSV",
        file: "in.csv",
        seeds: &[("points", POINTS), ("points", include_bytes!("../../data/inputs/points.csv"))],
        library: |path| drop(read_points(path)),
        command: "lens lens.json --points in.csv -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "image, FITS",
        file: "in.fits",
        seeds: seeds![
            "inputs/image_ok.fits",
            "inputs/psf_half_pixel.fits",
            "inputs/sci_inherit.fits",
            "inputs/scaled.fits",
            "inputs/blank.fits",
            "inputs/wcs_to_header.fits",
        ],
        library: image,
        command: "image psf.toml -o out.fits",
        outputs: &["out.fits"],
    },
    Format {
        name: "image, packed FITS",
        file: "in.fits",
        seeds: seeds![
            "inputs/rice_1.fits.fz",
            "inputs/gzip_1.fits.fz",
            "inputs/gzip_2.fits.fz",
            "inputs/gzip_1_steps.fits.fz",
            "inputs/kernel_rice_1.fits.fz",
            "inputs/kernel_gzip_1.fits.fz",
            "inputs/gzipped.fits.gz",
        ],
        library: image,
        command: "image psf.toml -o out.fits",
        outputs: &["out.fits"],
    },
    Format {
        name: "lens model, JSON",
        file: "in.json",
        seeds: &[("lens", LENS), ("planes", PLANES)],
        library: |path| drop(read_lens_model(path, &Background::paper())),
        command: "lens in.json --points points.csv -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "configuration, TOML",
        file: "in.toml",
        seeds: &[("config", CONFIG)],
        library: |path| drop(load(Preset::Paper, Some(path))),
        command: "relations in.toml -o out.csv",
        outputs: RAYS,
    },
    Format {
        name: "model, TOML",
        file: "in.toml",
        seeds: seeds![
            "inputs/free5.toml",
            "models/comprehensive.toml",
            "models/haloes.toml",
            "models/tidal-flexion.toml"
        ],
        library: |path| {
            let description = read_text(path).ok().and_then(|text| ModelDescription::parse(&text).ok());
            drop(description.map(|description| CompiledModel::new(&description)));
        },
        command: "fit --list --model in.toml",
        outputs: &[],
    },
];

/// What commands find beside the input.
pub const BESIDE: [(&str, &[u8]); 3] = [
    ("points.csv", POINTS),
    ("lens.json", LENS),
    (
        "psf.toml",
        b"[haloes]\nmin_point_shear = 1e-3\n[image]\npixels = 8\n[instrument]\npsf_file = \"in.fits\"\npixel_scale_arcsec = 0.1\n",
    ),
];
