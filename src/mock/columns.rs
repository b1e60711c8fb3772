//! The numbers of a mock system by name: for tables, and as the truth of a fit. Those of profiles are named by the registry.

use super::system::{MockSystem, Perturber};
use crate::profile::light::Sersic;
use crate::profile::mass::{Described, Nfw, SersicMass};
use crate::profile::registry::Parameter;

/// A number of a system: name of its column, unit, value.
pub type MockColumn = (String, Option<&'static str>, f64);

/// The first parameters of a profile, as many as are drawn, with their values.
struct Drawn<const N: usize>(&'static [Parameter], [f64; N]);

impl<const N: usize> Drawn<N> {
    /// As columns of a table: `Rs` of the halo is `halo_r_s_arcsec`, `center_x` of the source `source_x_arcsec`.
    fn columns(self, prefix: &str) -> impl Iterator<Item = MockColumn> {
        self.0.iter().zip(self.1).map(move |(Parameter { name, unit, .. }, value)| {
            let name = name.replace("Rs", "r_s").replace("_r_s", "_rs").replace("center_", "").to_lowercase();
            let end = if unit.is_empty() { String::new() } else { format!("_{unit}") };
            (format!("{prefix}_{name}{end}"), Some(*unit).filter(|unit| !unit.is_empty()), value)
        })
    }

    /// As parameters of a model.
    fn truths(self, prefix: &str) -> impl Iterator<Item = (String, f64)> {
        self.0
            .iter()
            .zip(self.1)
            .map(move |(parameter, value)| (format!("{prefix}.{}", parameter.name), value))
    }
}

/// A column that is no parameter of a profile; its unit is the end of its name.
fn column(name: &str, value: f64) -> MockColumn {
    let units = [("_arcsec", "arcsec"), ("_msun", "Msun"), ("_magnitude", "mag")];
    (name.into(), units.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| *unit), value)
}

impl MockSystem {
    fn stars(&self) -> Drawn<5> {
        let stars = &self.baryons;
        let [e1, e2] = stars.ellipticity;
        Drawn(SersicMass::PARAMETERS, [stars.k_eff, stars.radius_arcsec, stars.index, e1, e2])
    }

    fn lens_light(&self) -> Drawn<4> {
        let Drawn(_, [_, radius, index, e1, e2]) = self.stars();
        Drawn(&Sersic::PARAMETERS, [radius, index, e1, e2])
    }

    fn dark_halo(&self) -> Drawn<6> {
        let halo = &self.halo;
        let ([e1, e2], [x, y]) = (halo.ellipticity, halo.centre_arcsec);
        Drawn(Nfw::PARAMETERS, [halo.r_s_arcsec, halo.alpha_rs_arcsec, e1, e2, x, y])
    }

    fn source_light(&self) -> Drawn<6> {
        let source = &self.source;
        let ([e1, e2], [x, y]) = (source.ellipticity, source.centre_arcsec);
        Drawn(&Sersic::PARAMETERS, [source.radius_arcsec, source.index, e1, e2, x, y])
    }

    /// Every number but those of the perturbers.
    pub fn columns(&self) -> Vec<MockColumn> {
        let los = self.line_of_sight_distortion();
        let shears = [("od", self.gamma_od), ("os", self.gamma_os), ("ds", self.gamma_ds)];
        let shears = shears.into_iter().chain([("los", [los.gamma.re, los.gamma.im])]);
        let shears = shears.flat_map(|(place, [g1, g2])| {
            [column(&format!("gamma1_{place}"), g1), column(&format!("gamma2_{place}"), g2)]
        });
        let [x, y] = self.source.centre_arcsec;
        let mut columns = vec![
            column("number", self.number as f64),
            column("attempts", f64::from(self.attempts)),
            column("z_lens", self.z_lens),
            column("z_source", self.z_source),
            column("einstein_radius_arcsec", self.einstein_radius_arcsec),
            column("pixels", self.pixels as f64),
            column("baryon_mass_msun", self.baryons.mass_msun),
        ];
        columns.extend(self.stars().columns("baryon"));
        columns.extend([
            column("lens_light_magnitude", self.baryons.magnitude),
            column("halo_m200c_msun", self.halo.m200c_msun),
            column("halo_c200c", self.halo.c200c),
        ]);
        columns.extend(self.dark_halo().columns("halo").chain(shears));
        columns.extend([
            column("omega_los", los.omega),
            column("kappa_los", los.kappa),
            column("source_magnitude", self.source.magnitude),
        ]);
        columns.extend(self.source_light().columns("source"));
        columns.push(column("perturbers", self.perturbers.len() as f64));
        columns.push(column("source_offset_arcsec", x.hypot(y)));
        columns
    }

    /// What the parameters of the model `comprehensive` would be if it described the system exactly, by their names.
    pub fn truths(&self) -> Vec<(String, f64)> {
        let (od, los) = (self.gamma_od, self.line_of_sight_distortion());
        let sight = [
            ("gamma1_od", od[0]),
            ("gamma2_od", od[1]),
            ("gamma1_los", los.gamma.re),
            ("gamma2_los", los.gamma.im),
            ("omega_los", los.omega),
        ];
        let sight = sight.map(|(name, value)| (name.to_string(), value)).into_iter();
        let lens = self.stars().truths("lens").chain(self.dark_halo().truths("lens2"));
        let lights = self.source_light().truths("source").chain(self.lens_light().truths("lens_light"));
        sight.chain(lens).chain(lights).collect()
    }
}

impl Perturber {
    /// Its numbers; those of a perturber that a system does not have are zeros.
    pub fn columns(one: Option<&Self>, prefix: &str) -> Vec<MockColumn> {
        let values = one.map_or([0.0; 7], |p| {
            let ([e1, e2], [x, y]) = (p.ellipticity, p.centre_arcsec);
            [p.flux, p.radius_arcsec, p.index, e1, e2, x, y]
        });
        let [flux, light @ ..] = values;
        let flux = column(&format!("{prefix}_flux"), flux);
        [flux].into_iter().chain(Drawn(&Sersic::PARAMETERS, light).columns(prefix)).collect()
    }
}
