//! Units of the columns of a FITS table.

use std::path::Path;

use fitskit::{BinColumn, Header};

use super::astropy_meta;
use crate::error::{Error, FileFault, Result};

/// The unit of each column: its TUNIT, or where FITS has no name for it (`solMass / littleh`) what astropy says in comments.
pub(super) fn column_units(
    path: &Path,
    header: &Header,
    columns: &[BinColumn],
) -> Result<Vec<Option<String>>> {
    /// Characters of a comment; a line of more goes on behind a backslash.
    const COMMENT_LENGTH: usize = 70;
    const BEGIN: &str = "--BEGIN-ASTROPY-SERIALIZED-COLUMNS--";
    const END: &str = "--END-ASTROPY-SERIALIZED-COLUMNS--";
    let comments = header.iter().filter(|card| card.name == "COMMENT");
    let mut text = String::new();
    for line in
        comments.map(|card| card.comment.as_deref().unwrap_or_default()).skip_while(|line| *line != BEGIN)
    {
        match line.char_indices().nth(COMMENT_LENGTH) {
            _ if line == BEGIN => {}
            _ if line == END => break,
            Some((end, _)) => text += &line[..end],
            None => text = text + line + "\n",
        }
    }
    let lines: Vec<&str> = text.lines().collect();
    let damaged = |problem| {
        Error::file(FileFault::Damaged, path, format!("astropy's description in comments {problem}"))
    };
    let described = match lines.is_empty() {
        true => Vec::new(),
        false => astropy_meta::column_units(&lines).map_err(damaged)?,
    };
    let unit = |(i, column): (usize, &BinColumn)| {
        let keyword = format!("TUNIT{}", i + 1);
        if let (None, Some(card)) = (header.get_string(&keyword), header.find(&keyword)) {
            let value = card.value.as_ref().map_or_else(|| "empty".into(), ToString::to_string);
            let problem = format!("keyword {keyword} is {value}, but must be text");
            return Err(Error::file(FileFault::Content, path, problem));
        }
        let stated = column.tunit.clone().filter(|unit| !unit.trim().is_empty());
        let named = described.iter().find(|(name, _)| *name == column.name.trim());
        Ok(stated.or_else(|| named?.1.clone()))
    };
    columns.iter().enumerate().map(unit).collect()
}

#[cfg(test)]
mod tests {
    use fitskit::BinColumnType;

    use super::*;

    #[test]
    fn units_come_from_their_keywords_or_from_comments_of_astropy_and_blank_ones_are_none() {
        let column = |name: &str, tunit: Option<&str>| {
            let tunit = tunit.map(String::from);
            BinColumn { name: name.into(), format: BinColumnType::D64(1), tscal: 1.0, tzero: 0.0, tunit }
        };
        let long = format!("- {{name: {}, unit: Mpc, datatype: float64}}", "long".repeat(20));
        let columns = [
            column("z", Some(" ")),
            column("theta_x_arcsec", Some("mas")),
            column("m200c_msun", None),
            column(&"long".repeat(20), None),
        ];
        let mut header = Header::new();
        for line in [
            "by somebody",
            "--BEGIN-ASTROPY-SERIALIZED-COLUMNS--",
            "datatype:",
            "- {name: z, datatype: float64}",
            "- {name: theta_x_arcsec, unit: mas, datatype: float64}",
            "- {name: m200c_msun, unit: solMass / littleh, datatype: float64}",
            &format!("{}\\", &long[..70]),
            &long[70..],
            "meta: !!omap",
            "--END-ASTROPY-SERIALIZED-COLUMNS--",
            "and more",
        ] {
            header.push(fitskit::Keyword::commentary("COMMENT", line));
        }
        let path = Path::new("t.fits");
        let found = column_units(path, &header, &columns).unwrap();
        assert_eq!(
            found,
            [None, Some("mas"), Some("solMass / littleh"), Some("Mpc")].map(|u| u.map(String::from))
        );
        assert_eq!(column_units(path, &Header::new(), &columns[..2]).unwrap(), [None, Some("mas".into())]);
        let mut numeric = Header::new();
        numeric.set("TUNIT2", fitskit::HeaderValue::Integer(1000), None);
        let error = column_units(path, &numeric, &columns).unwrap_err().to_string();
        assert!(error.contains("keyword TUNIT2 is 1000, but must be text"), "{error}");
        header.keywords[2].comment = Some("nothing:".into());
        let error = column_units(path, &header, &columns).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains("no list datatype"), "{error}");
    }
}
