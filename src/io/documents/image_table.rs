//! Images of a point source, critical curves and caustics, as tables.

use crate::diagnostics::{CriticalCurves, ImageKind, PointImage, PointImages};
use crate::error::Result;
use crate::io::containers::{Column, Table};

/// One row an image: direction, kind, magnification with sign, inverse magnification tensor, delay.
///
/// # Errors
/// Never.
pub fn image_table(found: &PointImages) -> Result<Table> {
    let column = |name: &str, unit: Option<&str>, value: &dyn Fn(&PointImage) -> f64| {
        Column::f64(name, unit, found.images.iter().map(value).collect())
    };
    let arcsec = Some("arcsec");
    let mut columns = vec![
        column("theta_x_arcsec", arcsec, &|i| i.theta_arcsec[0]),
        column("theta_y_arcsec", arcsec, &|i| i.theta_arcsec[1]),
        Column::text("kind", found.images.iter().map(|i| kind_name(i.kind()).into()).collect()),
        column("magnification", None, &PointImage::magnification),
    ];
    for (k, name) in ["a_xx", "a_xy", "a_yx", "a_yy"].into_iter().enumerate() {
        columns.push(column(name, None, &|i| i.jacobian[k]));
    }
    columns.push(column("delay_days", Some("d"), &|i| i.delay_days));
    Table::new(columns)
}

/// The name of a stationary point in tables.
pub fn kind_name(kind: ImageKind) -> &'static str {
    match kind {
        ImageKind::Minimum => "minimum",
        ImageKind::Saddle => "saddle",
        ImageKind::Maximum => "maximum",
    }
}

/// One row a vertex: number and kind of the curve, whether it is closed, the critical curve and its caustic.
///
/// # Errors
/// Never.
pub fn curve_table(found: &CriticalCurves) -> Result<Table> {
    let vertices = || {
        let numbered = found.curves.iter().enumerate();
        numbered.flat_map(|(n, curve)| (0..curve.theta_arcsec.len()).map(move |k| (n, curve, k)))
    };
    let arcsec = Some("arcsec");
    Table::new(vec![
        Column::f64("curve", None, vertices().map(|(n, ..)| n as f64).collect()),
        Column::text("kind", vertices().map(|(_, curve, _)| curve.kind.name().into()).collect()),
        Column::f64("closed", None, vertices().map(|(_, c, _)| f64::from(u8::from(c.closed))).collect()),
        Column::f64("theta_x_arcsec", arcsec, vertices().map(|(_, c, k)| c.theta_arcsec[k][0]).collect()),
        Column::f64("theta_y_arcsec", arcsec, vertices().map(|(_, c, k)| c.theta_arcsec[k][1]).collect()),
        Column::f64("beta_x_arcsec", arcsec, vertices().map(|(_, c, k)| c.beta_arcsec[k][0]).collect()),
        Column::f64("beta_y_arcsec", arcsec, vertices().map(|(_, c, k)| c.beta_arcsec[k][1]).collect()),
    ])
}
