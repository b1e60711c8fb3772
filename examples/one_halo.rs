//! What one halo does to rays near it: positions, convergence, shear and flexion.
//!
//! cargo run --release --example one_halo

use haloray::cosmology::Background;
use haloray::diagnostics::Distortion;
use haloray::halo::{HaloCatalogue, HaloMasses};
use haloray::mapping::multiplane::{LineOfSight, Sheets};
use haloray::mapping::{Mapping, Order};

fn main() -> haloray::Result<()> {
    let background = Background::paper();
    let masses = HaloMasses::Physical { m200c_msun: vec![1e10], c200c: vec![12.0] };
    let haloes = HaloCatalogue::new(1.5, &background, vec![0.5], [vec![0.6], vec![0.2]], masses)?;
    let sight = LineOfSight::new(&haloes, &Sheets::None)?;

    let theta: Vec<[f64; 2]> = (0..6).map(|i| [0.4 * f64::from(i) - 1.0, 0.0]).collect();
    let rays = sight.observer_to_source().map(&theta, Order::SecondDerivatives);
    println!("theta_x   beta_x     kappa      |gamma|    |F| /arcsec  |G| /arcsec");
    for (i, d) in Distortion::of_bundle(&rays).iter().enumerate() {
        println!(
            "{:+.2}    {:+.6}  {:.3e}  {:.3e}  {:.3e}    {:.3e}",
            theta[i][0],
            rays.beta_arcsec[i][0],
            d.tidal.kappa,
            d.tidal.gamma.norm(),
            d.f_per_arcsec.norm(),
            d.g_per_arcsec.norm()
        );
    }
    Ok(())
}
