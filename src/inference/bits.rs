//! Floating-point columns as hexadecimal text: a saved state gives back every bit, infinities included.

use std::fmt::Write;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

/// Sixteen hexadecimal digits a number.
pub(super) fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    let mut text = String::with_capacity(16 * values.len());
    for value in values {
        write!(text, "{:016x}", value.to_bits()).expect("a string takes all");
    }
    serializer.serialize_str(&text)
}

/// Reads what [`serialize`] wrote.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let number = |digits: &[u8]| {
        let digits = std::str::from_utf8(digits).ok().filter(|digits| digits.len() == 16)?;
        u64::from_str_radix(digits, 16).ok().map(f64::from_bits)
    };
    let values: Option<Vec<f64>> = text.as_bytes().chunks(16).map(number).collect();
    values.ok_or_else(|| D::Error::custom("a column of numbers is damaged"))
}

/// One number.
pub(super) mod number {
    use serde::de::Error;
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        super::serialize(&[*value], serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        match super::deserialize(deserializer)?.as_slice() {
            [value] => Ok(*value),
            _ => Err(D::Error::custom("a number is damaged")),
        }
    }
}

/// Matrices and vectors of nalgebra: rows, columns and the numbers column by column.
pub(super) mod matrix {
    use nalgebra::{DMatrix, DVector};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Parts {
        rows: usize,
        columns: usize,
        #[serde(with = "super")]
        values: Vec<f64>,
    }

    /// What is saved as a matrix.
    pub trait Rectangle: Sized {
        /// Rows, columns and the numbers column by column.
        fn parts(&self) -> (usize, usize, &[f64]);
        /// The reverse; `None` where the parts do not fit together.
        fn of_parts(rows: usize, columns: usize, values: Vec<f64>) -> Option<Self>;
    }

    impl Rectangle for DMatrix<f64> {
        fn parts(&self) -> (usize, usize, &[f64]) {
            (self.nrows(), self.ncols(), self.as_slice())
        }

        fn of_parts(rows: usize, columns: usize, values: Vec<f64>) -> Option<Self> {
            (rows.checked_mul(columns) == Some(values.len())).then(|| Self::from_vec(rows, columns, values))
        }
    }

    impl Rectangle for DVector<f64> {
        fn parts(&self) -> (usize, usize, &[f64]) {
            (self.len(), 1, self.as_slice())
        }

        fn of_parts(rows: usize, columns: usize, values: Vec<f64>) -> Option<Self> {
            (columns == 1 && rows == values.len()).then(|| Self::from_vec(values))
        }
    }

    pub fn serialize<S: Serializer>(value: &impl Rectangle, serializer: S) -> Result<S::Ok, S::Error> {
        let (rows, columns, values) = value.parts();
        Parts { rows, columns, values: values.to_vec() }.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>, R: Rectangle>(deserializer: D) -> Result<R, D::Error> {
        let Parts { rows, columns, values } = Parts::deserialize(deserializer)?;
        R::of_parts(rows, columns, values).ok_or_else(|| D::Error::custom("a matrix is damaged"))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize)]
    struct Column(#[serde(with = "super")] Vec<f64>);

    #[derive(Serialize, Deserialize)]
    struct Number(#[serde(with = "super::number")] f64);

    #[derive(Serialize, Deserialize)]
    struct Matrices {
        #[serde(with = "super::matrix")]
        empty: DMatrix<f64>,
        #[serde(with = "super::matrix")]
        matrix: DMatrix<f64>,
        #[serde(with = "super::matrix")]
        vector: DVector<f64>,
    }

    #[test]
    fn matrices_come_back_with_their_shapes() {
        let matrix = DMatrix::from_fn(2, 3, |i, j| 1.0 / (1.0 + i as f64 + 10.0 * j as f64));
        let vector = DVector::from_vec(vec![0.1, f64::INFINITY]);
        let empty = DMatrix::zeros(4, 0);
        let saved = Matrices { empty: empty.clone(), matrix: matrix.clone(), vector: vector.clone() };
        let text = serde_json::to_string(&saved).unwrap();
        let back: Matrices = serde_json::from_str(&text).unwrap();
        assert!(back.empty == empty && back.matrix == matrix && back.vector == vector);
        assert!(serde_json::from_str::<Matrices>(&text.replace("\"columns\":3", "\"columns\":2")).is_err());
    }

    #[test]
    fn every_bit_survives_and_damage_is_noticed() {
        let values = vec![0.1, -0.0, f64::NEG_INFINITY, 1e-310, 1.0 / 3.0];
        let text = serde_json::to_string(&Column(values.clone())).unwrap();
        let Column(back) = serde_json::from_str(&text).unwrap();
        assert!(values.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(serde_json::from_str::<Column>(&text[..text.len() - 2]).is_err());
        assert!(serde_json::from_str::<Column>(&text.replace('9', "x")).is_err());
        assert!(serde_json::from_str::<Number>(&text).is_err());
        let one = serde_json::to_string(&Number(f64::NEG_INFINITY)).unwrap();
        assert_eq!(serde_json::from_str::<Number>(&one).unwrap().0, f64::NEG_INFINITY);
    }
}
