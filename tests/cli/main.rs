//! The command as a user runs it.

mod folder;
mod quick_run;
mod small_image;

mod catalogue;
mod columns;
mod ensembles;
mod errors;
mod fit;
mod image_inputs;
mod images;
mod interrupted;
mod lens;
mod lightcones;
mod pages;
mod runs;
mod stopped;
mod tables;
mod through_haloes;
mod validity;
