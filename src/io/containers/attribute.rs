//! Single values attached to files, groups and datasets.

/// A single value attached to a group, a dataset or the file.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValue {
    /// A number.
    F64(f64),
    /// An integer.
    I64(i64),
    /// An integer without sign, such as a seed.
    U64(u64),
    /// Text.
    Text(String),
}

impl From<f64> for AttributeValue {
    fn from(value: f64) -> Self {
        Self::F64(value)
    }
}

impl From<i64> for AttributeValue {
    fn from(value: i64) -> Self {
        Self::I64(value)
    }
}

impl From<&str> for AttributeValue {
    fn from(value: &str) -> Self {
        Self::Text(value.into())
    }
}
