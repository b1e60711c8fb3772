//! The figures of this project, one file each: plain saved numbers in, a `Figure` out.

mod calibration;
mod corner;
mod curves;
mod cut;
mod cylinder;
mod ensemble;
mod grid;
mod histograms;
mod images;
mod maps;
mod mass_function;
mod mosaic;
mod profiles;
mod recovery;
mod tidal_residuals;
mod trace_plot;
mod validity;
mod which_shear;

pub use calibration::{RankHistogram, calibration};
pub(crate) use corner::{CornerParameter, CornerPosterior, corner};
pub(crate) use curves::{curves, overlay};
pub(crate) use cut::cut;
pub(crate) use cylinder::{CylinderData, cylinder};
pub(crate) use ensemble::{Distributions, cumulative, distributions, settling, smoothing};
pub use grid::GridData;
pub(crate) use histograms::histograms;
pub(crate) use images::{image_pair, images, reconstruction, source_plane};
pub(crate) use maps::{flexion_maps, tidal_maps};
pub(crate) use mass_function::{DrawnHaloes, mass_function};
pub use mosaic::{MosaicImage, mosaic};
pub(crate) use profiles::{ProfileCurve, profiles};
pub(crate) use recovery::{RecoveredPoint, RecoveryData, recovery, recovery_histograms, recovery_quality};
pub(crate) use tidal_residuals::{ModelResiduals, tidal_residuals};
pub(crate) use trace_plot::{TraceParameter, trace_plot};
pub(crate) use validity::{
    CoverageView, ExcessView, FailingCurve, FittedPoints, coverage, delay_ratios, excess, failing,
    fitted_shears, varying_haloes,
};
pub(crate) use which_shear::deviations;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Figure;

    const NAN: f64 = f64::NAN;

    /// Every figure of little or nothing that can be drawn; the grid must outlive what shows it.
    fn of(grid: GridData) -> Vec<Figure> {
        let values = grid.values;
        let rank = RankHistogram { label: "γ".into(), counts: values.into(), p_value: NAN, coverage: NAN };
        let drawn = DrawnHaloes { edges_msun: values, counts: values, volume_cmpc3: values };
        let parameter = CornerParameter { label: "a", unit: "", values: vec![Some(NAN), None] };
        let posterior = CornerPosterior { legend: "", draws: vec![values, &[NAN], &[1.0, 1.0]] };
        let residuals = || ModelResiduals {
            rays: grid,
            image: grid,
            chi_squared: values.into(),
            rms_arcsec: values.into(),
        };
        let cylinder_data = CylinderData {
            distance_cmpc: values,
            transverse_cmpc: values,
            delta: values,
            delta_threshold: 0.1,
            stride: 2,
            lens_distance_cmpc: NAN,
            source_distance_cmpc: NAN,
            redshift: values,
            redshift_distance_cmpc: values,
        };
        let trace = TraceParameter { label: "", chains: vec![values; 2], truth: None };
        vec![
            calibration(&[rank]),
            corner(&[parameter.clone(), parameter], &[posterior.clone(), posterior], &["truth", "ring"]),
            deviations(&[("axis".into(), values.into())]),
            corner(&[], &[], &[]),
            curves(&[], None, 2.0),
            cut(values, [values; 4], [values; 2]),
            cylinder(&cylinder_data),
            distributions(&[Distributions { label: "", is_log: true, sets: vec![("", values.into())] }]),
            cumulative(&[Distributions { label: "", is_log: true, sets: vec![("", values.into())] }]),
            settling("", &[("", vec![[NAN; 3]])]),
            smoothing(&[("", vec![[NAN; 3]])]),
            histograms([values; 3], values, 0.1),
            images([grid; 3], [grid; 3], NAN, 0.1),
            image_pair(grid, grid, NAN),
            reconstruction([grid; 3], NAN, NAN),
            source_plane(grid, NAN),
            tidal_maps([grid; 3], [0.0, NAN, 1.0], 0.0),
            flexion_maps([grid; 3], 0.0),
            mass_function("", values, values, Some(drawn)),
            mosaic(&[MosaicImage { image: grid, background_rms_e_per_s: NAN, name: "" }], 3),
            recovery(&[]),
            recovery_histograms(&[RecoveryData { model: "b".into(), points: vec![] }]),
            recovery_quality(&RecoveryData { model: "b".into(), points: vec![] }, &[([NAN; 2], "paper")]),
            tidal_residuals(&[residuals(), residuals()], 0.0),
            trace_plot(&[trace]),
            fitted_shears(&[FittedPoints {
                definition: "axis".into(),
                view: "all".into(),
                good: vec![[NAN; 4], [0.0; 4]],
                misfits: vec![],
            }]),
            coverage(&[CoverageView { view: "all".into(), sets: vec![("axis".into(), values.into())] }]),
            excess(&[ExcessView { view: "all".into(), by: [vec![[NAN; 2]], vec![], vec![[1.0, -5.0]]] }]),
            failing(&[FailingCurve { name: "p".into(), points: vec![(None, [NAN; 2])] }]),
            delay_ratios(&[("all".into(), [values.into(), vec![], vec![NAN]])]),
            varying_haloes([vec![[NAN; 2]], vec![]]),
        ]
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out_of_every_figure() {
        let none = of(GridData::square(&[], 0, 0.0));
        let little = of(GridData::square(&[NAN, f64::MIN_POSITIVE, f64::MAX, -1.0], 2, 1.0));
        for (name, figure) in
            none.iter().map(|figure| ("none", figure)).chain(little.iter().map(|f| ("little", f)))
        {
            let svg = figure.to_svg();
            assert!(!svg.contains("\"NaN") && !svg.contains("\"inf"), "{name}: {}", figure.title);
        }
        assert!(none.iter().filter(|figure| figure.to_svg().contains("no data")).count() > 12);
    }
}
