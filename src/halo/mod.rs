//! Haloes along the line of sight: relations, catalogue, draws, the shear cut.
