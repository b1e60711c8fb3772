//! Mutations of sound files: bytes, pieces, numbers and header cards; the same for the same seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::formats::{FORMATS, Format};

/// What stands in place of a number or a word.
const TOKENS: [&str; 26] = [
    "0",
    "-1",
    "1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "9223372036854775807",
    "18446744073709551616",
    "99999999999",
    "1e12",
    "",
    "\"",
    "'",
    ",",
    ";",
    "#",
    "{",
    "]",
    "null",
    "true",
    "\u{0}",
    "γ",
    "1e9",
];
/// Words of headers that decide what is read.
const CARDS: [&str; 20] = [
    "NAXIS", "NAXIS1", "NAXIS2", "BITPIX", "PCOUNT", "GCOUNT", "TFIELDS", "BSCALE", "BZERO", "BLANK",
    "CDELT1", "PIXSCALE", "EXPTIME", "PSFFWHM", "PSFTRUNC", "BKGRMS", "ZNAXIS1", "ZTILE1", "ZBITPIX",
    "TFORM1",
];

/// Trial number `trial` of a batch of this format.
pub fn mutated(format: &Format, batch: u64, trial: u64) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(batch);
    rng.set_stream(trial);
    let mut bytes = format.seeds[rng.random_range(0..format.seeds.len())].1.to_vec();
    mutate(&mut bytes, &mut rng);
    while rng.random_bool(0.4) {
        mutate(&mut bytes, &mut rng);
    }
    bytes
}

fn mutate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        return;
    }
    let length = bytes.len();
    // Headers and tables of contents stand in front and decide most.
    let reach = if rng.random_bool(0.5) { length.min(4096) } else { length };
    let at = rng.random_range(0..reach);
    let piece = at..(at + rng.random_range(1..=64)).min(length);
    match rng.random_range(0..10) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes[at] = rng.random(),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(piece)),
        4 => {
            let copy = bytes[piece].to_vec();
            bytes.splice(at..at, copy);
        }
        5 => {
            let fill = [0_u8, 0xff, 0x7f, 0x80, b' '][rng.random_range(0..5)];
            bytes[at..(at + rng.random_range(1..=8)).min(length)].fill(fill);
        }
        6 | 7 => replace_token(bytes, at, rng),
        8 => replace_card(bytes, rng),
        _ => {
            let other = &FORMATS[rng.random_range(0..FORMATS.len())];
            let other = other.seeds[rng.random_range(0..other.seeds.len())].1;
            let from = rng.random_range(0..other.len());
            let to = (from + rng.random_range(1..=512)).min(other.len());
            bytes.splice(at..at, other[from..to].iter().copied());
        }
    }
}

/// Puts another token in place of the number or word at or behind a place.
fn replace_token(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let is_of_token = |byte: &u8| byte.is_ascii_alphanumeric() || b".-+_".contains(byte);
    let Some(start) = bytes[at..].iter().position(is_of_token).map(|offset| at + offset) else { return };
    let end = bytes[start..].iter().position(|byte| !is_of_token(byte)).map_or(bytes.len(), |n| start + n);
    let token = TOKENS[rng.random_range(0..TOKENS.len())];
    bytes.splice(start..end, token.bytes());
}

/// Gives a card of a FITS header another value, and leaves the header as long as it was.
fn replace_card(bytes: &mut [u8], rng: &mut ChaCha8Rng) {
    let wanted = format!("{:<8}=", CARDS[rng.random_range(0..CARDS.len())]);
    let token = TOKENS[rng.random_range(0..TOKENS.len())];
    let found = bytes.chunks_exact_mut(80).find(|card| card.starts_with(wanted.as_bytes()));
    if let (Some(card), true) = (found, token.is_ascii()) {
        card[10..30].copy_from_slice(format!("{token:>20}").as_bytes());
    }
}
