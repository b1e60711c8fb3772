"""Drawing of plain arrays: what figures of saved results, above, and objects that draw themselves share."""
