//! Files in and out: tables, images, runs; nothing half-written under its final name.
