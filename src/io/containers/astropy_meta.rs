//! What astropy writes about a table's columns in YAML: in the header of ECSV files and beside tables in HDF5.

use saphyr::{LoadableYamlNode, Yaml};

/// Name and unit of every column, from the list `datatype` of the lines; what is wrong with them otherwise.
pub(super) fn column_units(lines: &[&str]) -> Result<Vec<(String, Option<String>)>, String> {
    // Only this list is read: what follows it may be of any type and size.
    let start = lines.iter().position(|line| line.trim_end() == "datatype:");
    let list = &lines[start.ok_or("has no list datatype")?..];
    let end =
        list.iter().skip(1).position(|line| !line.starts_with(['-', ' '])).map_or(list.len(), |n| n + 1);
    let text = list[..end].join("\n");
    if text.contains('&') {
        return Err("refers to itself".into());
    }
    let documents = Yaml::load_from_str(&text).map_err(|error| error.to_string())?;
    let columns = documents.first().and_then(|document| document.as_mapping_get("datatype")?.as_sequence());
    let text = |column: &Yaml, key: &str| column.as_mapping_get(key)?.as_str().map(String::from);
    let column = |column| Some((text(column, "name")?, text(column, "unit")));
    let named: Option<Vec<_>> =
        columns.map_or(&[][..], |columns| columns.as_slice()).iter().map(column).collect();
    named.filter(|columns| !columns.is_empty()).ok_or_else(|| "names no columns".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_in_both_layouts_of_the_list() {
        let lines = [
            "%ECSV 1.0",
            "---",
            "datatype:",
            "- {name: z, datatype: float64}",
            "- {name: 'theta x', unit: \"deg\", datatype: float64}",
            "- name: m200c_msun",
            "  unit: solMass",
            "  datatype: float64",
            "meta: !!omap",
            "- x: &id001 !astropy.units.Unit {unit: deg}",
        ];
        let found = column_units(&lines).unwrap();
        let unit = |text: &str| Some(text.to_string());
        assert_eq!(
            found,
            [("z".into(), None), ("theta x".into(), unit("deg")), ("m200c_msun".into(), unit("solMass"))]
        );
        assert!(column_units(&lines[..2]).unwrap_err().contains("no list datatype"));
        assert!(column_units(&["datatype:", "- {name: ["]).is_err());
        assert!(column_units(&["datatype:", "- 3"]).unwrap_err().contains("names no columns"));
    }
}
