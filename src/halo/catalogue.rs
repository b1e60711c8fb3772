//! The halo catalogue: columns from birth to file.

use rayon::prelude::*;

use super::nfw_parameters::NfwScaling;
use super::truncation::Truncation;
use crate::cosmology::Background;
use crate::error::{Domain, Error, Result, shortest};
use crate::profile::mass::{MassModel, MassProfile, Nfw, TruncatedNfw, nfw_radial, resolved_scale_radius};

/// Haloes between observer and source, one NFW halo a row, deflections reduced to the source.
///
/// Angles are arcsec from the optical axis. `m200c_msun` and `c200c` are there when the haloes were drawn or
/// imported by mass; `r_trunc_arcsec` when they are truncated (infinite = not). Rows are in no particular order.
#[derive(Debug, Clone, PartialEq)]
pub struct HaloCatalogue {
    background: Background,
    z_source: f64,
    /// Redshift, 0 < z < z_source.
    pub z: Vec<f64>,
    /// Comoving distance χ(z), Mpc.
    pub chi_cmpc: Vec<f64>,
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
    /// The value found; none where the column is too short.
    pub value: Option<f64>,
    /// The values allowed.
    pub allowed: String,
}

impl RowFault {
    /// The value found, or that there is none.
    pub fn value_or_missing(&self) -> String {
        self.value.map_or_else(|| "a missing value".into(), shortest)
    }
}

impl From<RowFault> for Error {
    fn from(fault: RowFault) -> Self {
        Self::out_of_range(
            &format!("{} of halo {}", fault.column, fault.row + 1),
            fault.value_or_missing(),
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
    /// The first value outside its domain or missing, as a [`RowFault`].
    pub fn new(
        z_source: f64,
        background: &Background,
        z: Vec<f64>,
        theta_arcsec: [Vec<f64>; 2],
        masses: HaloMasses,
    ) -> std::result::Result<Self, RowFault> {
        let [theta_x_arcsec, theta_y_arcsec] = theta_arcsec;
        let of_mass = match &masses {
            HaloMasses::Angles { r_s_arcsec, alpha_rs_arcsec } => [
                ("r_s_arcsec", r_s_arcsec, Domain::POSITIVE, ""),
                ("alpha_rs_arcsec", alpha_rs_arcsec, Domain::NON_NEGATIVE, " (no negative mass)"),
            ],
            HaloMasses::Physical { m200c_msun, c200c } => [
                ("m200c_msun", m200c_msun, Domain::POSITIVE, " (no negative mass)"),
                ("c200c", c200c, Domain::POSITIVE, ""),
            ],
        };
        let places = [
            ("z", &z, Domain::inside(0.0, z_source), " (z_source)"),
            ("theta_x_arcsec", &theta_x_arcsec, Domain::FINITE, ""),
            ("theta_y_arcsec", &theta_y_arcsec, Domain::FINITE, ""),
        ];
        let columns = || places.iter().chain(&of_mass);
        let rows = columns().map(|(_, column, ..)| column.len()).max().unwrap_or(0);
        for (column, values, domain, why) in columns() {
            if let Some(row) = (0..rows).find(|&row| !values.get(row).is_some_and(|v| domain.contains(*v))) {
                let value = values.get(row).copied();
                return Err(RowFault { row, column, value, allowed: format!("{domain}{why}") });
            }
        }
        let chi_cmpc = background.comoving_distances_mpc(&z);
        let (r_s_arcsec, alpha_rs_arcsec, m200c_msun, c200c) = match masses {
            HaloMasses::Angles { r_s_arcsec, alpha_rs_arcsec } => (r_s_arcsec, alpha_rs_arcsec, None, None),
            HaloMasses::Physical { m200c_msun, c200c } => {
                let scaling = NfwScaling::new(background, z_source);
                let (r_s_arcsec, alpha_rs_arcsec): (Vec<f64>, Vec<f64>) = (0..rows)
                    .into_par_iter()
                    .map(|i| scaling.angles_arcsec(m200c_msun[i], c200c[i], z[i], chi_cmpc[i]))
                    .unzip();
                let is_lens =
                    |i: &usize| r_s_arcsec[*i] > 0.0 && r_s_arcsec[*i] + alpha_rs_arcsec[*i] < f64::INFINITY;
                if let Some(row) = (0..rows).find(|i| !is_lens(i)) {
                    let allowed = "such that the scale radius and the deflection are finite numbers".into();
                    return Err(RowFault { row, column: "c200c", value: Some(c200c[row]), allowed });
                }
                (r_s_arcsec, alpha_rs_arcsec, Some(m200c_msun), Some(c200c))
            }
        };
        Ok(Self {
            background: *background,
            z_source,
            z,
            chi_cmpc,
            theta_x_arcsec,
            theta_y_arcsec,
            r_s_arcsec,
            alpha_rs_arcsec,
            r_trunc_arcsec: None,
            m200c_msun,
            c200c,
            extra: Vec::new(),
            extra_text: Vec::new(),
        })
    }

    /// Truncates every halo.
    ///
    /// # Errors
    /// A number outside its domain; concentrations that are missing where the truncation depends on them.
    pub fn truncated(mut self, truncation: Truncation) -> Result<Self> {
        truncation.validate()?;
        let radii = match (truncation, &self.c200c) {
            (Truncation::OverRs(tau), _) => self.r_s_arcsec.iter().map(|r_s| tau * r_s).collect(),
            (_, Some(c200c)) => {
                self.r_s_arcsec.par_iter().zip(c200c).map(|(r_s, c)| r_s * truncation.over_r_s(*c)).collect()
            }
            (_, None) => {
                let what = format!("columns of the catalogue for haloes.{}", truncation.named().0);
                return Err(Error::out_of_range(&what, "without c200c", "with c200c"));
            }
        };
        self.r_trunc_arcsec = Some(radii);
        Ok(self)
    }

    /// The cosmology that made distances from redshifts.
    pub fn background(&self) -> &Background {
        &self.background
    }

    /// Source redshift to which the deflections are reduced.
    pub fn z_source(&self) -> f64 {
        self.z_source
    }

    /// Median ratio of the deflections to those of the masses and concentrations, where it is so far from one that the angles must
    /// belong to another source or cosmology; none where they agree, or without masses.
    pub fn angles_against_masses(&self) -> Option<f64> {
        /// Largest disagreement.
        const ALLOWED: f64 = 0.01;
        let (m200c_msun, c200c) = (self.m200c_msun.as_ref()?, self.c200c.as_ref()?);
        let scaling = NfwScaling::new(&self.background, self.z_source);
        let of_mass =
            |i: usize| scaling.angles_arcsec(m200c_msun[i], c200c[i], self.z[i], self.chi_cmpc[i]).1;
        let mut ratios: Vec<f64> = (0..self.len()).map(|i| self.alpha_rs_arcsec[i] / of_mass(i)).collect();
        ratios.sort_by(f64::total_cmp);
        ratios.get(ratios.len() / 2).copied().filter(|median| (median - 1.0).abs() > ALLOWED)
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

    /// Convergence κ_h of every halo, reduced to the source, where a ray meets its plane in the direction `ray(i)`.
    ///
    /// # Errors
    /// As [`Self::profile`].
    pub fn convergences(&self, ray: impl Fn(usize) -> [f64; 2]) -> Result<Vec<f64>> {
        let u = |i: usize| {
            let [x, y] = ray(i);
            let (t, r_s) = ([self.theta_x_arcsec[i] - x, self.theta_y_arcsec[i] - y], self.r_s_arcsec[i]);
            let r_s = resolved_scale_radius(r_s);
            ((t[0] * t[0] + t[1] * t[1]) / (r_s * r_s)).max(nfw_radial::U_FLOOR)
        };
        let mut kappa: Vec<f64> = (0..self.len()).map(u).collect();
        nfw_radial::convergences(&mut kappa);
        for (i, kappa) in kappa.iter_mut().enumerate() {
            if self.truncation(i).is_finite() {
                let [x, y] = ray(i);
                let [xx, _, yy] = self.profile(i)?.hessian(x, y);
                *kappa = 0.5 * (xx + yy);
            } else {
                *kappa *= Nfw::strength(resolved_scale_radius(self.r_s_arcsec[i]), self.alpha_rs_arcsec[i]);
            }
        }
        Ok(kappa)
    }

    /// The haloes for which `keep` says so, in the same order.
    pub fn select(&self, keep: &[bool]) -> Self {
        let places: Vec<usize> = (0..self.len()).filter(|i| keep.get(*i) == Some(&true)).collect();
        self.at(&places)
    }

    /// The haloes at these places, from 0, in that order; places that are not there are left out.
    pub fn at(&self, places: &[usize]) -> Self {
        let pick = |column: &Vec<f64>| picked(column, places);
        Self {
            background: self.background,
            z_source: self.z_source,
            z: pick(&self.z),
            chi_cmpc: pick(&self.chi_cmpc),
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
                .map(|(name, column)| (name.clone(), picked(column, places)))
                .collect(),
        }
    }
}

fn picked<T: Clone>(column: &[T], places: &[usize]) -> Vec<T> {
    places.iter().filter_map(|place| column.get(*place).cloned()).collect()
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
    fn columns_of_unequal_length_are_refused() {
        for (lengths, column, row) in [([2, 2, 1, 2], "r_s_arcsec", 1), ([2, 3, 3, 3], "z", 2)] {
            let of = |i: usize| vec![1.0; lengths[i]];
            let masses = HaloMasses::Angles { r_s_arcsec: of(2), alpha_rs_arcsec: of(3) };
            let built = HaloCatalogue::new(1.5, &Background::paper(), of(0), [of(1), of(1)], masses);
            let fault = built.unwrap_err();
            assert_eq!((fault.column, fault.row, fault.value), (column, row, None));
            let wanted = format!("{column} of halo {} is a missing value, but must be", row + 1);
            assert!(Error::from(fault).to_string().starts_with(&wanted), "{wanted}");
        }
    }

    #[test]
    fn selection_keeps_order_and_all_columns() {
        let mut haloes = build(0.3, 2.0, 0.2).unwrap();
        haloes.extra.push(("id".into(), vec![7.0, 8.0]));
        let turned = haloes.at(&[1, 0, 1]);
        assert_eq!(
            (turned.z.as_slice(), turned.extra[0].1.as_slice()),
            ([0.3, 0.4, 0.3].as_slice(), [8.0, 7.0, 8.0].as_slice())
        );
        let one = haloes.select(&[false, true]);
        assert_eq!((one.len(), one.z[0], one.r_s_arcsec[0], one.extra[0].1[0]), (1, 0.3, 2.0, 8.0));
    }
}
