//! Headers of FITS units, made safe for a reader that trusts them: characters, and the sizes that they declare.

use fitskit::Header;

use super::packed_image::MAX_COUNT;

/// A header consists of cards of this many bytes.
pub(super) const CARD_BYTES: usize = 80;

/// The same header where letters beyond ASCII in comments and texts, which the standard forbids, are question marks.
fn printable(header: &[u8]) -> std::result::Result<Vec<u8>, String> {
    let mut header = header.to_vec();
    for card in header.chunks_exact_mut(CARD_BYTES) {
        let is_comment = [b"COMMENT ", b"HISTORY ", b"        "].iter().any(|name| card.starts_with(*name));
        let text = card.iter().position(|byte| b"'/".contains(byte)).unwrap_or(CARD_BYTES);
        let from = if is_comment { 8 } else { text };
        for (place, byte) in card.iter_mut().enumerate() {
            match *byte {
                b' '..=b'~' => {}
                0x80.. if place >= from => *byte = b'?',
                _ => return Err("the header holds characters other than printable ASCII".into()),
            }
        }
    }
    Ok(header)
}

/// A header of whole blocks, its sizes checked; what is wrong with it otherwise.
pub(super) fn parsed_header(header: &[u8]) -> std::result::Result<Header, String> {
    let header = printable(header)?;
    let header = Header::read_from(&mut header.as_slice()).map_err(|error| error.to_string())?;
    for (name, limit) in [("NAXIS", MAX_COUNT), ("TFIELDS", MAX_COUNT), ("PCOUNT", i64::MAX), ("GCOUNT", 1)] {
        if let Some(value) = header.get_int(name).filter(|value| !(0..=limit).contains(value)) {
            return Err(format!("{name} is {value}, but must lie between 0 and {limit}"));
        }
    }
    Ok(header)
}

/// Bytes of data that a header declares: those of the standard, multiplied without overflow.
pub(super) fn declared_bytes(header: &Header) -> std::result::Result<u128, String> {
    let natural = |name: &str| match header.get_int(name) {
        Some(value) => {
            u128::try_from(value).map_err(|_| format!("{name} is {value}, but must not be negative"))
        }
        None => Err(format!("{name} is missing, or no integer")),
    };
    let bits = header.get_int("BITPIX").filter(|bits| [8, 16, 32, 64, -32, -64].contains(bits));
    let bits = bits.ok_or("BITPIX is not one of 8, 16, 32, 64, -32, -64")?.unsigned_abs();
    let axes = natural("NAXIS")?;
    if axes == 0 {
        return Ok(0);
    }
    let mut elements = 1_u128;
    for axis in 1..=axes {
        elements = elements.saturating_mul(natural(&format!("NAXIS{axis}"))?);
    }
    let heap = header.get_int("PCOUNT").unwrap_or(0).unsigned_abs();
    Ok(elements.saturating_add(heap.into()).saturating_mul(u128::from(bits) / 8))
}
