//! Deflections of many points at once, and their response to the parameters of a lens.

use super::{MOST_PARAMETERS, MassModel};
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};

/// Responses of a lens at many points, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Responses {
    /// (α_x, α_y) in arcsec.
    pub deflection_arcsec: [Vec<f64>; 2],
    /// (ψ_xx, ψ_xy, ψ_yy).
    pub hessian: [Vec<f64>; 3],
    /// ∂(α_x, α_y)/∂p for each of the parameters of the lens.
    pub by_parameter: Vec<[Vec<f64>; 2]>,
}

impl Responses {
    /// Columns of `n` points for a lens of `parameters` parameters, from what is allocated already.
    fn resize(&mut self, n: usize, parameters: usize) {
        self.by_parameter.resize_with(parameters, Default::default);
        let columns = self.deflection_arcsec.iter_mut().chain(&mut self.hessian);
        columns.chain(self.by_parameter.iter_mut().flatten()).for_each(|column| column.resize(n, 0.0));
    }
}

/// Deflections (α_x, α_y) of `lens` at the points (x, y), lanes at a time, written over `out`.
pub fn deflections(lens: &MassModel, x_arcsec: &[f64], y_arcsec: &[f64], out: &mut [Vec<f64>; 2]) {
    out.iter_mut().for_each(|column| column.resize(x_arcsec.len(), 0.0));
    for start in (0..x_arcsec.len()).step_by(LANES) {
        let alpha = lens.deflection_lanes(Lanes::load(x_arcsec, start), Lanes::load(y_arcsec, start));
        alpha.re.store(&mut out[0], start);
        alpha.im.store(&mut out[1], start);
    }
}

/// Deflection, Hessian and parameter derivatives of `lens` at the points (x, y), lanes at a time, written over `out`.
pub fn responses(lens: &MassModel, x_arcsec: &[f64], y_arcsec: &[f64], out: &mut Responses) {
    out.resize(x_arcsec.len(), lens.parameters().len());
    let mut by_parameter = [Cx::<Lanes>::zero(); MOST_PARAMETERS];
    let by_parameter = &mut by_parameter[..out.by_parameter.len()];
    for start in (0..x_arcsec.len()).step_by(LANES) {
        let (x, y) = (Lanes::load(x_arcsec, start), Lanes::load(y_arcsec, start));
        let response = lens.response_lanes(x, y, by_parameter);
        response.deflection.re.store(&mut out.deflection_arcsec[0], start);
        response.deflection.im.store(&mut out.deflection_arcsec[1], start);
        for (column, h) in out.hessian.iter_mut().zip(response.hessian()) {
            h.store(column, start);
        }
        for (column, own) in out.by_parameter.iter_mut().zip(by_parameter.iter()) {
            own.re.store(&mut column[0], start);
            own.im.store(&mut column[1], start);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::{MASSES, MassProfile};

    #[test]
    fn many_points_at_once_have_the_bits_of_one_by_one() {
        let x: Vec<f64> = (0..41).map(|i| -1.0 + 0.05 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|x| 0.3 - 0.7 * x * x).collect();
        // Radii of 0.02 and 0.9 lie below, at and above the seams of the profiles that have some.
        for (description, radius) in MASSES.iter().flat_map(|d| [(d, 0.02), (d, 0.9), (d, 2.0)]) {
            let value = |name: &str| match name {
                "gamma" => 2.3,
                "n_sersic" => 3.7 - radius,
                "theta_E" | "Rs" | "R_sersic" => radius,
                "e1" | "gamma1" | "center_y" => 0.1,
                _ => -0.2,
            };
            let value = |name: &str| if name == "r_trunc" { 1.3 } else { value(name) };
            let lens =
                description.build(&description.parameters.iter().map(|p| value(p.name)).collect::<Vec<_>>());
            let lens = lens.unwrap();
            let (mut alpha, mut all) = ([vec![], vec![]], Responses::default());
            deflections(&lens, &x, &y, &mut alpha);
            responses(&lens, &x, &y, &mut all);
            assert_eq!(alpha, all.deflection_arcsec);
            for i in 0..x.len() {
                assert_eq!([alpha[0][i], alpha[1][i]], lens.deflection(x[i], y[i]));
                let mut own = vec![Cx::new(0.0, 0.0); lens.parameters().len()];
                let response = lens.respond(x[i], y[i], &mut own);
                for (column, own) in all.hessian.iter().zip(response.hessian()) {
                    assert_eq!(column[i], own);
                }
                for (column, own) in all.by_parameter.iter().zip(own) {
                    assert_eq!([column[0][i], column[1][i]], [own.re, own.im]);
                }
            }
        }
    }
}
