//! Files in and out: containers hold columns, images and metadata; documents say what these mean to haloray.

mod containers;
mod documents;

pub use containers::{
    AttributeValue, Column, Provenance, RunFile, Saved, Staging, Table, Values, check_writable, hash,
    read_checkpoint, write_atomically, write_checkpoint,
};
pub use documents::*;
