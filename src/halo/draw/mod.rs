//! Two draws of the same Poisson process: all haloes and then the cut, or only those that pass it.

mod brute_force;
mod direct;

pub use brute_force::draw_brute_force;
pub use direct::draw_direct;

/// Positions and masses of drawn haloes, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DrawnHaloes {
    /// Haloes drawn before the cut (for a direct draw: the haloes kept).
    pub number_drawn: u64,
    /// Comoving distance, Mpc.
    pub chi_cmpc: Vec<f64>,
    /// Comoving transverse position right of the axis, Mpc.
    pub x_cmpc: Vec<f64>,
    /// Comoving transverse position above the axis, Mpc.
    pub y_cmpc: Vec<f64>,
    /// M200c, Msun.
    pub m200c_msun: Vec<f64>,
}

impl DrawnHaloes {
    fn push(&mut self, chi: f64, radius_squared: f64, turn: f64, mass: f64) {
        let (sin, cos) = (2.0 * std::f64::consts::PI * turn).sin_cos();
        let radius = radius_squared.sqrt();
        self.chi_cmpc.push(chi);
        self.x_cmpc.push(radius * cos);
        self.y_cmpc.push(radius * sin);
        self.m200c_msun.push(mass);
    }

    /// Joins the slabs in order.
    fn concatenate(slabs: Vec<Self>) -> Self {
        slabs.into_iter().fold(Self::default(), |mut all, slab| {
            all.number_drawn += slab.number_drawn;
            all.chi_cmpc.extend(slab.chi_cmpc);
            all.x_cmpc.extend(slab.x_cmpc);
            all.y_cmpc.extend(slab.y_cmpc);
            all.m200c_msun.extend(slab.m200c_msun);
            all
        })
    }
}

/// A Poisson number of the given mean; zero for a mean of zero.
fn poisson(rng: &mut impl rand::Rng, mean: f64) -> u64 {
    use rand_distr::Distribution;
    rand_distr::Poisson::new(mean).map_or(0, |p| p.sample(rng) as u64)
}
