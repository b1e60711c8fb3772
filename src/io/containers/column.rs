//! One column of a table.

/// What a column holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; integers are read as f64.
    F64(Vec<f64>),
    /// Text, and integers too long for an f64.
    Text(Vec<String>),
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Integers as numbers where each is exact as f64, else (long catalogue numbers) as text.
    pub(super) fn from_integers<T: Copy + Into<i128>>(integers: &[T]) -> Self {
        if integers.iter().all(|&v| is_exact(v.into())) {
            Self::F64(integers.iter().map(|&v| v.into() as f64).collect())
        } else {
            Self::Text(integers.iter().map(|&v| v.into().to_string()).collect())
        }
    }
}

/// True where an f64 holds the integer to the last digit.
pub(super) fn is_exact(integer: i128) -> bool {
    integer as f64 as i128 == integer
}

/// What is wrong with a text that is no number.
pub(super) fn no_number(text: &str) -> String {
    let reads_with = |from: char, to: &str| {
        text.matches(from).count() == 1 && text.replace(from, to).parse::<f64>().is_ok()
    };
    let cure = match text {
        _ if reads_with(',', ".") => "; write a decimal point",
        _ if reads_with('D', "e") || reads_with('d', "e") => "; write the exponent of Fortran with e",
        _ => "",
    };
    format!("{text:?} is not a number{cure}")
}

/// One named column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, ending in its unit as everywhere in haloray (`theta_x_arcsec`).
    pub name: String,
    /// Unit for the formats that store one (HDF5 attribute `unit`, FITS `TUNITn`).
    pub unit: Option<String>,
    /// The values, one a row.
    pub values: Values,
}

impl Column {
    /// A column of numbers.
    pub fn f64(name: &str, unit: Option<&str>, values: Vec<f64>) -> Self {
        Self { name: name.into(), unit: unit.map(Into::into), values: Values::F64(values) }
    }

    /// A column of text.
    pub fn text(name: &str, values: Vec<String>) -> Self {
        Self { name: name.into(), unit: None, values: Values::Text(values) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_integers_stay_text_and_short_ones_become_numbers() {
        assert_eq!(
            Values::from_integers(&[1_i64 << 53, -3]),
            Values::F64(vec![9_007_199_254_740_992.0, -3.0])
        );
        let long = Values::from_integers(&[u64::MAX, 1]);
        assert_eq!(long, Values::Text(vec!["18446744073709551615".into(), "1".into()]));
    }
}
