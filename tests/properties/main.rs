//! What must hold whatever the numbers: invariances, theorems, statistics with fixed seeds, stated bounds.

mod any_cone;
#[path = "../support/cone.rs"]
mod cone;
#[path = "../support/derivatives.rs"]
mod derivatives;
mod statistics;
mod targets;

mod adaptive;
mod blind_start;
mod critical_curves;
mod einstein_radius;
mod few_of_everything;
mod fit_models;
mod mean_density;
mod mock_catalogue;
mod multiplane;
mod numerics;
mod pixels;
mod point_images;
mod population;
mod priors;
mod profiles;
mod rings;
mod sampler_errors;
mod samplers;
mod scores;
mod straight;
mod tensors;
mod tidal_lens;
mod watched;
