//! Floating-point columns as hexadecimal text: a saved state gives back every bit, infinities included.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

/// Sixteen hexadecimal digits a number.
pub(super) fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    let text: String = values.iter().map(|value| format!("{:016x}", value.to_bits())).collect();
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

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize)]
    struct Column(#[serde(with = "super")] Vec<f64>);

    #[test]
    fn every_bit_survives_and_damage_is_noticed() {
        let values = vec![0.1, -0.0, f64::NEG_INFINITY, 1e-310, 1.0 / 3.0];
        let text = serde_json::to_string(&Column(values.clone())).unwrap();
        let Column(back) = serde_json::from_str(&text).unwrap();
        assert!(values.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(serde_json::from_str::<Column>(&text[..text.len() - 2]).is_err());
        assert!(serde_json::from_str::<Column>(&text.replace('9', "x")).is_err());
    }
}
