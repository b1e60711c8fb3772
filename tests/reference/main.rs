//! Numbers against those of other codes, read from `data/reference`.

#[path = "../support/cone.rs"]
mod cone;
mod differences;
mod oracle_table;

mod composite_image;
mod convergence;
mod cosmology;
mod halo_relations;
mod image;
mod images;
mod lens_models;
mod lensing;
mod likelihood;
mod multiplane;
mod portable;
mod table_a1;
