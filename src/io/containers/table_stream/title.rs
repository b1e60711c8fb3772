//! What a stream of rows says of its columns.

/// Rows that are in memory together, more or less.
pub(super) const BATCH_ROWS: u64 = 1 << 19;

/// Name and stated unit of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnTitle {
    /// Name.
    pub name: String,
    /// Unit, where the file states one.
    pub unit: Option<String>,
}
