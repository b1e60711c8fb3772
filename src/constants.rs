//! Sourced physical constants and unit conversions: value, unit, source, year.

/// Speed of light, km/s (exact; SI 2019).
pub const SPEED_OF_LIGHT_KM_S: f64 = 299_792.458;

/// One parsec in metres, 648000/π au (exact; IAU 2015 Resolution B2, au of IAU 2012).
pub const PARSEC_M: f64 = 648_000.0 / std::f64::consts::PI * 149_597_870_700.0;

/// Nominal solar mass parameter G·Msun, m³/s² (IAU 2015 Resolution B3).
///
/// G and Msun are never used apart: the product is known to 1e-10, G alone to 2e-5.
pub const GM_SUN_M3_S2: f64 = 1.327_124_4e20;

/// G·Msun/c² in Mpc, one number from [`GM_SUN_M3_S2`] and [`PARSEC_M`].
pub const GM_SUN_OVER_C2_MPC: f64 =
    GM_SUN_M3_S2 / (SPEED_OF_LIGHT_KM_S * 1e3 * SPEED_OF_LIGHT_KM_S * 1e3) / (PARSEC_M * 1e6);

/// Radians in one arcsecond, π/648000.
pub const ARCSEC_RAD: f64 = std::f64::consts::PI / 648_000.0;

/// Seconds in one day.
pub const DAY_S: f64 = 86_400.0;

/// Light-travel time of one megaparsec in days.
pub const MPC_OVER_C_DAYS: f64 = PARSEC_M * 1e6 / (SPEED_OF_LIGHT_KM_S * 1e3) / DAY_S;

/// Critical density today divided by H0², Msun/Mpc³/(km/s/Mpc)²: 3/(8πG).
pub const CRITICAL_DENSITY_MSUN_MPC3_PER_H0_SQUARED: f64 =
    3.0 * 1e6 * PARSEC_M * 1e6 / (8.0 * std::f64::consts::PI * GM_SUN_M3_S2);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_density_is_the_textbook_value() {
        // 2.775e11 h² Msun/Mpc³ (e.g. Peebles 1993), here for h = 1.
        let rho = CRITICAL_DENSITY_MSUN_MPC3_PER_H0_SQUARED * 100.0 * 100.0;
        assert!((rho / 2.775_36e11 - 1.0).abs() < 1e-5, "{rho:e}");
    }

    #[test]
    fn gravitational_radius_of_the_sun_is_1477_metres() {
        let metres = GM_SUN_OVER_C2_MPC * PARSEC_M * 1e6;
        assert!((metres - 1_476.625).abs() < 1e-3, "{metres}");
    }
}
