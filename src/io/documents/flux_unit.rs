//! The unit of an image's pixels: the spellings of electrons a second that are in use, and what others are told.

use std::path::Path;

use fitskit::Header;

use crate::error::{Error, FileFault, Result, shortest};
use crate::io::containers::fits_file as fits;

const ELECTRONS: [&str; 6] = ["electron", "electrons", "elec", "e-", "e", "el"];
/// What cameras count; the gain says how many electrons one is.
const COUNTS: [&str; 7] = ["count", "counts", "cts", "adu", "dn", "ct", "c"];
const A_SECOND: [&str; 6] = ["/s", "/sec", "/second", "/seconds", "s-1", "sec-1"];
/// Keywords under which cameras give electrons per count.
const GAINS: [&str; 5] = ["GAIN", "CCDGAIN", "ATODGAIN", "EGAIN", "ADCGAIN"];

/// Refuses pixels that are not in electrons a second, with the factors that the header offers.
///
/// An image without `BUNIT` is taken to be in e⁻/s, and that is logged.
pub(super) fn check(path: &Path, header: &Header) -> Result<()> {
    let unit = header.get_string("BUNIT").map_or("", str::trim);
    if unit.is_empty() {
        log::info!("{}: states no BUNIT; its pixels are taken to be in electron/s", path.display());
        return Ok(());
    }
    let plain: String = unit.to_lowercase().chars().filter(|c| !" .*^()_".contains(*c)).collect();
    let per_pixel = ["/pixel", "/pix", "pixel-1", "pix-1"].iter().find_map(|end| plain.strip_suffix(end));
    let plain = per_pixel.unwrap_or(&plain);
    let a_second = A_SECOND.iter().find_map(|end| plain.strip_suffix(end));
    let counted = a_second.unwrap_or(plain);
    let (is_electrons, is_counts) =
        (ELECTRONS.contains(&counted), COUNTS.contains(&counted) || plain == "cps");
    if is_electrons && a_second.is_some() {
        return Ok(());
    }
    let mut steps = Vec::new();
    if is_counts {
        let gains = GAINS.iter().find_map(|name| Some((name, fits::number(path, header, name).ok()??)));
        let gain = gains.map(|(name, gain)| format!(" ({name} = {gain})")).unwrap_or_default();
        steps.push(format!("multiply by the electrons per count{gain}"));
    }
    if a_second.is_none() && plain != "cps" && (is_electrons || is_counts) {
        let time = fits::number(path, header, "EXPTIME").ok().flatten();
        let time = time.map(|time| format!(" (EXPTIME = {} s)", shortest(time))).unwrap_or_default();
        steps.push(format!("divide by the exposure time{time}"));
    }
    let what_to_do = if steps.is_empty() { "convert the pixels".into() } else { steps.join(", ") };
    let problem = format!("BUNIT is '{unit}', but must be 'electron/s': {what_to_do}");
    Err(Error::file(FileFault::Content, path, problem))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitskit::HeaderValue;

    fn fault(unit: &str, numbers: &[(&str, f64)]) -> Option<String> {
        let mut header = Header::new();
        header.set("BUNIT", HeaderValue::String(unit.into()), None);
        numbers.iter().for_each(|(name, value)| header.set(name, HeaderValue::Float(*value), None));
        check(Path::new("i.fits"), &header).err().map(|error| error.to_string())
    }

    #[test]
    fn electrons_a_second_have_many_spellings() {
        for unit in [
            "",
            "electron/s",
            "ELECTRONS/S",
            "electrons/sec",
            "e-/s",
            "e/s",
            "E-/SEC",
            "electron s-1",
            "electrons s^-1",
            "electron.s**(-1)",
            "electron s**-1",
            "e- / s",
            "electron/second",
            "electrons/s/pixel",
            "e- s-1 pix-1",
        ] {
            assert_eq!(fault(unit, &[]), None, "{unit}");
        }
    }

    #[test]
    fn other_units_are_refused_with_what_the_header_offers() {
        for (unit, wanted) in [
            ("electrons", "divide by the exposure time (EXPTIME = 2000 s)"),
            (
                "counts",
                "multiply by the electrons per count (CCDGAIN = 1.5), divide by the exposure time (EXPTIME = 2000 s)",
            ),
            ("count/s", "multiply by the electrons per count (CCDGAIN = 1.5)"),
            ("cps", "multiply by the electrons per count (CCDGAIN = 1.5)"),
            ("MJy/sr", "convert the pixels"),
        ] {
            let found = fault(unit, &[("CCDGAIN", 1.5), ("EXPTIME", 2000.0)]).unwrap();
            assert!(
                found.ends_with(&format!("BUNIT is '{unit}', but must be 'electron/s': {wanted}")),
                "{found}"
            );
        }
        assert!(
            fault("DN", &[])
                .unwrap()
                .ends_with("multiply by the electrons per count, divide by the exposure time")
        );
    }
}
