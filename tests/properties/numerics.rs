//! Stated bounds of elementary functions, quadrature, random streams, roots and splines.

mod elementary {
    use haloray::numerics::elementary::{LEAST_OF_LN_1P, arctan_series, exp, ln, ln_1p};

    /// Two units in the last place: one from the polynomial, one from the additions.
    const RELATIVE: f64 = 4.5e-16;

    #[test]
    fn ln_matches_libm_over_the_whole_range() {
        for i in -3000..3000 {
            let x = (f64::from(i) * 0.2337).exp2();
            let exact = x.ln();
            if x.is_normal() && exact != 0.0 {
                assert!((ln(x) / exact - 1.0).abs() < RELATIVE, "{x:e}");
            }
        }
        for i in 1..4000 {
            let x = 0.3 + f64::from(i) * 7.31e-4;
            assert!((ln(x) - x.ln()).abs() <= RELATIVE * x.ln().abs().max(1e-3), "{x}");
        }
    }

    #[test]
    fn ln_1p_matches_libm_over_the_whole_range() {
        for i in -8000..8000 {
            let x = (f64::from(i) * 0.1237).exp2();
            if x.is_normal() {
                assert!((ln_1p(x) / x.ln_1p() - 1.0).abs() < RELATIVE, "{x:e}");
            }
        }
        for i in 1..4000 {
            let x = LEAST_OF_LN_1P * (1.0 - f64::from(i) * 2.5e-4);
            assert!((ln_1p(x) / x.ln_1p() - 1.0).abs() < 2.0 * RELATIVE, "{x:e}");
        }
        assert_eq!(ln_1p(0.0), 0.0);
    }

    #[test]
    fn exp_matches_libm_over_the_whole_range() {
        for i in -7080..7080 {
            let x = f64::from(i) * 0.1 + 0.0123;
            assert!((exp(x) / x.exp() - 1.0).abs() < RELATIVE, "{x}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!([exp(-1e9), exp(f64::NEG_INFINITY)], [0.0; 2]);
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn arctan_matches_libm_up_to_an_eighth_of_pi() {
        for i in 1..=414 {
            let t = f64::from(i) * 0.001;
            assert!(((t + t * t * t * arctan_series(t * t)) / t.atan() - 1.0).abs() < RELATIVE, "{t:e}");
        }
    }
}

mod quadrature {
    use haloray::numerics::quadrature::{NODES, integrate, unit_rule};

    #[test]
    fn a_polynomial_of_degree_63_is_exact() {
        let value = integrate(0.0, 1.0, 1, |x| 64.0 * x.powi(63));
        assert!((value - 1.0).abs() < 1e-14, "{value}");
    }

    #[test]
    fn a_polynomial_of_high_degree_needs_panels() {
        let exact = 1.0;
        let one = integrate(0.0, 1.0, 1, |x| 2001.0 * x.powi(2000));
        let sixty_four = integrate(0.0, 1.0, 64, |x| 2001.0 * x.powi(2000));
        assert!((one - exact).abs() > 1e-6, "{one}");
        assert!((sixty_four - exact).abs() < 1e-12, "{sixty_four}");
    }

    #[test]
    fn nodes_ascend_inside_the_interval_and_weights_add_up_to_one() {
        let rule = unit_rule();
        assert!(rule.nodes.is_sorted() && rule.nodes[0] > 0.0 && rule.nodes[NODES - 1] < 1.0);
        assert!((rule.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}

mod random {
    use haloray::numerics::random::{Stage, stream};
    use rand::Rng;

    #[test]
    fn streams_are_reproducible_and_differ() {
        let first = |seed, realisation, stage, block| stream(seed, realisation, stage, block).next_u64();
        let base = first(1, 0, Stage::DirectDraw, 0);
        assert_eq!(base, first(1, 0, Stage::DirectDraw, 0));
        for other in [
            first(2, 0, Stage::DirectDraw, 0),
            first(1, 1, Stage::DirectDraw, 0),
            first(1, 0, Stage::BruteForceDraw, 0),
            first(1, 0, Stage::DirectDraw, 1),
        ] {
            assert_ne!(base, other);
        }
    }
}

mod roots {
    use haloray::numerics::roots::bracketed_root;
    use std::cell::Cell;

    #[test]
    fn transcendental_roots_are_found_in_either_orientation() {
        let dottie = 0.739_085_133_215_160_6;
        for (low, high) in [(0.0, 1.0), (1.0, 0.0), (-3.0, 50.0)] {
            let root = bracketed_root(|x| x - x.cos(), low, high, 1e-14).unwrap();
            assert!((root - dottie).abs() < 1e-13, "{root}");
        }
    }

    #[test]
    fn smooth_functions_need_few_evaluations() {
        let count = Cell::new(0);
        let root = bracketed_root(
            |x| {
                count.set(count.get() + 1);
                x.exp() - 5.0
            },
            0.0,
            10.0,
            1e-13,
        );
        assert!((root.unwrap() - 5f64.ln()).abs() < 1e-12);
        assert!(count.get() <= 20, "{}", count.get());
    }

    #[test]
    fn a_flat_triple_root_still_converges() {
        let root = bracketed_root(|x| (x - 0.3).powi(3), -1.0, 1.0, 1e-12).unwrap();
        assert!((root - 0.3).abs() < 1e-10, "{root}");
    }

    #[test]
    fn an_end_that_is_a_root_is_returned_and_no_sign_change_is_refused() {
        assert_eq!(bracketed_root(|x| x, 0.0, 1.0, 1e-12), Some(0.0));
        assert_eq!(bracketed_root(|x| x - 1.0, 0.0, 1.0, 1e-12), Some(1.0));
        assert_eq!(bracketed_root(|x| x * x + 1.0, -1.0, 1.0, 1e-12), None);
        assert_eq!(bracketed_root(|_| f64::NAN, -1.0, 1.0, 1e-12), None);
    }
}

mod spline {
    use haloray::numerics::spline::UniformSpline;

    fn sampled(n: usize, function: impl Fn(f64) -> f64) -> UniformSpline {
        let values: Vec<f64> = (0..n).map(|i| function(0.1 * i as f64)).collect();
        UniformSpline::new(0.0, 0.1, &values).unwrap()
    }

    #[test]
    fn cubics_are_reproduced_for_every_number_of_knots() {
        let cubic = |x: f64| 1.0 - 2.0 * x + 3.0 * x * x - 4.0 * x * x * x;
        for n in 4..12 {
            let spline = sampled(n, cubic);
            for i in 0..=200 {
                let x = spline.end() * f64::from(i) / 200.0;
                assert!((spline.value(x) - cubic(x)).abs() < 1e-13, "{n} knots at {x}");
                let slope = -2.0 + 6.0 * x - 12.0 * x * x;
                assert!((spline.derivative(x) - slope).abs() < 1e-11, "{n} knots at {x}");
            }
        }
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_step() {
        let error = |n: usize| {
            let step = 2.0 / (n - 1) as f64;
            let values: Vec<f64> = (0..n).map(|i| (step * i as f64).sin()).collect();
            let spline = UniformSpline::new(0.0, step, &values).unwrap();
            (0..1000)
                .map(|i| 0.002 * f64::from(i))
                .map(|x| (spline.value(x) - x.sin()).abs())
                .fold(0.0, f64::max)
        };
        let ratio = error(21) / error(41);
        assert!((12.0..24.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn value_and_slope_are_continuous_across_knots() {
        let spline = sampled(20, f64::exp);
        for i in 1..19 {
            let knot = 0.1 * f64::from(i);
            assert!((spline.value(knot - 1e-9) - spline.value(knot + 1e-9)).abs() < 2e-8);
            assert!((spline.derivative(knot - 1e-9) - spline.derivative(knot + 1e-9)).abs() < 1e-7);
        }
    }

    #[test]
    fn too_few_knots_bad_steps_and_nan_are_refused() {
        assert!(UniformSpline::new(0.0, 1.0, &[0.0, 1.0, 2.0]).is_err());
        assert!(UniformSpline::new(0.0, 0.0, &[0.0; 5]).is_err());
        assert!(UniformSpline::new(0.0, 1.0, &[0.0, 1.0, f64::NAN, 3.0]).is_err());
    }
}
