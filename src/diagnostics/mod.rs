//! What the line of sight does: per-halo tidal variation, od/os/ds/LOS tensors, maps.
