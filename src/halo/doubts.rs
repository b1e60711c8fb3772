//! What of a catalogue of haloes looks as if something else were meant.

use super::catalogue::HaloCatalogue;

/// Doubts in words about a catalogue of a user's: all masses below 10⁴ solar masses, concentrations c200c outside 0.5 to 300,
/// positions mostly over a degree from the axis or all in one place away from it.
pub fn doubts(haloes: &HaloCatalogue) -> Vec<String> {
    let masses = mass_doubt(haloes.m200c_msun.iter().flatten());
    let concentrations = haloes.c200c.as_deref().and_then(concentration_doubt);
    let positions = position_doubt(&haloes.theta_x_arcsec, &haloes.theta_y_arcsec);
    [masses, concentrations, positions].into_iter().flatten().collect()
}

/// Masses that look like logarithms, or like multiples of 10¹⁰ solar masses.
pub fn mass_doubt<'a>(m200c_msun: impl Iterator<Item = &'a f64>) -> Option<String> {
    /// A microhalo of cold dark matter has 10⁻⁶ solar masses; one that is seen in a catalogue has far more than this.
    const SMALLEST_MSUN: f64 = 1e4;
    let largest = m200c_msun.copied().fold(0.0, f64::max);
    (largest > 0.0 && largest < SMALLEST_MSUN).then(|| {
        format!(
            "no m200c_msun is above {largest:.4} solar masses; are these logarithms, or units of 1e10 Msun?"
        )
    })
}

fn concentration_doubt(c200c: &[f64]) -> Option<String> {
    /// Relations and simulations give 2 to 60 at all masses and redshifts, with their scatter.
    const USUAL: std::ops::RangeInclusive<f64> = 0.5..=300.0;
    let mut unusual = c200c.iter().filter(|c| !USUAL.contains(c));
    let first = unusual.next()?;
    Some(format!(
        "{} of {} c200c are below {} or above {}, {first} the first; is it the concentration r200c/r_s?",
        1 + unusual.count(),
        c200c.len(),
        USUAL.start(),
        USUAL.end()
    ))
}

/// Positions that are mostly far from the axis, or all in one place away from it; nothing is said of a few.
fn position_doubt(theta_x_arcsec: &[f64], theta_y_arcsec: &[f64]) -> Option<String> {
    const FEW: usize = 10;
    /// Farther out lie only the nearest haloes of a cylinder.
    const FAR_ARCSEC: f64 = 3600.0;
    /// Distance of all from the axis in units of their scatter.
    const BESIDE: f64 = 10.0;
    let n = theta_x_arcsec.len();
    if n <= FEW {
        return None;
    }
    let positions = || theta_x_arcsec.iter().zip(theta_y_arcsec);
    let mut distances: Vec<f64> = positions().map(|(x, y)| x.hypot(*y)).collect();
    let median = *distances.select_nth_unstable_by(n / 2, f64::total_cmp).1;
    let mean = [theta_x_arcsec, theta_y_arcsec].map(|theta| theta.iter().sum::<f64>() / n as f64);
    let squares: f64 = positions().map(|(x, y)| (x - mean[0]).powi(2) + (y - mean[1]).powi(2)).sum();
    let scatter = (squares / n as f64).sqrt();
    let told = match median {
        far if far > FAR_ARCSEC => {
            format!("half of the positions lie {:.3} degrees from the axis or more", far / 3600.0)
        }
        _ if mean[0].hypot(mean[1]) > BESIDE * scatter => {
            let [x, y] = mean;
            format!("all positions lie about ({x:.3}, {y:.3}) arcsec, scattered by {scatter:.3} arcsec")
        }
        _ => return None,
    };
    Some(format!("{told}; are they RA and Dec? offsets from the line of sight are wanted"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_of_masses_are_doubted_and_the_smallest_masses_are_not() {
        assert!(mass_doubt([12.5, 13.0].iter()).unwrap().contains("above 13.0000 solar masses"));
        assert_eq!(mass_doubt([1e5, 1.0].iter()), None);
        assert_eq!(mass_doubt([].iter()), None);
    }

    #[test]
    fn concentrations_of_no_halo_are_counted() {
        let doubt = concentration_doubt(&[8.0, 1e4, 0.01]).unwrap();
        assert!(doubt.starts_with("2 of 3 c200c") && doubt.contains("10000 the first"), "{doubt}");
        assert_eq!(concentration_doubt(&[0.9, 60.0]), None);
    }

    #[test]
    fn right_ascensions_are_no_offsets_in_whichever_unit() {
        let spread = |centre: f64, width: f64| -> Vec<f64> {
            (0..20).map(|i| centre + width * (f64::from(i) / 19.0 - 0.5)).collect()
        };
        let of = |x: &[f64], y: &[f64]| position_doubt(x, y);
        let degrees = of(&spread(150.1, 0.02), &spread(2.2, 0.02)).unwrap();
        assert!(degrees.contains("about (150.100, 2.200) arcsec, scattered by 0.009"), "{degrees}");
        let in_arcsec = of(&spread(540_360.0, 72.0), &spread(7920.0, 72.0)).unwrap();
        assert!(
            in_arcsec.contains("lie 150.1") && in_arcsec.contains("degrees from the axis or more"),
            "{in_arcsec}"
        );
        assert_eq!(of(&spread(0.0, 120.0), &spread(30.0, 120.0)), None);
        assert_eq!(of(&[5e5], &[3.0]), None);
    }
}
