//! The part of the sky that sightlines may have: a box in right ascension and declination.

use std::fmt;

use rand::RngExt;

use super::direction::Direction;
use crate::error::{Domain, Error, Result, shortest};
use crate::numerics::random::{Stage, stream};

/// From `ra_deg[0]` eastwards to `ra_deg[1]`, through 0° where the first is larger, and between two declinations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    ra_deg: [f64; 2],
    dec_deg: [f64; 2],
}

impl Footprint {
    /// The whole sky.
    pub const FULL_SKY: Self = Self { ra_deg: [0.0, 360.0], dec_deg: [-90.0, 90.0] };

    /// The box (RA from, RA to, Dec from, Dec to).
    ///
    /// # Errors
    /// Right ascensions outside −360° to 360° or equal to each other, declinations outside −90° to 90° or not in order.
    pub fn new([ra_from, ra_to, dec_from, dec_to]: [f64; 4]) -> Result<Self> {
        let turn = Domain::from_to(-360.0, 360.0);
        for ra in [ra_from, ra_to] {
            turn.check("right ascension", ra)?;
        }
        if ra_from == ra_to {
            let allowed = "unlike where it begins; 0,360 is the whole turn";
            return Err(Error::out_of_range("end of right ascension", shortest(ra_to), allowed));
        }
        Domain::from_to(-90.0, 90.0).check("lower declination", dec_from)?;
        let above = format!("above {} and at most 90", shortest(dec_from));
        Domain::above_to(dec_from, 90.0).check_in_words("upper declination", dec_to, &above)?;
        Ok(Self { ra_deg: [ra_from, ra_to], dec_deg: [dec_from, dec_to] })
    }

    /// Degrees of right ascension, 360 for the whole turn.
    fn width_deg(&self) -> f64 {
        let [from, to] = self.ra_deg;
        let width = (to - from).rem_euclid(360.0);
        if width == 0.0 { 360.0 } else { width }
    }

    /// Whether a direction lies in it.
    pub fn contains(&self, direction: Direction) -> bool {
        let from_west = (direction.ra_deg - self.ra_deg[0]).rem_euclid(360.0);
        let [low, high] = self.dec_deg;
        from_west <= self.width_deg() && (low..=high).contains(&direction.dec_deg)
    }

    /// Solid angle, square degrees.
    pub fn area_deg2(&self) -> f64 {
        let [low, high] = self.dec_deg.map(|dec| dec.to_radians().sin());
        self.width_deg() * (high - low).to_degrees()
    }

    /// The random direction of that number, uniform over the solid angle; the same whichever are drawn beside it.
    pub fn random_direction(&self, seed: u64, number: u64) -> Direction {
        let mut rng = stream(seed, number, Stage::LightconeDirection, 0);
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        let [low, high] = self.dec_deg.map(|dec| dec.to_radians().sin());
        let dec = (low + v * (high - low)).clamp(-1.0, 1.0).asin().to_degrees();
        let ra = (self.ra_deg[0] + u * self.width_deg()).rem_euclid(360.0);
        Direction { ra_deg: ra, dec_deg: dec.clamp(self.dec_deg[0], self.dec_deg[1]) }
    }
}

impl fmt::Display for Footprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([ra_from, ra_to], [dec_from, dec_to]) = (self.ra_deg, self.dec_deg);
        write!(
            f,
            "RA {ra_from:.4} to {ra_to:.4} deg, Dec {dec_from:.4} to {dec_to:.4} deg ({:.2} deg²)",
            self.area_deg2()
        )
    }
}

/// Gathers the footprint of a catalogue: the box around it that leaves out its widest gap in right ascension.
#[derive(Debug, Clone)]
pub struct FootprintOfHaloes {
    /// Smallest and largest right ascension in each cell of [`CELL_DEG`].
    cells: Vec<Option<[f64; 2]>>,
    dec_deg: [f64; 2],
}

/// Width of a cell of right ascension; gaps that are narrower may be missed.
const CELL_DEG: f64 = 0.1;

impl Default for FootprintOfHaloes {
    fn default() -> Self {
        let cells = vec![None; (360.0 / CELL_DEG) as usize];
        Self { cells, dec_deg: [f64::INFINITY, f64::NEG_INFINITY] }
    }
}

impl FootprintOfHaloes {
    /// One more halo.
    pub fn add(&mut self, direction: Direction) {
        let ra = direction.ra_deg.rem_euclid(360.0);
        let last = self.cells.len() - 1;
        let cell = &mut self.cells[((ra / CELL_DEG) as usize).min(last)];
        let [low, high] = cell.unwrap_or([ra, ra]);
        *cell = Some([low.min(ra), high.max(ra)]);
        self.dec_deg = [self.dec_deg[0].min(direction.dec_deg), self.dec_deg[1].max(direction.dec_deg)];
    }

    /// The haloes of another part too.
    pub fn merge(mut self, other: Self) -> Self {
        for (own, other) in self.cells.iter_mut().zip(other.cells) {
            *own = match (*own, other) {
                (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
                (one, None) | (None, one) => one,
            };
        }
        self.dec_deg = [self.dec_deg[0].min(other.dec_deg[0]), self.dec_deg[1].max(other.dec_deg[1])];
        self
    }

    /// The box, or nothing for fewer than two haloes that differ in both coordinates.
    pub fn footprint(&self) -> Option<Footprint> {
        let there: Vec<[f64; 2]> = self.cells.iter().flatten().copied().collect();
        let (first, last) = (there.first()?, there.last()?);
        // A gap ends where a cell begins; the one through 0° is the first candidate.
        let mut widest = (first[0] + 360.0 - last[1], [first[0], last[1]]);
        for pair in there.windows(2) {
            let gap = pair[1][0] - pair[0][1];
            if gap > widest.0 {
                widest = (gap, [pair[1][0], pair[0][1]]);
            }
        }
        let [dec_from, dec_to] = self.dec_deg;
        // Cells without a gap between them are the whole turn.
        let [ra_from, ra_to] = if widest.0 <= 2.0 * CELL_DEG { [0.0, 360.0] } else { widest.1 };
        Footprint::new([ra_from, ra_to, dec_from, dec_to]).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_directions_fill_the_box_evenly_also_through_zero() {
        let footprint = Footprint::new([350.0, 20.0, 30.0, 90.0]).unwrap();
        let number = 4000;
        let all: Vec<Direction> = (0..number).map(|k| footprint.random_direction(5, k)).collect();
        assert!(all.iter().all(|&d| footprint.contains(d)));
        assert_eq!(all[7], footprint.random_direction(5, 7));
        // Half of the solid angle lies below sin δ = 0.75, a third of it west of 0°.
        let share =
            |of: &dyn Fn(&Direction) -> bool| all.iter().filter(|d| of(d)).count() as f64 / number as f64;
        assert!((share(&|d| d.dec_deg < 0.75_f64.asin().to_degrees()) - 0.5).abs() < 0.03);
        assert!((share(&|d| d.ra_deg > 300.0) - 1.0 / 3.0).abs() < 0.03);
        let sky = Footprint::FULL_SKY.area_deg2();
        assert!((sky - 41_252.961).abs() < 1e-3, "{sky}");
    }

    #[test]
    fn the_footprint_of_haloes_finds_its_gap() {
        let of = |ras: &[f64]| {
            let mut found = FootprintOfHaloes::default();
            let mut other = FootprintOfHaloes::default();
            for (i, &ra_deg) in ras.iter().enumerate() {
                let part = if i % 2 == 0 { &mut found } else { &mut other };
                part.add(Direction { ra_deg, dec_deg: i as f64 });
            }
            found.merge(other).footprint()
        };
        assert_eq!(of(&[10.0, 12.0, 14.0]).unwrap(), Footprint::new([10.0, 14.0, 0.0, 2.0]).unwrap());
        assert_eq!(of(&[359.5, 2.0, 1.0]).unwrap(), Footprint::new([359.5, 2.0, 0.0, 2.0]).unwrap());
        assert_eq!(of(&[-0.5, 2.0]).unwrap(), Footprint::new([359.5, 2.0, 0.0, 1.0]).unwrap());
        let turn: Vec<f64> = (0..3600).map(|i| f64::from(i) * 0.1).collect();
        assert!((of(&turn[..80]).unwrap().width_deg() - 7.9).abs() < 1e-9);
        assert_eq!(of(&[5.0]), None);
    }

    #[test]
    fn what_is_no_box_is_refused() {
        for bad in
            [[0.0, 0.0, -1.0, 1.0], [0.0, 400.0, -1.0, 1.0], [0.0, 9.0, 5.0, 5.0], [0.0, 9.0, -91.0, 0.0]]
        {
            assert!(Footprint::new(bad).unwrap_err().is_bad_input(), "{bad:?}");
        }
    }
}
