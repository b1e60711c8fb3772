//! ln p to second order about one point, and about the top of a kink between two.
//!
//! ln p may have a kink, as where a pixel's ray meets the edge within which a Sérsic source is flat, and its top may lie on that
//! edge. No step along the gradient then goes up, however short, but the gradients on both sides tell where the
//! edge is and what happens along it (as in bundle methods; Lemaréchal & Mifflin 1978, Nonsmooth Optimization).

use nalgebra::{DMatrix, DVector};

/// The maximum over t at one s, and what Laplace's method says of t about it.
#[derive(Debug, Clone)]
pub(crate) struct ConditionalMaximum {
    /// t̂.
    pub stiff: DVector<f64>,
    /// ln p there.
    pub log_density: f64,
    /// d ln p/ds along the conditional maxima.
    pub slope: DVector<f64>,
    /// dt̂/ds.
    pub bend: DMatrix<f64>,
    /// −d² ln p/ds² along them, Gauss–Newton.
    pub metric: DMatrix<f64>,
    /// C of the precision C Cᵀ of t.
    pub factor: DMatrix<f64>,
}

impl ConditionalMaximum {
    /// ½ ln det of the precision of t.
    pub fn half_log_determinant(&self) -> f64 {
        self.factor.diagonal().iter().map(|d| d.ln()).sum()
    }

    /// ln ∫ p dt by Laplace's method, up to a constant.
    pub fn log_marginal(&self) -> f64 {
        self.log_density - self.half_log_determinant()
    }
}

/// ln p to second order about one point.
#[derive(Debug, Clone)]
pub(crate) struct Expansion {
    pub t: DVector<f64>,
    pub log_density: f64,
    pub by_s: DVector<f64>,
    pub by_t: DVector<f64>,
    pub slow: DMatrix<f64>,
    pub mixed: DMatrix<f64>,
    pub stiff: DMatrix<f64>,
}

impl Expansion {
    /// The damped Newton step of t.
    pub fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut matrix = self.stiff.clone();
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] *= 1.0 + damping);
        Some(matrix.cholesky()?.solve(&self.by_t)).filter(|step| step.iter().all(|v| v.is_finite()))
    }

    /// What a step gains of ln p.
    pub fn gain(&self, step: &DVector<f64>) -> f64 {
        self.by_t.dot(step) - 0.5 * (&self.stiff * step).dot(step)
    }

    /// Length of a step in standard deviations.
    pub fn distance(&self, step: &DVector<f64>) -> f64 {
        (&self.stiff * step).dot(step).sqrt()
    }

    /// Another expansion about this one's point, with this one's curvature.
    fn brought_here(&self, other: &Self) -> Self {
        let from = &other.t - &self.t;
        let by_t = &other.by_t + &self.stiff * &from;
        Self {
            log_density: other.log_density - 0.5 * (&other.by_t + &by_t).dot(&from),
            by_s: &other.by_s + self.mixed.tr_mul(&from),
            by_t,
            ..self.clone()
        }
    }

    /// Whether the gradient there is that on the other side of a kink rather than that on this one's.
    pub fn is_crossed(&self, there: &Self, across: &Self) -> Option<bool> {
        let precision = self.stiff.clone().cholesky()?;
        let there = self.brought_here(there);
        let difference = |side: &DVector<f64>| {
            let off = &there.by_t - side;
            precision.solve(&off).dot(&off)
        };
        Some(difference(&self.brought_here(across).by_t) < difference(&self.by_t))
    }

    /// ln p about the top of the kink between here and a point across it; `None` if the top is elsewhere.
    ///
    /// With g and g′ the gradients on both sides, brought here, the top of the lower of the two expansions lies at
    /// p = H⁻¹[g′ + α(g − g′)], where both are equal. Across the kink ln p falls on either side with the slopes 1/a and 1/b, 1/a +
    /// 1/b = |g − g′|: an exponential of deviation √2 a if a = b, for which a normal with the precision (g − g′)(g − g′)ᵀ/8 stands.
    pub fn ridge(&self, across: &Self) -> Option<Self> {
        let other = self.brought_here(across);
        let (jump_s, jump) = (&self.by_s - &other.by_s, &self.by_t - &other.by_t);
        let precision = self.stiff.clone().cholesky()?;
        let solved = precision.solve(&jump);
        let share = -(self.log_density - other.log_density + solved.dot(&other.by_t)) / solved.dot(&jump);
        if share.is_nan() || share >= 1.0 {
            return None;
        }
        let share = share.max(0.0);
        let top = precision.solve(&(other.by_t + &jump * share));
        let stiff = &self.stiff + &jump * jump.transpose() / 8.0;
        let by_t = &stiff * &top;
        let height = self.by_t.dot(&top) - 0.5 * (&self.stiff * &top).dot(&top);
        Some(Self {
            t: self.t.clone(),
            log_density: self.log_density + height - 0.5 * by_t.dot(&top),
            by_s: other.by_s + &jump_s * (share + jump.dot(&top) / 8.0),
            by_t,
            slow: &self.slow + &jump_s * jump_s.transpose() / 8.0,
            mixed: &self.mixed + &jump * jump_s.transpose() / 8.0,
            stiff,
        })
    }

    /// The maximum one Newton step away.
    pub fn maximum(&self, newton: &DVector<f64>) -> Option<ConditionalMaximum> {
        let precision = self.stiff.clone().cholesky()?;
        let bend = -precision.solve(&self.mixed);
        Some(ConditionalMaximum {
            log_density: self.log_density + 0.5 * self.by_t.dot(newton),
            slope: &self.by_s + bend.tr_mul(&self.by_t),
            metric: &self.slow + self.mixed.tr_mul(&bend),
            stiff: &self.t + newton,
            factor: precision.l(),
            bend,
        })
    }
}
