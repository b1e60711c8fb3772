//! Where a result comes from: version, git revision, seed and the resolved configuration.

/// What every output file stores, so that the run can be repeated.
///
/// Paths, thread counts, host names and times are left out on purpose: the same seed must give
/// the same bytes everywhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Version of haloray.
    pub version: String,
    /// Git revision the binary was built from (12 digits), or `unknown` outside git.
    pub git_revision: String,
    /// Seed of the random streams, where there are any.
    pub seed: Option<u64>,
    /// The resolved configuration as TOML; empty where a command has none.
    pub config_toml: String,
}

impl Provenance {
    /// Provenance of a result made by this build with this seed and resolved configuration.
    ///
    /// ```
    /// let provenance = haloray::io::Provenance::new(Some(42), "field_radius_arcsec = 3.6\n");
    /// assert!(provenance.to_toml().contains("seed = 42"));
    /// ```
    pub fn new(seed: Option<u64>, config_toml: impl Into<String>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            git_revision: env!("HALORAY_GIT_REVISION").into(),
            seed,
            config_toml: config_toml.into(),
        }
    }

    /// The TOML text laid beside outputs that cannot hold it themselves, such as CSV.
    ///
    /// TOML integers end at 2⁶³−1; a larger seed is written as a string.
    pub fn to_toml(&self) -> String {
        let mut table = toml::Table::new();
        table.insert("version".into(), self.version.clone().into());
        table.insert("git_revision".into(), self.git_revision.clone().into());
        if let Some(seed) = self.seed {
            let seed = i64::try_from(seed).map_or_else(|_| seed.to_string().into(), toml::Value::from);
            table.insert("seed".into(), seed);
        }
        table.insert("config_toml".into(), self.config_toml.clone().into());
        table.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_revision_is_twelve_hexadecimal_digits_or_unknown() {
        let revision = Provenance::new(None, "").git_revision;
        let is_hash = revision.len() == 12 && revision.bytes().all(|b| b.is_ascii_hexdigit());
        assert!(is_hash || revision == "unknown", "{revision}");
    }

    #[test]
    fn toml_text_is_read_back_unchanged() {
        let config = "name = \"a 'quoted' \\\"text\\\"\"\n[cosmology]\nh0_km_s_mpc = 67.4 # γ\n";
        let provenance = Provenance::new(Some(7), config);
        let table: toml::Table = provenance.to_toml().parse().unwrap();
        assert_eq!(table["config_toml"].as_str(), Some(config));
        assert_eq!(table["seed"].as_integer(), Some(7));
        assert_eq!(table["version"].as_str(), Some(env!("CARGO_PKG_VERSION")));
    }

    #[test]
    fn the_largest_seed_survives() {
        let text = Provenance::new(Some(u64::MAX), "").to_toml();
        let table: toml::Table = text.parse().unwrap();
        assert_eq!(table["seed"].as_str(), Some("18446744073709551615"));
    }
}
