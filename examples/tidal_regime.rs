//! How often does the line of sight leave the tidal regime? Δ_tot of twenty sightlines, with and without the
//! haloes of Δ_h ≥ 0.1.
//!
//! cargo run --release --example tidal_regime

use haloray::config::Preset;
use haloray::diagnostics::{HaloTidal, total_variation};
use haloray::mapping::multiplane::{LineOfSight, Sheets};
use haloray::monitor::Silent;
use haloray::pipeline::populate;

fn main() -> haloray::Result<()> {
    let config = Preset::Paper.config()?;
    let (theta_e, threshold) = (config.diagnostics.theta_e_arcsec, config.diagnostics.delta_threshold);
    println!("sightline  haloes  beyond tidal  Delta_tot  without them");
    let mut all = Vec::new();
    for sightline in 0..20 {
        let haloes = populate(&config, None, sightline, &Silent)?.catalogue;
        let tidal = haloes.select(&HaloTidal::of(&haloes, theta_e)?.within(threshold));
        let delta = |haloes| -> haloray::Result<f64> {
            let sight = LineOfSight::new(haloes, &Sheets::OnAxis)?;
            Ok(total_variation(&sight.observer_to_source(), theta_e).delta)
        };
        let (with, without) = (delta(&haloes)?, delta(&tidal)?);
        println!(
            "{sightline:>9}  {:>6}  {:>12}  {with:>9.3}  {without:>12.3}",
            haloes.len(),
            haloes.len() - tidal.len()
        );
        all.push(with);
    }
    all.sort_by(f64::total_cmp);
    println!("median Delta_tot {:.2} (the paper's one cone: 0.44)", all[all.len() / 2]);
    Ok(())
}
