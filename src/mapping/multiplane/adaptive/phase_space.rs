//! A ray as a point of phase space that nothing but kicks moves.
//!
//! z = (a, b): the angle a by which kicks have turned the ray, and b, what they have moved it by where it started,
//! over the length L of the way. Nothing but a kick changes z. A plane at χ is met in the direction θ = S + Qz.
//! Rays obey Hamilton's equations, so a kick K acts as z ← z + wΩQᵀK with Ω = (0 −1; 1 0) and w = χ/L, whatever smooth
//! lenses Q (2×4) contains.

/// Two rows over z, `[row][component]`.
pub(super) type Rows = [[f64; 4]; 2];

/// Qz.
#[inline(always)]
pub(super) fn apply(rows: &Rows, z: &[f64; 4]) -> [f64; 2] {
    rows.map(|r| r[0] * z[0] + r[1] * z[1] + r[2] * z[2] + r[3] * z[3])
}

/// z ← z + wΩQᵀK.
#[inline(always)]
pub(super) fn kick(rows: &Rows, w: f64, k: [f64; 2], z: &mut [f64; 4]) {
    let q = |i: usize| w * (rows[0][i] * k[0] + rows[1][i] * k[1]);
    z[0] -= q(2);
    z[1] -= q(3);
    z[2] += q(0);
    z[3] += q(1);
}

/// Linear kicks met so far: M of z = Mz′, z′ unchanged by them; its columns.
#[derive(Clone, Copy)]
pub(super) struct Linear([[f64; 4]; 4]);

impl Linear {
    /// No kick so far.
    pub fn identity() -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)))))
    }

    /// QM.
    pub fn rows(&self, rows: &Rows) -> Rows {
        let columns = self.0.map(|column| apply(rows, &column));
        [0, 1].map(|c| columns.map(|column| column[c]))
    }

    /// M ← M + wΩQᵀHQM.
    pub fn kick(&mut self, rows: &Rows, w: f64, [xx, xy, yy]: [f64; 3]) {
        for column in &mut self.0 {
            let [x, y] = apply(rows, column);
            kick(rows, w, [xx * x + xy * y, xy * x + yy * y], column);
        }
    }
}
