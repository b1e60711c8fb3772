//! The halo catalogue: columns from birth to file.

use rayon::prelude::*;

use super::nfw_parameters::NfwScaling;
use crate::cosmology::Background;
use crate::error::{Error, Result, require};
use crate::profile::mass::{MassModel, Nfw, TruncatedNfw};

/// Haloes between observer and source, one NFW halo a row, deflections reduced to the source.
///
/// Angles are arcsec from the optical axis. `m200c_msun` and `c200c` are there when the haloes were drawn or
/// imported by mass; `r_trunc_arcsec` when they are truncated (infinite = not). Rows are in no particular order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HaloCatalogue {
    z_source: f64,
    /// Redshift, 0 < z < z_source.
    pub z: Vec<f64>,
    /// Position right of the axis.
    pub theta_x_arcsec: Vec<f64>,
    /// Position above the axis.
    pub theta_y_arcsec: Vec<f64>,
    /// NFW scale radius.
    pub r_s_arcsec: Vec<f64>,
    /// Reduced deflection at the scale radius.
    pub alpha_rs_arcsec: Vec<f64>,
    /// Truncation radius of Baltz et al. 2009, if any halo has one.
    pub r_trunc_arcsec: Option<Vec<f64>>,
    /// Mass within 200 times the critical density.
    pub m200c_msun: Option<Vec<f64>>,
    /// Concentration r_200c/r_s.
    pub c200c: Option<Vec<f64>>,
    /// A user's own numeric columns, kept in every output.
    pub extra: Vec<(String, Vec<f64>)>,
    /// A user's own text columns, kept in every output.
    pub extra_text: Vec<(String, Vec<String>)>,
}

/// A value that cannot stand in a catalogue: which row, which column, and what is allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct RowFault {
    /// Row, from 0.
    pub row: usize,
    /// Column name.
    pub column: &'static str,
    /// The value found.
    pub value: f64,
    /// The values allowed.
    pub allowed: String,
}

impl From<RowFault> for Error {
    fn from(fault: RowFault) -> Self {
        Self::out_of_range(
            &format!("{} of halo {}", fault.column, fault.row + 1),
            fault.value,
            &fault.allowed,
        )
    }
}

/// How the mass of each halo is given.
#[derive(Debug, Clone, PartialEq)]
pub enum HaloMasses {
    /// Scale radius and reduced deflection there, both in arcsec.
    Angles {
        /// NFW scale radius.
        r_s_arcsec: Vec<f64>,
        /// Reduced deflection at the scale radius.
        alpha_rs_arcsec: Vec<f64>,
    },
    /// Mass and concentration at 200 times the critical density at the halo's redshift.
    Physical {
        /// M200c in solar masses.
        m200c_msun: Vec<f64>,
        /// r_200c/r_s.
        c200c: Vec<f64>,
    },
}

impl HaloCatalogue {
    /// Builds and checks a catalogue; masses are turned into angles with `background`.
    ///
    /// # Errors
    /// The first value outside its domain, as a [`RowFault`]; unequal column lengths are a bug of the caller
    /// and reported as such.
    pub fn new(
        z_source: f64,
        background: &Background,
        z: Vec<f64>,
        theta_arcsec: [Vec<f64>; 2],
        masses: HaloMasses,
    ) -> std::result::Result<Self, RowFault> {
        let inside = format!("above 0 and below z_source = {z_source}");
        check(&z, "z", &inside, |v| v > 0.0 && v < z_source)?;
        let [theta_x_arcsec, theta_y_arcsec] = theta_arcsec;
        check(&theta_x_arcsec, "theta_x_arcsec", "finite", |_| true)?;
        check(&theta_y_arcsec, "theta_y_arcsec", "finite", |_| true)?;
        let mut catalogue = Self { z_source, z, theta_x_arcsec, theta_y_arcsec, ..Self::default() };
        match masses {
            HaloMasses::Angles { r_s_arcsec, alpha_rs_arcsec } => {
                check(&r_s_arcsec, "r_s_arcsec", "positive", |v| v > 0.0)?;
                check(&alpha_rs_arcsec, "alpha_rs_arcsec", "zero or positive (no negative mass)", |v| {
                    v >= 0.0
                })?;
                catalogue.r_s_arcsec = r_s_arcsec;
                catalogue.alpha_rs_arcsec = alpha_rs_arcsec;
            }
            HaloMasses::Physical { m200c_msun, c200c } => {
                check(&m200c_msun, "m200c_msun", "positive (no negative mass)", |v| v > 0.0)?;
                check(&c200c, "c200c", "positive", |v| v > 0.0)?;
                let scaling = NfwScaling::new(background, z_source);
                (catalogue.r_s_arcsec, catalogue.alpha_rs_arcsec) = (0..catalogue.z.len())
                    .into_par_iter()
                    .map(|i| scaling.angles_arcsec(m200c_msun[i], c200c[i], catalogue.z[i]))
                    .unzip();
                catalogue.m200c_msun = Some(m200c_msun);
                catalogue.c200c = Some(c200c);
            }
        }
        Ok(catalogue)
    }

    /// Truncates every halo at r_t = `tau` scale radii.
    ///
    /// # Errors
    /// When tau is not positive.
    pub fn truncated_at(mut self, tau: f64) -> Result<Self> {
        require(tau > 0.0, "truncation_over_r_s", tau, "positive")?;
        self.r_trunc_arcsec = Some(self.r_s_arcsec.iter().map(|r_s| tau * r_s).collect());
        Ok(self)
    }

    /// Source redshift to which the deflections are reduced.
    pub fn z_source(&self) -> f64 {
        self.z_source
    }

    /// Number of haloes.
    pub fn len(&self) -> usize {
        self.z.len()
    }

    /// True when there is no halo.
    pub fn is_empty(&self) -> bool {
        self.z.is_empty()
    }

    /// Truncation τ = r_t/r_s of halo `i`, infinite for a plain NFW halo.
    pub fn truncation(&self, i: usize) -> f64 {
        self.r_trunc_arcsec.as_ref().map_or(f64::INFINITY, |r| r[i] / self.r_s_arcsec[i])
    }

    /// Halo `i` as a lens.
    ///
    /// # Errors
    /// When its parameters are outside the profile's domain (an imported truncation radius, say).
    pub fn profile(&self, i: usize) -> Result<MassModel> {
        let (r_s, alpha) = (self.r_s_arcsec[i], self.alpha_rs_arcsec[i]);
        let centre = [self.theta_x_arcsec[i], self.theta_y_arcsec[i]];
        let r_trunc = self.truncation(i) * r_s;
        Ok(if r_trunc.is_finite() {
            MassModel::TruncatedNfw(TruncatedNfw::new(r_s, alpha, r_trunc, centre)?)
        } else {
            MassModel::Nfw(Nfw::new(r_s, alpha, centre)?)
        })
    }

    /// The haloes for which `keep` says so, in the same order.
    pub fn select(&self, keep: &[bool]) -> Self {
        let pick = |column: &Vec<f64>| filtered(column, keep);
        Self {
            z_source: self.z_source,
            z: pick(&self.z),
            theta_x_arcsec: pick(&self.theta_x_arcsec),
            theta_y_arcsec: pick(&self.theta_y_arcsec),
            r_s_arcsec: pick(&self.r_s_arcsec),
            alpha_rs_arcsec: pick(&self.alpha_rs_arcsec),
            r_trunc_arcsec: self.r_trunc_arcsec.as_ref().map(pick),
            m200c_msun: self.m200c_msun.as_ref().map(pick),
            c200c: self.c200c.as_ref().map(pick),
            extra: self.extra.iter().map(|(name, column)| (name.clone(), pick(column))).collect(),
            extra_text: self
                .extra_text
                .iter()
                .map(|(name, column)| (name.clone(), filtered(column, keep)))
                .collect(),
        }
    }
}

fn filtered<T: Clone>(column: &[T], keep: &[bool]) -> Vec<T> {
    column.iter().zip(keep).filter(|(_, keep)| **keep).map(|(v, _)| v.clone()).collect()
}

fn check(
    column: &[f64],
    name: &'static str,
    allowed: &str,
    ok: impl Fn(f64) -> bool,
) -> std::result::Result<(), RowFault> {
    match column.iter().position(|&v| !v.is_finite() || !ok(v)) {
        None => Ok(()),
        Some(row) => Err(RowFault { row, column: name, value: column[row], allowed: allowed.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(z: f64, r_s: f64, alpha: f64) -> std::result::Result<HaloCatalogue, RowFault> {
        let masses = HaloMasses::Angles { r_s_arcsec: vec![1.0, r_s], alpha_rs_arcsec: vec![0.1, alpha] };
        HaloCatalogue::new(1.5, &Background::paper(), vec![0.4, z], [vec![0.0, 1.0], vec![2.0, 3.0]], masses)
    }

    #[test]
    fn faults_name_row_column_and_domain() {
        for (z, r_s, alpha, column) in [
            (1.5, 1.0, 0.1, "z"),
            (0.0, 1.0, 0.1, "z"),
            (f64::NAN, 1.0, 0.1, "z"),
            (0.3, 0.0, 0.1, "r_s_arcsec"),
            (0.3, 1.0, -0.1, "alpha_rs_arcsec"),
            (0.3, f64::INFINITY, 0.1, "r_s_arcsec"),
        ] {
            let fault = build(z, r_s, alpha).unwrap_err();
            assert_eq!((fault.row, fault.column), (1, column));
        }
        assert!(build(0.3, 1.0, 0.1).is_ok());
    }

    #[test]
    fn selection_keeps_order_and_all_columns() {
        let mut haloes = build(0.3, 2.0, 0.2).unwrap();
        haloes.extra.push(("id".into(), vec![7.0, 8.0]));
        let one = haloes.select(&[false, true]);
        assert_eq!((one.len(), one.z[0], one.r_s_arcsec[0], one.extra[0].1[0]), (1, 0.3, 2.0, 8.0));
    }
}
