//! What to cite: the experiment, and the relations that a configuration names.

/// The experiment.
const ALWAYS: [&str; 1] = [
    "Hogg N. B., Fleury P., Larena J., Martinelli M., 2023, MNRAS, 520, 5982 (arXiv:2210.07210): the experiment",
];

/// Words of a configuration and whom they owe.
const OWED: [(&str, &str); 12] = [
    ("\"tinker08\"", "Tinker J. et al., 2008, ApJ, 688, 709: the mass function"),
    ("\"sheth99\"", "Sheth R. K., Tormen G., 1999, MNRAS, 308, 119: the mass function"),
    ("\"press74\"", "Press W. H., Schechter P., 1974, ApJ, 187, 425: the mass function"),
    ("\"diemer19\"", "Diemer B., Joyce M., 2019, ApJ, 871, 168: concentrations"),
    ("\"diemer15\"", "Diemer B., Kravtsov A. V., 2015, ApJ, 799, 108: concentrations"),
    ("\"duffy08\"", "Duffy A. R. et al., 2008, MNRAS, 390, L64: concentrations"),
    ("\"truncated-nfw\"", "Baltz E. A., Marshall P., Oguri M., 2009, JCAP, 01, 015: truncated haloes"),
    ("[structure]", "Eisenstein D. J., Hu W., 1998, ApJ, 496, 605: the linear power spectrum"),
    ("model = \"minimal\"", "Fleury P., Larena J., Uzan J.-P., 2021, JCAP, 08, 024: the minimal model"),
    (
        "model = \"flexion",
        "Duboscq T., Hogg N. B., Fleury P., Larena J., 2024 (arXiv:2405.12091): the flexion model",
    ),
    ("\"EPL\"", "Tessore N., Metcalf R. B., 2015, A&A, 580, A79: the elliptical power law"),
    ("[lens]", "Tessore N., Metcalf R. B., 2015, A&A, 580, A79: the elliptical power law"),
];

/// For a run of that configuration or model.
pub(super) fn citations(configuration: &str) -> Vec<&'static str> {
    let owed = OWED.iter().filter(|(word, _)| configuration.contains(word)).map(|(_, work)| *work);
    let mut works: Vec<&str> = ALWAYS.into_iter().chain(owed).collect();
    works.dedup();
    works
}
