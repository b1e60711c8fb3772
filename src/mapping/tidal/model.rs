//! Which tidal model stands for the line of sight.

use nalgebra::Matrix2;

use super::flexion::FlexionModel;
use super::tensor::Tidal;

/// The models of the line of sight around a main lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineOfSightModel {
    /// β = A_os θ − A_ds α(A_od θ).
    Full {
        /// Observer to lens.
        od: Tidal,
        /// Observer to source.
        os: Tidal,
        /// Lens to source.
        ds: Tidal,
    },
    /// β̃ = A_LOS θ − A_odᵀ α(A_od θ); β̃ = A_odᵀ A_ds⁻¹ β of the full model.
    Minimal {
        /// Observer to lens.
        od: Tidal,
        /// A_odᵀ A_ds⁻¹ A_os.
        los: Tidal,
    },
    /// Beyond the tidal regime, to first order in flexion.
    Flexion(FlexionModel),
}

impl LineOfSightModel {
    /// Nothing on the line of sight: the single-plane lens.
    pub const EMPTY: Self = Self::Full { od: Tidal::NONE, os: Tidal::NONE, ds: Tidal::NONE };

    /// The minimal model of a full one, A_LOS = A_odᵀ A_ds⁻¹ A_os exactly, and the flexion-minimal model of a flexion
    /// model, to first order.
    ///
    /// `None` when A_ds is singular.
    pub fn minimal(&self) -> Option<Self> {
        match self {
            Self::Full { od, os, ds } => {
                let los = Tidal::of_jacobian(&los_jacobian(od, os, ds)?);
                Some(Self::Minimal { od: *od, los })
            }
            Self::Minimal { .. } => Some(*self),
            Self::Flexion(model) => Some(Self::Flexion(model.to_minimal())),
        }
    }
}

/// A_odᵀ A_ds⁻¹ A_os, symmetric for the tensors of any real line of sight; `None` when A_ds is singular.
pub(crate) fn los_jacobian(od: &Tidal, os: &Tidal, ds: &Tidal) -> Option<Matrix2<f64>> {
    Some(od.jacobian().transpose() * ds.jacobian().try_inverse()? * os.jacobian())
}
