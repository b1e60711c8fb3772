//! Rows of a study that has been stopped before, and who keeps those that end.

use crate::error::Result;

/// Keeps the rows of an unfinished study; everything may be called from any thread.
pub trait RowStore<Row>: Sync {
    /// Row `number`, if an earlier attempt ended it.
    fn ended(&self, number: u64) -> Option<Row>;

    /// Told of every row that ends.
    ///
    /// # Errors
    /// A failed write that ends the study.
    fn keep(&self, number: u64, row: &Row) -> Result<()>;
}

impl<Row: Clone> dyn RowStore<Row> + '_ {
    /// The row that an earlier attempt ended, or else that of `work`, which is then kept.
    pub fn row(&self, number: u64, work: impl FnOnce() -> Result<Row>) -> Result<Row> {
        if let Some(row) = self.ended(number) {
            return Ok(row);
        }
        let row = work()?;
        self.keep(number, &row)?;
        Ok(row)
    }
}

/// Keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoRows;

impl<Row> RowStore<Row> for NoRows {
    fn ended(&self, _: u64) -> Option<Row> {
        None
    }

    fn keep(&self, _: u64, _: &Row) -> Result<()> {
        Ok(())
    }
}
