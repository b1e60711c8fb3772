//! Images packed into tables of compressed tiles (`.fits.fz`), checked before fitskit unpacks them.

use fitskit::{BinColumnType, BinTable, CompressedImage, Header, ImageData};

use super::input_file;

/// The standard allows no more axes and no more table columns than this.
pub(super) const MAX_COUNT: i64 = 999;

/// The image in a table of compressed tiles, whose size is compared with what can be packed into `packed_bytes`.
pub(super) fn decompress(
    header: &Header,
    table: &BinTable,
    packed_bytes: usize,
) -> std::result::Result<ImageData, String> {
    let method = header.get_string("ZCMPTYPE").unwrap_or("unknown").trim().to_string();
    if !["RICE_1", "RICE_ONE", "GZIP_1", "GZIP_2", "NOCOMPRESS"].contains(&method.as_str()) {
        return Err(format!(
            "is compressed by {method}; RICE_1, GZIP_1 and GZIP_2 are read, funpack unpacks all"
        ));
    }
    // fitskit 0.3 takes the shuffled bytes of such floats for floats.
    let is_in_steps = table.columns.iter().any(|column| column.name == "ZSCALE");
    if method == "GZIP_2" && header.get_int("ZBITPIX").is_some_and(|bits| bits < 0) && !is_in_steps {
        return Err(
            "is a lossless GZIP_2 of floats, which is not read; GZIP_1 is, funpack unpacks all".into()
        );
    }
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
    let image = CompressedImage::from_bintable(header, table).and_then(|tiles| tiles.decompress());
    image.map_err(|error| format!("cannot be unpacked: {error}"))
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
}
