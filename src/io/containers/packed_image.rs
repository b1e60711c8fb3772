//! Images packed into tables of compressed tiles (`.fits.fz`), checked before fitskit unpacks them.

use std::io::Read;

use fitskit::{
    BinCellValue, BinColumn, BinColumnType, BinTable, CompressedImage, Header, HeaderValue, ImageData,
};
use flate2::read::GzDecoder;

use super::input_file;

/// The standard allows no more axes and no more table columns than this.
pub(super) const MAX_COUNT: i64 = 999;

/// The column of packed tiles.
const TILES: &str = "COMPRESSED_DATA";

/// How the tiles are compressed, as their header says.
fn method_of(header: &Header) -> &str {
    header.get_string("ZCMPTYPE").unwrap_or("unknown").trim()
}

/// What to say of an image in tiles compressed by a method that is not read.
pub(crate) fn other_method(header: &Header) -> Option<String> {
    let method = method_of(header);
    let is_read = ["RICE_1", "RICE_ONE", "GZIP_1", "GZIP_2", "NOCOMPRESS"].contains(&method);
    (CompressedImage::detect(header) && !is_read).then(|| {
        format!("is compressed by {method}; RICE_1, GZIP_1 and GZIP_2 are read, funpack unpacks all")
    })
}

/// The image in a table of compressed tiles, whose size is compared with what can be packed into `packed_bytes`.
pub(super) fn decompress(
    header: &Header,
    table: &BinTable,
    packed_bytes: usize,
) -> std::result::Result<ImageData, String> {
    let axes = header
        .get_int("ZNAXIS")
        .filter(|axes| (1..=MAX_COUNT).contains(axes))
        .ok_or("ZNAXIS is no number of axes")?;
    let mut bytes = 8_u128;
    for axis in 1..=axes {
        let length = header.get_int(&format!("ZNAXIS{axis}")).and_then(|length| u128::try_from(length).ok());
        bytes = bytes.saturating_mul(length.ok_or_else(|| format!("ZNAXIS{axis} is no length"))?);
        let tile = format!("ZTILE{axis}");
        if header.find(&tile).is_some()
            && header.get_int(&tile).is_none_or(|tile| tile < 1 || tile > i64::from(i32::MAX))
        {
            return Err(format!("{tile} is no length"));
        }
    }
    if bytes > input_file::largest_content_bytes(packed_bytes) as u128 {
        return Err(format!(
            "{bytes} bytes of pixels are declared, more than {packed_bytes} packed bytes or memory can hold"
        ));
    }
    for parameter in 1..=MAX_COUNT {
        let Some(name) = header.get_string(&format!("ZNAME{parameter}")) else { break };
        let allowed: &[i64] = match name.trim() {
            "BLOCKSIZE" => &[16, 32],
            "BYTEPIX" => &[1, 2, 4, 8],
            _ => continue,
        };
        if header.get_int(&format!("ZVAL{parameter}")).is_none_or(|value| !allowed.contains(&value)) {
            return Err(format!("ZVAL{parameter}, the {}, must be one of {allowed:?}", name.trim()));
        }
    }
    check_heap(table)?;
    // fitskit takes cells of any other type for packed bytes too.
    let is_of_arrays =
        |column: &BinColumn| matches!(column.format, BinColumnType::VarP(_) | BinColumnType::VarQ(_));
    if !table.columns.iter().find(|column| column.name == TILES).is_some_and(is_of_arrays) {
        return Err(format!("has no column {TILES} of arrays"));
    }
    let float_bytes = match header.get_int("ZBITPIX") {
        Some(-32) => 4,
        Some(-64) => 8,
        _ => 0,
    };
    let method = method_of(header);
    let plain = match float_bytes > 0 && method.starts_with("GZIP") {
        true => Some(plain_floats(header, table, (float_bytes, method == "GZIP_2"), bytes as usize)?),
        false => None,
    };
    let (header, table) = plain.as_ref().map_or((header, table), |(header, table)| (header, table));
    let image = CompressedImage::from_bintable(header, table).and_then(|tiles| tiles.decompress());
    image.map_err(|error| format!("cannot be unpacked: {error}"))
}

/// The same tiles of floats, not packed by gzip any more: fitskit 0.3 takes steps, integers of 32 bits, for as wide as the
/// floats, and shuffled bytes of floats for floats. All tiles together have at most `left` bytes.
fn plain_floats(
    header: &Header,
    table: &BinTable,
    (float_bytes, is_shuffled): (usize, bool),
    mut left: usize,
) -> std::result::Result<(Header, BinTable), String> {
    let place = |name: &str| {
        let column = table.columns.iter().position(|column| column.name == name)?;
        let before: usize = table.columns[..column].iter().map(|own| own.format.byte_size()).sum();
        Some((column, before..before + table.columns[column].format.byte_size()))
    };
    let (tiles, cell) = place(TILES).ok_or_else(|| format!("has no column {TILES}"))?;
    let scale = place("ZSCALE").map(|(_, scale)| scale);
    let has_one_scale = header.get_float("ZSCALE").is_some_and(|scale| scale != 0.0);
    let (mut header, mut plain) = (header.clone(), table.clone());
    header.set("ZCMPTYPE", HeaderValue::String("NOCOMPRESS".into()), None);
    if scale.iter().chain([&cell]).any(|place| place.end > table.row_len) {
        return Err("the columns are wider than a row".into());
    }
    for (row, cells) in plain.main_data.chunks_exact_mut(table.row_len.max(1)).enumerate() {
        let Ok(BinCellValue::Bytes(packed)) = table.get_cell(row, tiles) else {
            return Err(format!("row {} of {TILES} has no bytes", row + 1));
        };
        // Tiles of scale 0 are floats as they are.
        let own_scale = scale.clone().map(|scale| cells[scale].iter().any(|byte| *byte != 0));
        let are_steps = own_scale.unwrap_or(has_one_scale);
        let width = if are_steps { 4 } else { float_bytes };
        let mut raw = Vec::new();
        if !packed.is_empty() {
            let unpacked = GzDecoder::new(packed.as_slice()).take(left as u64).read_to_end(&mut raw);
            unpacked.map_err(|error| format!("tile {} cannot be unpacked: {error}", row + 1))?;
        }
        left -= raw.len();
        if is_shuffled {
            // The first bytes of all numbers, then their second ones, ….
            let count = raw.len() / width;
            raw = (0..count * width).map(|i| raw[i % width * count + i / width]).collect();
        }
        if are_steps && float_bytes == 8 {
            let (steps, _) = raw.as_chunks();
            raw = steps.iter().flat_map(|step| i64::from(i32::from_be_bytes(*step)).to_be_bytes()).collect();
        }
        let (count, offset) = cells[cell.clone()].split_at_mut(cell.len() / 2);
        for (number, half) in [(raw.len(), count), (plain.heap.len(), offset)] {
            let own = (number as u64).to_be_bytes();
            let (above, own) = own.split_at(own.len() - half.len());
            if above.iter().any(|byte| *byte != 0) || own[0] > i8::MAX as u8 {
                return Err(
                    "has more bytes of pixels than its descriptors can count; funpack unpacks it".into()
                );
            }
            half.copy_from_slice(own);
        }
        plain.heap.extend(raw);
    }
    Ok((header, plain))
}

/// Refuses arrays outside the heap: fitskit 0.3 adds up counts and offsets as they are, negative ones too.
fn check_heap(table: &BinTable) -> std::result::Result<(), String> {
    let mut at = 0;
    for column in &table.columns {
        let width = column.format.byte_size();
        let (BinColumnType::VarP(element) | BinColumnType::VarQ(element)) = column.format else {
            at += width;
            continue;
        };
        let element_bytes = match element {
            'I' => 2,
            'J' | 'E' => 4,
            'K' | 'D' | 'C' => 8,
            'M' => 16,
            _ => 1,
        };
        for (row, cells) in table.main_data.chunks_exact(table.row_len.max(1)).enumerate() {
            let cell = cells.get(at..at + width).ok_or("the columns are wider than a row")?;
            let number = |half: &[u8]| half.iter().fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
            let (count, offset) = cell.split_at(width / 2);
            let (count, offset) = (number(count), number(offset));
            let end = u128::from(count) * element_bytes + u128::from(offset);
            if count > 0 && end > table.heap.len() as u128 {
                return Err(format!(
                    "column {}, row {}: {count} elements from byte {offset} on are not in the heap of {} bytes",
                    column.name,
                    row + 1,
                    table.heap.len()
                ));
            }
        }
        at += width;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::fits_file::read;
    use std::path::Path;

    #[test]
    fn arrays_outside_the_heap_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packed.fits.fz");
        let sound = std::fs::read(Path::new("data/inputs/rice_1.fits.fz")).unwrap();
        // The first tile's count and offset: four bytes each where the data of the table begin.
        let end = |from: usize| {
            let cards = sound[from..].chunks_exact(80);
            (from + 80 * cards.take_while(|card| card.trim_ascii_end() != b"END").count() + 80)
                .next_multiple_of(2880)
        };
        let data = end(end(0));
        let with = |place: usize, bytes: [u8; 4]| {
            let mut damaged = sound.clone();
            damaged[data + place..data + place + 4].copy_from_slice(&bytes);
            std::fs::write(&path, damaged).unwrap();
            read(&path).map_err(|error| error.to_string())
        };
        let first = |place: usize| sound[data + place..data + place + 4].try_into().unwrap();
        assert!(with(0, first(0)).is_ok());
        for (place, bytes) in [(0, [0xff; 4]), (4, [0xff; 4]), (4, [0x80, 0, 0, 0]), (0, [0, 0x10, 0, 0])] {
            let error = with(place, bytes).unwrap_err();
            assert!(error.contains("row 1: ") && error.contains("not in the heap of"), "{error}");
        }
    }

    #[test]
    fn tables_whose_tiles_are_no_arrays_or_whose_columns_leave_the_row_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packed.fits.fz");
        for name in
            ["rice_1.fits.fz", "gzip_1_steps.fits.fz", "gzip_2_steps.fits.fz", "gzip_2_lossless.fits.fz"]
        {
            let sound = std::fs::read(Path::new("data/inputs").join(name)).unwrap();
            // The first card of that keyword in the table's header, the value put in its place.
            let with = |keyword: &str, value: &str| {
                let mut damaged = sound.clone();
                let card =
                    (2880..).step_by(80).find(|at| damaged[*at..].starts_with(keyword.as_bytes())).unwrap();
                damaged[card..card + 80].copy_from_slice(format!("{keyword:<8}= {value:<70}").as_bytes());
                std::fs::write(&path, damaged).unwrap();
                read(&path).map(|_| ()).map_err(|error| error.to_string())
            };
            assert!(with("TTYPE1", "'COMPRESSED_DATA'").is_ok(), "{name}");
            for (keyword, value, wanted) in [
                ("TFORM1", "'8B'", "has no column COMPRESSED_DATA of arrays"),
                ("TTYPE1", "'TILES'", "has no column COMPRESSED_DATA of arrays"),
                ("NAXIS1", "7", "are wider than a row"),
            ] {
                let error = with(keyword, value).unwrap_err();
                assert!(
                    error.contains(wanted) && error.contains("packed.fits.fz"),
                    "{name}, {value}: {error}"
                );
            }
        }
    }
}
