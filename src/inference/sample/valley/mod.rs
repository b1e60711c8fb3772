//! A sampler for posteriors that lie in a curved valley, as those of composite lenses do.
//!
//! The image measures some directions T of the model to 1e-4 of their priors and says little of others, S
//! (`optimise/conditional_maximum.rs`). Among S is also what is measured well but bends the others: where one point stands for a
//! pixel and its ray meets the cusp of a source, the pixel's flux tells their distance and not the angle, an arc of some
//! 1e-3 arcsec. No-U-Turn trajectories must then follow the bends of the valley in steps of the
//! width across it. Here the two are taken apart:
//!
//! - *Along* the valley: the density of s is Laplace's integral over t, ln m(s) = ln p(s, t̂(s)) − ½ ln det H(s), with H the
//!   curvature over t; the floor t̂ is solved anew for each proposal. Of several maxima over t the highest met counts.
//!   Proposals are ends of chains on a surrogate for m, made of the floors found so far, so that a way of
//!   any length costs one floor at its end. Each step of them is accepted by the surrogate s̃ itself; the end is then accepted by
//!   m(s′) s̃(s)/[m(s) s̃(s′)], which makes the chain exact whatever the surrogate is (Liu 2001, Monte Carlo Strategies in
//!   Scientific Computing, section 9.4.3). Steps are made in coordinates in which the valley is straight and as wide as one
//!   (`transport_map.rs`): elsewhere they would have to be as short as its narrowest bend.
//!   When the surrogate is made again with new floors, each chain's floor is sought again and the t that it did not take are
//!   drawn again: that leaves (s, t) as they are distributed. Less and less of it is new, so that the chain still tends to
//!   the posterior (Roberts & Rosenthal 2007, J. Appl. Probab. 44, 458). Warm-up, of which no draw is kept, has new t for each
//!   block. Early draws are left out where the others converge without them (`run.rs`).
//! - *Between* valleys: ellipticity and foreground shear turn the same image into two modes with hardly anything between
//!   them. Half of the moves on the surrogate leap to where chains have
//!   been before, by the density of normal kernels about their draws that have the shape of the valley there.
//!   Chains begin in all modes that the start has met and at the ends of profiles of ln p along its widest
//!   directions, on which the first floors are sought (`profiles.rs`).
//!   Where floors are found far above that at the start, the start was no maximum: all begins again at the top above them.
//! - *Across* it: t ~ N(t̂, H⁻¹), weighted by w = p(s, t)/[m(s) N(t; t̂, H⁻¹)]. The mean weight of several such t is an
//!   unbiased estimate of p(s)/m(s); m times it in the acceptance, and a draw of one t by its weight, give exact draws of
//!   (s, t) (Andrieu & Roberts 2009, Annals of Statistics 37, 697). What m alone refuses needs no t: a proposal is accepted
//!   by m first and by the mean weight then (Christen & Fox 2005, J. Comput. Graph. Stat. 14, 795). Where weights are very
//!   unequal the stiffest directions, which bend along the other stiff ones, are drawn about maxima of their own, and all with
//!   Student's tails (`importance.rs`). A t of far too much weight would hold the chain where it is; so after each proposal t
//!   moves at the same s too.

mod chain_block;
mod importance;
mod kernel_density;
mod known_maximum;
mod neighbours;
mod position;
mod profiles;
mod sampler;
mod settings;
mod slow_directions;
mod surrogate;
mod surrogate_moves;
mod transport_map;

pub(crate) use sampler::Valley;
pub use settings::ValleySettings;
