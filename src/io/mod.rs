//! Files in and out: containers hold columns, images and metadata; documents say what these mean to haloray.

mod containers;
mod documents;

pub(crate) use containers::shell_word;
pub use containers::{
    AttributeValue, Column, FigureFiles, Provenance, RecordLog, Replace, RunFile, RunFileReader, Saved,
    Staging, TIMINGS, Table, Values, check_own, check_writable, files_of_run, folders_written_to, hash,
    is_of_a_run, read_checkpoint, read_text, remove_temporaries, write_atomically, write_checkpoint,
    write_hdf5_atomically, write_text,
};
pub use documents::*;
