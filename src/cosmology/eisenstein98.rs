//! Eisenstein & Hu 1998 matter transfer function, with acoustic oscillations and without baryons' wiggles.

use super::structure_parameters::StructureParameters;

/// Fitting formulae of Eisenstein & Hu 1998 (ApJ 496, 605); equation numbers below are theirs.
///
/// A few per cent from Boltzmann codes for 1e-4 < k < 100 Mpc⁻¹, Ωb > 0, no massive neutrinos.
/// Wavenumbers are comoving Mpc⁻¹.
#[derive(Debug, Clone, Copy)]
pub struct Eisenstein98 {
    omega_m_h2: f64,
    baryon_fraction: f64,
    theta_squared: f64,
    k_equality: f64,
    k_silk: f64,
    sound_horizon_mpc: f64,
    alpha_c: f64,
    beta_c: f64,
    alpha_b: f64,
    beta_b: f64,
    beta_node: f64,
    sound_horizon_fit_mpc: f64,
    alpha_gamma: f64,
}

impl Eisenstein98 {
    /// Coefficients for one set of (already validated) parameters.
    pub fn new(parameters: &StructureParameters) -> Self {
        let h = parameters.h0_km_s_mpc / 100.0;
        let om = parameters.omega_m * h * h;
        let ob = parameters.omega_b * h * h;
        let baryon_fraction = parameters.omega_b / parameters.omega_m;
        let theta_squared = (parameters.t_cmb_k / 2.7).powi(2);
        let theta_fourth = theta_squared * theta_squared;

        // Eqs. 2–4: equality and drag epoch.
        let z_equality = 2.5e4 * om / theta_fourth;
        let k_equality = 7.46e-2 * om / theta_squared;
        let b1 = 0.313 * om.powf(-0.419) * (1.0 + 0.607 * om.powf(0.674));
        let b2 = 0.238 * om.powf(0.223);
        let z_drag = 1291.0 * om.powf(0.251) / (1.0 + 0.659 * om.powf(0.828)) * (1.0 + b1 * ob.powf(b2));

        // Eqs. 5–7: baryon-to-photon momentum ratio, sound horizon, Silk damping.
        let momentum_ratio = |z: f64| 31.5 * ob / theta_fourth * (1000.0 / z);
        let (r_drag, r_equality) = (momentum_ratio(z_drag), momentum_ratio(z_equality));
        let sound_horizon_mpc = 2.0 / (3.0 * k_equality)
            * (6.0 / r_equality).sqrt()
            * (((1.0 + r_drag).sqrt() + (r_drag + r_equality).sqrt()) / (1.0 + r_equality.sqrt())).ln();
        let k_silk = 1.6 * ob.powf(0.52) * om.powf(0.73) * (1.0 + (10.4 * om).powf(-0.95));

        // Eqs. 11–12: suppression and shift of the cold dark matter.
        let a1 = (46.9 * om).powf(0.670) * (1.0 + (32.1 * om).powf(-0.532));
        let a2 = (12.0 * om).powf(0.424) * (1.0 + (45.0 * om).powf(-0.582));
        let alpha_c = a1.powf(-baryon_fraction) * a2.powf(-baryon_fraction.powi(3));
        let c1 = 0.944 / (1.0 + (458.0 * om).powf(-0.708));
        let c2 = (0.395 * om).powf(-0.0266);
        let beta_c = 1.0 / (1.0 + c1 * ((1.0 - baryon_fraction).powf(c2) - 1.0));

        // Eqs. 14–15, 23–24: the baryons.
        let y = (1.0 + z_equality) / (1.0 + z_drag);
        let root = (1.0 + y).sqrt();
        let g = y * (-6.0 * root + (2.0 + 3.0 * y) * ((root + 1.0) / (root - 1.0)).ln());
        let alpha_b = 2.07 * k_equality * sound_horizon_mpc * (1.0 + r_drag).powf(-0.75) * g;
        let beta_node = 8.41 * om.powf(0.435);
        let beta_b =
            0.5 + baryon_fraction + (3.0 - 2.0 * baryon_fraction) * ((17.2 * om).powi(2) + 1.0).sqrt();

        // Eqs. 26 and 31: the shape without oscillations.
        let sound_horizon_fit_mpc = 44.5 * (9.83 / om).ln() / (1.0 + 10.0 * ob.powf(0.75)).sqrt();
        let alpha_gamma = 1.0 - 0.328 * (431.0 * om).ln() * baryon_fraction
            + 0.38 * (22.3 * om).ln() * baryon_fraction.powi(2);

        Self {
            omega_m_h2: om,
            baryon_fraction,
            theta_squared,
            k_equality,
            k_silk,
            sound_horizon_mpc,
            alpha_c,
            beta_c,
            alpha_b,
            beta_b,
            beta_node,
            sound_horizon_fit_mpc,
            alpha_gamma,
        }
    }

    /// Full transfer function T(k), with acoustic oscillations (eqs. 16–24); 1 as k → 0.
    pub fn transfer(&self, k_per_mpc: f64) -> f64 {
        let ks = k_per_mpc * self.sound_horizon_mpc;

        // Eqs. 17–18: cold dark matter, interpolated across the sound horizon.
        let f = 1.0 / (1.0 + (ks / 5.4).powi(4));
        let cold = f * self.pressureless(k_per_mpc, 1.0, self.beta_c)
            + (1.0 - f) * self.pressureless(k_per_mpc, self.alpha_c, self.beta_c);

        // Eqs. 21–22: baryons, with the phase shift of the nodes.
        let s_tilde = self.sound_horizon_mpc / (1.0 + (self.beta_node / ks).powi(3)).cbrt();
        let silk = (-(k_per_mpc / self.k_silk).powf(1.4)).exp();
        let baryons = (self.pressureless(k_per_mpc, 1.0, 1.0) / (1.0 + (ks / 5.2).powi(2))
            + self.alpha_b / (1.0 + (self.beta_b / ks).powi(3)) * silk)
            * spherical_bessel_0(k_per_mpc * s_tilde);

        self.baryon_fraction * baryons + (1.0 - self.baryon_fraction) * cold
    }

    /// T̃₀(k, α, β) of eqs. 10 and 19–20.
    fn pressureless(&self, k_per_mpc: f64, alpha: f64, beta: f64) -> f64 {
        let q = k_per_mpc / (13.41 * self.k_equality);
        let c = 14.2 / alpha + 386.0 / (1.0 + 69.9 * q.powf(1.08));
        let l = (std::f64::consts::E + 1.8 * beta * q).ln();
        l / (l + c * q * q)
    }

    /// Transfer function of the same shape without oscillations, T₀(q_eff) (eqs. 26–31).
    pub fn smooth_transfer(&self, k_per_mpc: f64) -> f64 {
        let (q, _) = self.effective_q(k_per_mpc);
        let l = (2.0 * std::f64::consts::E + 1.8 * q).ln();
        let c = 14.2 + 731.0 / (1.0 + 62.5 * q);
        l / (l + c * q * q)
    }

    /// dlnT₀/dlnk of [`Self::smooth_transfer`], analytically.
    pub fn smooth_transfer_slope(&self, k_per_mpc: f64) -> f64 {
        let (q, dlnq_dlnk) = self.effective_q(k_per_mpc);
        let argument = 2.0 * std::f64::consts::E + 1.8 * q;
        let l = argument.ln();
        let c = 14.2 + 731.0 / (1.0 + 62.5 * q);
        let dlnl_dlnq = 1.8 * q / (argument * l);
        let dlnc_dlnq = -731.0 * 62.5 * q / ((1.0 + 62.5 * q).powi(2) * c);
        let small_scale_share = c * q * q / (l + c * q * q);
        dlnq_dlnk * small_scale_share * (dlnl_dlnq - dlnc_dlnq - 2.0)
    }

    /// q_eff = k Θ² / Γ_eff (eqs. 28 and 30) and its logarithmic slope.
    fn effective_q(&self, k_per_mpc: f64) -> (f64, f64) {
        let x4 = (0.43 * k_per_mpc * self.sound_horizon_fit_mpc).powi(4);
        let gamma_ratio = self.alpha_gamma + (1.0 - self.alpha_gamma) / (1.0 + x4);
        let dln_gamma_dlnk = -4.0 * x4 * (1.0 - self.alpha_gamma) / ((1.0 + x4).powi(2) * gamma_ratio);
        let q = k_per_mpc * self.theta_squared / (self.omega_m_h2 * gamma_ratio);
        (q, 1.0 - dln_gamma_dlnk)
    }
}

/// j₀(x) = sin x / x.
fn spherical_bessel_0(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planck18() -> Eisenstein98 {
        Eisenstein98::new(&StructureParameters::planck18())
    }

    #[test]
    fn both_transfer_functions_start_at_one_and_fall() {
        let shape = planck18();
        assert!((shape.transfer(1e-6) - 1.0).abs() < 1e-4);
        assert!((shape.smooth_transfer(1e-6) - 1.0).abs() < 1e-4);
        for k in [1.0, 10.0, 100.0] {
            assert!(shape.transfer(2.0 * k) < 0.5 * shape.transfer(k));
        }
    }

    #[test]
    fn the_sound_horizon_is_that_of_planck() {
        // EH98 eq. 6 lies within 3% of the exact drag horizon, 147 Mpc (Planck 2018).
        assert!((planck18().sound_horizon_mpc / 147.1 - 1.0).abs() < 0.03);
        assert!((planck18().sound_horizon_fit_mpc / 147.1 - 1.0).abs() < 0.03);
    }

    #[test]
    fn oscillations_swing_about_the_smooth_curve() {
        let shape = planck18();
        let ratios: Vec<f64> = (0..400)
            .map(|i| 0.02 * 1.01f64.powi(i))
            .map(|k| shape.transfer(k) / shape.smooth_transfer(k) - 1.0)
            .collect();
        let crossings = ratios.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
        assert!(crossings >= 5, "{crossings} crossings");
        assert!(ratios.iter().all(|ratio| ratio.abs() < 0.08));
    }

    #[test]
    fn the_analytic_slope_is_the_derivative() {
        let shape = planck18();
        for k in [1e-4, 3e-3, 0.02, 0.1, 1.0, 50.0, 1e4] {
            let step = 1e-4_f64;
            let difference = (shape.smooth_transfer(k * step.exp()).ln()
                - shape.smooth_transfer(k * (-step).exp()).ln())
                / (2.0 * step);
            let slope = shape.smooth_transfer_slope(k);
            assert!((slope - difference).abs() < 1e-7, "k = {k}: {slope} {difference}");
        }
    }
}
