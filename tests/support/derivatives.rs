//! Finite-difference checks.

use haloray::numerics::complex::Cx;
use haloray::profile::mass::{MassModel, MassProfile};
use haloray::profile::registry::Parameter;

/// Each ∂α/∂p against differences of the profiles that `build` makes of parameters, to `relative` of the largest.
pub fn assert_parameter_derivatives(
    build: impl Fn(&[f64]) -> MassModel,
    parameters: &[f64],
    [x, y]: [f64; 2],
    relative: f64,
) {
    let profile = build(parameters);
    let names = profile.parameters();
    assert_eq!(names.len(), parameters.len());
    let mut got = vec![Cx::new(0.0, 0.0); names.len()];
    profile.respond(x, y, &mut got);
    for (i, Parameter { name, .. }) in names.iter().enumerate() {
        let step = 1e-2 * parameters[i].abs().clamp(0.02, 1.0);
        let want = [0, 1].map(|c| {
            derivative(
                |p| {
                    let mut moved = parameters.to_vec();
                    moved[i] = p;
                    build(&moved).deflection(x, y)[c]
                },
                parameters[i],
                step,
            )
        });
        // Rounding alone makes differences of a few 1e-12.
        let scale = want[0].hypot(want[1]).max(1e-4);
        for (got, want) in [(got[i].re, want[0]), (got[i].im, want[1])] {
            assert!(
                (got - want).abs() <= relative * scale,
                "∂α/∂{name} at ({x}, {y}) of {parameters:?}: {got:e}, differences {want:e}"
            );
        }
    }
}

/// Richardson-extrapolated central difference of `f` at `x`: error O(h⁶).
pub fn derivative(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    let d = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
    let (d1, d2, d4) = (d(h), d(h / 2.0), d(h / 4.0));
    let (r1, r2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d4 - d2) / 3.0);
    (16.0 * r2 - r1) / 15.0
}

/// α = ∇ψ, H = ∂α, T = ∂H at (x, y), each to `relative` of the largest component.
pub fn assert_consistent(profile: &impl MassProfile, x: f64, y: f64, step: f64, relative: f64) {
    let check = |name: &str, got: f64, want: f64, scale: f64| {
        assert!(
            (got - want).abs() <= relative * scale,
            "{name} at ({x}, {y}): {got:e}, differences {want:e}"
        );
    };
    let alpha = profile.deflection(x, y);
    let scale = alpha[0].hypot(alpha[1]).max(1e-300);
    check("α_x", alpha[0], derivative(|x| profile.potential(x, y), x, step), scale);
    check("α_y", alpha[1], derivative(|y| profile.potential(x, y), y, step), scale);
    let h = profile.hessian(x, y);
    let scale = h.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    check("ψ_xx", h[0], derivative(|x| profile.deflection(x, y)[0], x, step), scale);
    check("ψ_xy", h[1], derivative(|y| profile.deflection(x, y)[0], y, step), scale);
    check("ψ_yx", h[1], derivative(|x| profile.deflection(x, y)[1], x, step), scale);
    check("ψ_yy", h[2], derivative(|y| profile.deflection(x, y)[1], y, step), scale);
    let t = profile.third_derivatives(x, y);
    let scale = t.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    check("ψ_xxx", t[0], derivative(|x| profile.hessian(x, y)[0], x, step), scale);
    check("ψ_xxy", t[1], derivative(|y| profile.hessian(x, y)[0], y, step), scale);
    check("ψ_xyy", t[2], derivative(|y| profile.hessian(x, y)[1], y, step), scale);
    check("ψ_yyy", t[3], derivative(|y| profile.hessian(x, y)[2], y, step), scale);
}
