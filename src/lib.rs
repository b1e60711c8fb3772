//! haloray simulates what every dark-matter halo along a line of sight does to a strong-lensing image, and measures
//! what a tidal model of the line of sight recovers from it.
//!
//! Section 4 of Hogg, Fleury, Larena & Martinelli (2023, MNRAS 520, 5982) as a library and a command: haloes of a
//! mass function in a cylinder around the axis, one lens plane each, rays traced through all of them, images behind.
//!
//! | stage | room | in | out |
//! |---|---|---|---|
//! | configure | [`config`] | preset, TOML file | [`config::Config`] |
//! | expand | [`cosmology`] | H0, Ωm, σ8 … | [`cosmology::Background`], [`cosmology::LinearTheory`] |
//! | populate | [`halo`] | mass function, concentration | [`halo::Population`] → [`halo::HaloCatalogue`] |
//! | trace | [`mapping`] | haloes, sheets | [`mapping::multiplane::LineOfSight`] → any [`mapping::Mapping`] |
//! | diagnose | [`diagnostics`] | haloes, mapping | Δ_h, od/os/ds/LOS tensors, maps |
//! | image | [`imaging`] | mapping, source light | [`imaging::Exposure`] |
//! | fit | [`inference`] | image, model | [`inference::Fit`]: posterior, convergence, best fit |
//! | draw catalogues | [`mock`] | protocol | [`mock::MockSystem`], [`mock::ModelScore`] |
//! | run | [`pipeline`] | config | [`pipeline::Simulation`] |
//! | save, draw | [`io`], [`plot`], [`report`] | simulation | HDF5, FITS, figures |
//!
//! Below them: [`profile`] (mass and light, angles in, angles out), [`numerics`], [`constants`], [`error`], [`monitor`].
//! Angles are in arcsec, distances in comoving Mpc where the name says `cmpc`, masses in solar masses; never h-units.
//!
//! A program that builds on haloray needs few of its names: [`config::load`] and [`config::Preset`]; [`pipeline::populate`] and
//! [`pipeline::simulate`]; [`halo::HaloCatalogue`], [`io::read_haloes`] and [`io::write_haloes`]; [`mapping::Mapping`];
//! [`diagnostics::Distortion`] and [`diagnostics::TidalMaps`]; [`imaging::Scene`] and [`imaging::expose`];
//! [`io::read_observation`], [`inference::model::ModelDescription`] and [`inference::Fit`]; [`io::Staging`] and [`io::Table`];
//! [`monitor::Monitor`], to watch and to stop work; [`Error`], whose [`hint`](Error::hint) says what helps.
//!
//! ```
//! use haloray::cosmology::Background;
//! use haloray::diagnostics::Distortion;
//! use haloray::halo::{HaloCatalogue, HaloMasses};
//! use haloray::mapping::multiplane::{LineOfSight, Sheets};
//!
//! // One halo of 10^12 Msun at z = 0.3, 20″ right of the axis of a source at z = 1.5.
//! let background = Background::paper();
//! let masses = HaloMasses::Physical { m200c_msun: vec![1e12], c200c: vec![8.0] };
//! let haloes = HaloCatalogue::new(1.5, &background, vec![0.3], [vec![20.0], vec![0.0]], masses)
//!     .map_err(haloray::Error::from)?;
//! let sight = LineOfSight::new(&haloes, &Sheets::OnAxis)?;
//! let d = Distortion::on_axis(&sight.observer_to_source());
//! assert!(d.tidal.kappa.abs() < 1e-15); // its sheet cancels its convergence on the axis
//! assert!((d.tidal.gamma.re + 0.007_864).abs() < 1e-6); // stretched towards the halo
//! # Ok::<(), haloray::Error>(())
//! ```

pub mod config;
pub mod constants;
pub mod cosmology;
pub mod diagnostics;
pub mod ensemble;
pub mod error;
pub mod halo;
pub mod imaging;
pub mod inference;
pub mod io;
pub mod mapping;
pub mod mock;
pub mod monitor;
pub mod numerics;
pub mod pipeline;
pub mod plot;
pub mod profile;
pub mod report;

pub use error::{Error, Result};

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
