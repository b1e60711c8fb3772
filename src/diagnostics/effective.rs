//! The tidal model of a halo-filled line of sight: od, os, ds and LOS tensors of the axis ray.

use super::distortion::Distortion;
use crate::error::{Error, Result};
use crate::mapping::multiplane::{LineOfSight, NearAxis};
use crate::mapping::tidal::{Flexion, FlexionModel, LineOfSightModel, Tidal, los_jacobian};

/// What the tidal models of a line of sight predict on its axis, main lens excluded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectiveLineOfSight {
    /// Observer to lens.
    pub od: Distortion,
    /// Observer to source.
    pub os: Distortion,
    /// Lens to source.
    pub ds: Distortion,
    /// A_LOS = A_odᵀ A_ds⁻¹ A_os (the paper omits the transpose).
    pub los: Tidal,
    /// First order: γ_od + γ_os − γ_ds, same for κ; ω_os − ω_od − ω_ds.
    pub los_linear: Tidal,
    /// Flexion lens to source of the deflection squared, F_1ds = f·F_ds, f = χ_s/(χ_s − χ_d).
    pub flexion_1ds: Flexion,
    /// Flexion lens to source of position times deflection.
    pub flexion_2ds: Flexion,
}

impl EffectiveLineOfSight {
    /// Traces the axis ray of the haloes alone, lens plane at `z_lens`.
    ///
    /// # Errors
    /// When the lens is not between observer and source, or A_ds cannot be inverted.
    pub fn of(line_of_sight: &LineOfSight, z_lens: f64) -> Result<Self> {
        let near = line_of_sight.near_axis(z_lens, [[0.0; 2]; 2])?;
        Self::of_rays(&near, line_of_sight.slope_per_reduced_deflection(z_lens)?)
    }

    /// From the traced axis ray, `f` = χ_s/(χ_s − χ_d).
    ///
    /// # Errors
    /// When A_ds cannot be inverted.
    pub fn of_rays(near: &NearAxis, f: f64) -> Result<Self> {
        let [od, os, ds] = [&near.od, &near.os, &near.ds]
            .map(|ray| Distortion::of_ray(&ray.jacobian, &ray.second_per_arcsec));
        let los = los_jacobian(&od.tidal, &os.tidal, &ds.tidal)
            .ok_or_else(|| Error::out_of_range("A_ds of the line of sight", "singular", "invertible"))?;
        let mixed = near.mixed_per_arcsec.map(|b| f * b);
        let two = Distortion::of_ray(&[1.0, 0.0, 0.0, 1.0], &mixed);
        Ok(Self {
            flexion_1ds: Flexion { f: ds.f_per_arcsec * f, g: ds.g_per_arcsec * f },
            flexion_2ds: two.flexion(),
            od,
            os,
            ds,
            los: Tidal::of_jacobian(&los),
            los_linear: linear(&od.tidal, &os.tidal, &ds.tidal),
        })
    }

    /// The full tidal model that stands for this line of sight, positions measured from the axis ray.
    pub fn tidal_model(&self) -> LineOfSightModel {
        LineOfSightModel::Full { od: self.od.tidal, os: self.os.tidal, ds: self.ds.tidal }
    }

    /// The flexion model that stands for this line of sight, positions measured from the axis ray.
    pub fn flexion_model(&self) -> LineOfSightModel {
        LineOfSightModel::Flexion(FlexionModel {
            od: self.od.tidal,
            os: self.os.tidal,
            ds: self.ds.tidal,
            flexion_od: self.od.flexion(),
            flexion_os: self.os.flexion(),
            flexion_1ds: self.flexion_1ds,
            flexion_2ds: self.flexion_2ds,
        })
    }
}

fn linear(od: &Tidal, os: &Tidal, ds: &Tidal) -> Tidal {
    Tidal {
        kappa: od.kappa + os.kappa - ds.kappa,
        gamma: od.gamma + os.gamma - ds.gamma,
        // The transpose of A_od turns its rotation round.
        omega: os.omega - od.omega - ds.omega,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    #[test]
    fn linear_form_is_the_first_order_of_the_exact_one() {
        let tidal = |s: f64, k: f64, g: (f64, f64), w: f64| Tidal {
            kappa: s * k,
            gamma: Complex::new(g.0, g.1) * s,
            omega: s * w,
        };
        for s in [1e-3, 1e-4] {
            let (od, os, ds) = (
                tidal(s, 0.3, (0.5, -0.2), 0.4),
                tidal(s, -0.1, (0.3, 0.7), -0.2),
                tidal(s, 0.2, (-0.6, 0.1), 0.9),
            );
            let exact = Tidal::of_jacobian(&los_jacobian(&od, &os, &ds).unwrap());
            let first = linear(&od, &os, &ds);
            let error = (exact.kappa - first.kappa)
                .abs()
                .max((exact.gamma - first.gamma).norm())
                .max((exact.omega - first.omega).abs());
            assert!(error < 5.0 * s * s, "{error:e}");
        }
    }
}
