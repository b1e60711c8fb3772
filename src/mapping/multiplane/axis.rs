//! The ray that the observer sees on the axis: bent by the haloes, or kept straight by where their planes are laid.
//!
//! Subtracting from every kick its value on the axis, s ← s − f[α(x/χ − c) − α(−c)] + f·κ·x/χ, keeps the axis ray
//! straight. With X the path of an ordinary ray through haloes at c + X/χ, the ordinary ray x + X obeys the ordinary
//! recursion through these haloes: a straight line of sight is an ordinary one whose haloes are moved by X/χ and whose
//! rays are measured from X. Derivatives, and delays between images of one source, do not change.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kick::{Distortion, Kick};
use super::plane::Plane;

/// The line from which positions in every plane are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reference {
    /// A line that haloes do not bend; the axis ray leaves it, by 10″ through haloes of all masses (the paper).
    #[default]
    Bent,
    /// The axis ray itself: in each plane its deflection is subtracted from all, so that haloes do to it what they would do
    /// alone, and lens and source lie at 0. For given haloes this is a choice of where their planes' origins are.
    Straight,
}

/// Where a ray is and which way it goes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct State {
    pub chi_cmpc: f64,
    /// Comoving position, Mpc·arcsec.
    pub x: [f64; 2],
    /// Slope, arcsec.
    pub s: [f64; 2],
}

impl State {
    pub fn advanced(self, chi_cmpc: f64) -> Self {
        let step = chi_cmpc - self.chi_cmpc;
        Self { chi_cmpc, x: [0, 1].map(|c| self.x[c] + step * self.s[c]), s: self.s }
    }

    /// On through planes in order: where the ray meets each.
    pub fn through(&mut self, planes: &[Plane]) -> Vec<Self> {
        let meet = |plane: &Plane| {
            let met = self.advanced(plane.chi_cmpc);
            let kick = plane.kick_at(met.x.map(|x| x * plane.inv_chi));
            *self = Self { s: [0, 1].map(|c| met.s[c] - kick[c]), ..met };
            met
        };
        planes.iter().map(meet).collect()
    }

    /// x/χ, arcsec; zero at the observer.
    pub fn direction_arcsec(&self) -> [f64; 2] {
        if self.chi_cmpc > 0.0 { self.x.map(|x| x / self.chi_cmpc) } else { [0.0; 2] }
    }
}

/// The axis ray behind each plane, in order of distance.
#[derive(Debug, Clone)]
pub(super) struct Axis(Vec<State>);

impl Axis {
    /// Follows the ray through planes in order; `settle` may change each before it kicks, knowing where the ray meets it.
    ///
    /// Bits are those of the ray of direction 0 in the ray loop.
    pub fn through(planes: &mut [Plane], mut settle: impl FnMut(&mut Plane, [f64; 2])) -> Self {
        let mut ray = State::default();
        let states = planes.iter_mut().map(|plane| {
            ray = ray.advanced(plane.chi_cmpc);
            settle(plane, ray.x.map(|x| x * plane.inv_chi));
            let mut kick = [0.0; 2];
            let turn = |_, k: Kick| kick = k.f_alpha_arcsec;
            plane.kick::<0, 1>(&ray.x.map(|x| [x]), plane.inv_chi, &mut Distortion::none(), turn);
            ray.s = [0, 1].map(|c| ray.s[c] - kick[c]);
            ray
        });
        Self(states.collect())
    }

    /// The direction x/χ in which the ray meets plane `i`, arcsec.
    pub fn at_plane(&self, i: usize) -> [f64; 2] {
        self.0[i].direction_arcsec()
    }

    /// The ray on its way at comoving distance `chi_cmpc`, before planes at that distance.
    pub fn at(&self, chi_cmpc: f64) -> State {
        let before = self.0.partition_point(|state| state.chi_cmpc < chi_cmpc);
        before.checked_sub(1).map_or(State::default(), |i| self.0[i]).advanced(chi_cmpc)
    }
}
