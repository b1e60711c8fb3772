//! Surface brightness of a model at the samples of a mesh, and its derivatives forwards and backwards, in SIMD lanes.

use super::compiled::CompiledModel;
use super::mesh::{Mesh, PixelSums};
use crate::error::Result;
use crate::mapping::tidal::{LensResponse, MANY_LENSES, MOST_NUMBERS};
use crate::mapping::{HaloExpansion, Rays};
use crate::monitor::Monitor;
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};
use crate::profile::light::Sersic;
use crate::profile::mass::MassModel;

/// A model at one set of values of its free parameters, lights with amplitude 1.
pub(crate) struct Evaluation<'a> {
    model: &'a CompiledModel,
    slots: Vec<f64>,
    lenses: Vec<MassModel>,
    lights: Vec<Sersic>,
}

impl CompiledModel {
    /// The model at values of its free parameters.
    ///
    /// # Errors
    /// When a parameter lies outside the domain of its profile.
    pub(crate) fn evaluate(&self, free: &[f64]) -> Result<Evaluation<'_>> {
        let slots = self.slots(free);
        let (lenses, lights) = self.build(&slots)?;
        Ok(Evaluation { model: self, slots, lenses, lights })
    }

    /// Where the line of sight is made of haloes: carries the rays of a new mesh past the lens (see [`HaloSight::carry`]).
    ///
    /// # Errors
    /// When cancelled.
    pub(crate) fn carry(&self, mesh: &mut Mesh, monitor: &dyn Monitor) -> Result<()> {
        if let Some(haloes) = self.haloes() {
            mesh.rays.haloes = Some(haloes.carry(&mesh.rays.theta_arcsec(), monitor)?);
        }
        Ok(())
    }
}

impl Evaluation<'_> {
    /// Where the line of sight is made of haloes: the rays of a mesh expanded about the deflections of these lenses.
    ///
    /// # Errors
    /// When cancelled.
    pub fn expand(&self, mesh: &Mesh, monitor: &dyn Monitor) -> Result<Option<HaloExpansion>> {
        let (Some(haloes), Some(rays)) = (self.model.haloes(), &mesh.rays.haloes) else { return Ok(None) };
        haloes.expand_about(rays, self.lens().deflections(&mesh.rays), monitor).map(Some)
    }

    /// How far in arcsec β is from that of rays traced through the haloes and these lenses, at most; 0 without haloes.
    ///
    /// # Errors
    /// When cancelled.
    pub fn expansion_error_arcsec(&self, mesh: &Mesh, monitor: &dyn Monitor) -> Result<f64> {
        match (self.model.haloes(), &mesh.rays.haloes) {
            (Some(haloes), Some(rays)) => {
                haloes.expansion_error_arcsec(rays, &self.lens().deflections(&mesh.rays), monitor)
            }
            _ => Ok(0.0),
        }
    }

    fn lens(&self) -> LensResponse<'_> {
        let numbers = self.model.line_of_sight.parameters().len();
        LensResponse::new(self.model.line_of_sight, &self.slots[..numbers], &self.lenses)
    }

    /// Surface brightness of every light (sources first) at every sample, per arcsec².
    pub fn brightness(&self, mesh: &Mesh) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; mesh.rays.padded()]; self.lights.len()];
        self.each_block(mesh, |start, brightness| {
            brightness.iter().zip(&mut out).for_each(|(own, out)| own.store(out, start));
        });
        out
    }

    /// Flux of every light (sources first) in every pixel.
    pub fn fluxes(&self, mesh: &Mesh) -> Vec<Vec<f64>> {
        let mut fluxes = PixelSums::new(mesh, self.lights.len());
        self.each_block(mesh, |start, brightness| fluxes.add(start, brightness));
        fluxes.into_columns()
    }

    /// Hands the surface brightness of every light at each block of samples to `take`.
    fn each_block(&self, mesh: &Mesh, mut take: impl FnMut(usize, &[Lanes])) {
        let (lens, (sources, lens_lights)) = (self.lens(), self.parts());
        let mut brightness = vec![Lanes::ZERO; self.lights.len()];
        for start in mesh.rays.blocks() {
            let (theta, beta) = (mesh.rays.block(start), lens.beta(&mesh.rays, start));
            let (of_source, of_lens) = brightness.split_at_mut(sources.len());
            sources.iter().zip(of_source).for_each(|(light, own)| *own = light.brightness_lanes(beta));
            lens_lights.iter().zip(of_lens).for_each(|(light, own)| *own = light.brightness_lanes(theta));
            take(start, &brightness);
        }
    }

    /// Derivatives, by the free parameters, of Σ adjoint·brightness over lights and samples.
    pub fn pull_back(&self, mesh: &Mesh, adjoint: &[Vec<f64>]) -> Vec<f64> {
        let mut by_slot = vec![Lanes::ZERO; self.slots.len()];
        accumulate(&self.lens(), self.parts(), &mesh.rays, adjoint, self.model.mapping_slots(), &mut by_slot);
        self.model.gather(&by_slot.into_iter().map(Lanes::sum).collect::<Vec<_>>())
    }

    /// Derivatives of Σ amplitude·flux by every free parameter in every pixel.
    pub fn columns(&self, mesh: &Mesh, amplitudes: &[f64]) -> Vec<Vec<f64>> {
        let mut columns = PixelSums::new(mesh, self.model.free.len());
        let free: Vec<Option<usize>> = self.model.free_of_slots().collect();
        differentiate(
            &self.lens(),
            self.parts(),
            &mesh.rays,
            amplitudes,
            (self.model.mapping_slots(), &free),
            &mut columns,
        );
        columns.into_columns()
    }

    /// β of every sample.
    pub fn source_positions(&self, mesh: &Mesh) -> Vec<[f64; 2]> {
        let (lens, rays) = (self.lens(), &mesh.rays);
        let blocks = rays.blocks().flat_map(|start| {
            let beta = lens.beta(rays, start);
            (0..LANES).map(move |i| [beta.re.0[i], beta.im.0[i]])
        });
        blocks.take(rays.count()).collect()
    }

    fn parts(&self) -> (&[Sersic], &[Sersic]) {
        self.lights.split_at(self.model.sources)
    }
}

type Lights<'a> = (&'a [Sersic], &'a [Sersic]);

const LIGHT_SLOTS: usize = Sersic::PARAMETERS.len();

fn accumulate(
    lens: &LensResponse,
    (sources, lens_lights): Lights,
    rays: &Rays,
    adjoint: &[Vec<f64>],
    mapping_slots: usize,
    by_slot: &mut [Lanes],
) {
    let mut responses = [Cx::<Lanes>::zero(); MOST_NUMBERS + MANY_LENSES];
    let responses = &mut responses[..mapping_slots];
    let (of_mapping, of_lights) = by_slot.split_at_mut(mapping_slots);
    for start in rays.blocks() {
        let theta = rays.block(start);
        let beta = lens.respond(rays, start, responses);
        let mut pull = Cx::zero();
        for (j, light) in sources.iter().chain(lens_lights).enumerate() {
            let weight = Lanes::load(&adjoint[j], start);
            let mut own = [Lanes::ZERO; LIGHT_SLOTS];
            if j < sources.len() {
                pull += light.response_lanes(beta, &mut own).1.scale(weight);
            } else {
                light.response_lanes(theta, &mut own);
            }
            for (sum, own) in of_lights[LIGHT_SLOTS * j..].iter_mut().zip(own) {
                *sum += own * weight;
            }
        }
        for (sum, response) in of_mapping.iter_mut().zip(responses.iter()) {
            *sum += pull.dot(*response);
        }
    }
}

fn differentiate(
    lens: &LensResponse,
    (sources, lens_lights): Lights,
    rays: &Rays,
    amplitudes: &[f64],
    (mapping_slots, free): (usize, &[Option<usize>]),
    columns: &mut PixelSums,
) {
    let mut by_free = vec![Lanes::ZERO; columns.count()];
    let mut responses = [Cx::<Lanes>::zero(); MOST_NUMBERS + MANY_LENSES];
    let responses = &mut responses[..mapping_slots];
    for start in rays.blocks() {
        let theta = rays.block(start);
        let beta = lens.respond(rays, start, responses);
        by_free.fill(Lanes::ZERO);
        let mut add = |slot: usize, derivative: Lanes| {
            if let Some(i) = free[slot] {
                by_free[i] += derivative;
            }
        };
        let mut gradient = Cx::zero();
        for (j, (light, amplitude)) in sources.iter().chain(lens_lights).zip(amplitudes).enumerate() {
            let mut own = [Lanes::ZERO; LIGHT_SLOTS];
            if j < sources.len() {
                gradient += light.response_lanes(beta, &mut own).1 * *amplitude;
            } else {
                light.response_lanes(theta, &mut own);
            }
            for (k, own) in own.into_iter().enumerate() {
                add(mapping_slots + LIGHT_SLOTS * j + k, own * *amplitude);
            }
        }
        for (slot, response) in responses.iter().enumerate() {
            add(slot, gradient.dot(*response));
        }
        columns.add(start, &by_free);
    }
}
