//! Parts of an ensemble put together: the same bytes as if one process had computed all of it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::columns::stacks_of;
use super::plan::Level;
use crate::config::Config;
use crate::error::{Error, FileFault, Result};
use crate::io::{SavedStacks, SightlineColumn, SightlineTable, StackRows, StackSpec};

/// A whole ensemble and where its rows came from.
pub struct Merged {
    /// The table of all.
    pub table: SightlineTable,
    /// Parts whose rows other parts have too, bit by bit.
    pub duplicates: Vec<PathBuf>,
    specs: Vec<StackSpec>,
    /// Part and row numbers of that part, by number.
    origin: BTreeMap<u64, usize>,
    parts: Vec<(PathBuf, Vec<u64>)>,
    /// The part whose maps and images are open.
    open: RefCell<Option<(usize, SavedStacks)>>,
}

/// Merges the tables at `paths`.
///
/// Parts are shards of one ensemble, or ensembles that continue one another; rows that occur twice must agree.
///
/// # Errors
/// Parts of different versions, seeds, configurations, lenses, levels or models; ensembles that overlap without being the
/// same; rows that differ; sightlines that no part has.
pub fn merge(paths: &[PathBuf]) -> Result<Merged> {
    let tables: Vec<SightlineTable> =
        paths.iter().map(|path| SightlineTable::read(path)).collect::<Result<_>>()?;
    let Some(first) = tables.first() else {
        return Err(Error::out_of_range("number of parts to merge", 0, "at least 1"));
    };
    for (path, table) in paths.iter().zip(&tables).skip(1) {
        check_alike(&paths[0], first, path, table)?;
    }
    let whole = whole_of(paths, &tables)?;
    let (origin, duplicates) = origin_of(paths, &tables)?;
    let missing: Vec<u64> = whole.clone().filter(|number| !origin.contains_key(number)).collect();
    if !missing.is_empty() {
        let problem = format!(
            "{} of {} sightlines are in no part: {}",
            missing.len(),
            whole.end - whole.start,
            ranges(&missing)
        );
        return Err(Error::file(FileFault::Content, &paths[0], problem));
    }
    let specs = specs_of(&paths[0], first)?;
    let table = joined(&tables, whole, &origin);
    let parts = paths.iter().cloned().zip(tables.into_iter().map(|table| table.numbers)).collect();
    Ok(Merged { table, duplicates, specs, origin, parts, open: RefCell::new(None) })
}

impl Merged {
    /// The maps and images of the ensemble.
    pub fn specs(&self) -> &[StackSpec] {
        &self.specs
    }
}

impl StackRows for Merged {
    fn pixels(&self, stack: usize, number: u64) -> Result<Vec<f32>> {
        let mut open = self.open.borrow_mut();
        let part = self.origin.get(&number).copied().unwrap_or_default();
        let saved = match open.take() {
            Some((own, saved)) if own == part => saved,
            _ => {
                let (path, numbers) = &self.parts[part];
                SavedStacks::open(path, self.specs.clone(), numbers.clone())?
            }
        };
        let (_, saved) = open.insert((part, saved));
        saved.pixels(stack, number)
    }
}

/// The maps and images of a saved table.
fn specs_of(path: &Path, table: &SightlineTable) -> Result<Vec<StackSpec>> {
    let level: Level = table.level.parse()?;
    if level == Level::Scalars {
        return Ok(Vec::new());
    }
    let config: Config = toml::from_str(&table.provenance.config_toml).map_err(|error| {
        Error::file(FileFault::Content, path, format!("holds no configuration of a run: {error}"))
    })?;
    Ok(stacks_of(&config, level))
}

/// Refuses parts that are not of the same making.
fn check_alike(first_path: &Path, first: &SightlineTable, path: &Path, table: &SightlineTable) -> Result<()> {
    let (a, b) = (&first.provenance, &table.provenance);
    let names = |table: &SightlineTable| -> Vec<String> {
        let columns = table.all_haloes.iter().chain(&table.tidal_haloes);
        columns.map(|column| column.name.clone()).collect()
    };
    let differences = [
        ("version of haloray", (&a.version, &a.git_revision) != (&b.version, &b.git_revision)),
        ("seed", a.seed != b.seed),
        ("configuration", a.config_toml != b.config_toml),
        ("content of the files it names", first.inputs != table.inputs),
        ("table of lenses", first.lenses != table.lenses),
        ("level", first.level != table.level),
        ("model", first.model != table.model),
        ("set of columns", names(first) != names(table)),
    ];
    match differences.iter().find(|(_, differs)| *differs) {
        None => Ok(()),
        Some((what, _)) => {
            let problem = format!("has another {what} than {}", first_path.display());
            Err(Error::file(FileFault::Content, path, problem))
        }
    }
}

/// All numbers: of the ensemble whose shards these are, or of ensembles that continue one another.
fn whole_of(paths: &[PathBuf], tables: &[SightlineTable]) -> Result<Range<u64>> {
    let mut wholes: Vec<(&Range<u64>, &PathBuf)> =
        tables.iter().map(|table| &table.whole).zip(paths).collect();
    wholes.sort_by_key(|(whole, _)| (whole.start, whole.end));
    wholes.dedup_by_key(|(whole, _)| *whole);
    for pair in wholes.windows(2) {
        let [(before, one), (after, other)] = pair else { continue };
        if after.start < before.end {
            let problem = format!(
                "is of the sightlines {} to {}, which overlap with {} to {} of {} and are not the same ensemble",
                after.start,
                after.end - 1,
                before.start,
                before.end - 1,
                one.display()
            );
            return Err(Error::file(FileFault::Content, other, problem));
        }
    }
    let start = wholes.first().map_or(0, |(whole, _)| whole.start);
    Ok(start..wholes.last().map_or(0, |(whole, _)| whole.end))
}

/// Which part each row is taken from, and the parts that bring nothing new.
fn origin_of(paths: &[PathBuf], tables: &[SightlineTable]) -> Result<(BTreeMap<u64, usize>, Vec<PathBuf>)> {
    let mut place: BTreeMap<u64, (usize, usize)> = BTreeMap::new();
    let mut duplicates = Vec::new();
    for (part, table) in tables.iter().enumerate() {
        let mut is_new = table.numbers.is_empty();
        for (row, &number) in table.numbers.iter().enumerate() {
            let Some(&(other, other_row)) = place.get(&number) else {
                place.insert(number, (part, row));
                is_new = true;
                continue;
            };
            let same = |a: &[SightlineColumn], b: &[SightlineColumn]| {
                a.iter().zip(b).all(|(a, b)| a.values[other_row].to_bits() == b.values[row].to_bits())
            };
            let (a, b) = (&tables[other], table);
            if !same(&a.all_haloes, &b.all_haloes) || !same(&a.tidal_haloes, &b.tidal_haloes) {
                let problem = format!("sightline {number} differs from that of {}", paths[other].display());
                return Err(Error::file(FileFault::Content, &paths[part], problem));
            }
        }
        if !is_new {
            duplicates.push(paths[part].clone());
        }
    }
    Ok((place.into_iter().map(|(number, (part, _))| (number, part)).collect(), duplicates))
}

/// The rows of all parts in the order of their numbers.
fn joined(tables: &[SightlineTable], whole: Range<u64>, origin: &BTreeMap<u64, usize>) -> SightlineTable {
    let first = &tables[0];
    let rows: Vec<(usize, usize)> = origin
        .iter()
        .filter_map(|(number, &part)| Some((part, tables[part].numbers.binary_search(number).ok()?)))
        .collect();
    let columns = |of: fn(&SightlineTable) -> &[SightlineColumn]| -> Vec<SightlineColumn> {
        let column = |(i, column): (usize, &SightlineColumn)| SightlineColumn {
            values: rows.iter().map(|&(part, row)| of(&tables[part])[i].values[row]).collect(),
            ..column.clone()
        };
        of(first).iter().enumerate().map(column).collect()
    };
    let failures: BTreeMap<u64, String> = tables.iter().flat_map(|table| table.failures.clone()).collect();
    SightlineTable {
        provenance: first.provenance.clone(),
        level: first.level.clone(),
        model: first.model.clone(),
        inputs: first.inputs.clone(),
        whole,
        lenses: first.lenses.clone(),
        numbers: origin.keys().copied().collect(),
        all_haloes: columns(|table| &table.all_haloes),
        tidal_haloes: columns(|table| &table.tidal_haloes),
        failures: failures.into_iter().collect(),
    }
}

/// Ascending numbers in few words: "3–7, 12".
fn ranges(numbers: &[u64]) -> String {
    /// Ranges told.
    const TOLD: usize = 12;
    let mut runs: Vec<(u64, u64)> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some((_, end)) if *end + 1 == number => *end = number,
            _ => runs.push((number, number)),
        }
    }
    let told: Vec<String> = runs
        .iter()
        .take(TOLD)
        .map(|(start, end)| if start == end { start.to_string() } else { format!("{start}–{end}") })
        .collect();
    told.join(", ") + if runs.len() > TOLD { " and more" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Provenance;

    struct NoStacks;

    impl StackRows for NoStacks {
        fn pixels(&self, _: usize, _: u64) -> Result<Vec<f32>> {
            Ok(Vec::new())
        }
    }

    fn part(whole: Range<u64>, numbers: Range<u64>) -> SightlineTable {
        let values = numbers.clone().map(|number| if number == 4 { f64::NAN } else { number as f64 });
        SightlineTable {
            provenance: Provenance::new(Some(1), "a = 1\n"),
            level: "scalars".into(),
            model: String::new(),
            inputs: String::new(),
            whole,
            lenses: Vec::new(),
            failures: numbers.clone().filter(|n| *n == 4).map(|n| (n, "why".into())).collect(),
            all_haloes: vec![SightlineColumn {
                name: "kappa_os".into(),
                unit: String::new(),
                description: "κ".into(),
                values: values.collect(),
            }],
            tidal_haloes: Vec::new(),
            numbers: numbers.collect(),
        }
    }

    fn merged(parts: &[SightlineTable]) -> Result<Merged> {
        let folder = tempfile::tempdir().unwrap();
        let write = |(i, part): (usize, &SightlineTable)| {
            let path = folder.path().join(format!("{i}.h5"));
            part.write(&path, &[], &NoStacks).unwrap();
            path
        };
        let paths: Vec<PathBuf> = parts.iter().enumerate().map(write).collect();
        merge(&paths)
    }

    fn refused(parts: &[SightlineTable]) -> String {
        let error = merged(parts).err().unwrap();
        assert!(error.is_bad_input());
        error.to_string()
    }

    #[test]
    fn shards_in_any_order_are_the_whole_and_duplicates_are_told_of() {
        let whole = || 2..10;
        let parts = [part(whole(), 6..10), part(whole(), 2..6), part(whole(), 6..10)];
        let merged = merged(&parts).unwrap();
        // A number that is none is not equal to itself.
        let (got, wanted) = (format!("{:?}", merged.table), format!("{:?}", part(whole(), whole())));
        assert_eq!(got, wanted);
        assert_eq!(merged.duplicates.len(), 1);
    }

    #[test]
    fn an_ensemble_may_be_continued_by_another() {
        let longer = merged(&[part(0..3, 0..3), part(3..6, 3..6)]).unwrap().table;
        assert_eq!((longer.whole, longer.numbers), (0..6, (0..6).collect()));
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let good = || part(0..6, 0..3);
        let text = refused(&[good(), part(0..6, 5..6)]);
        assert!(text.contains("2 of 6 sightlines are in no part: 3–4"), "{text}");
        assert!(refused(&[part(0..3, 0..3), part(5..6, 5..6)]).contains("3–4"));
        assert!(refused(&[good(), part(2..9, 3..6)]).contains("overlap with 0 to 5"));
        let changed = |change: fn(&mut SightlineTable)| {
            let mut table = part(0..6, 2..6);
            change(&mut table);
            refused(&[good(), table])
        };
        assert!(changed(|t| t.provenance.config_toml += "b = 2\n").contains("another configuration"));
        assert!(changed(|t| t.provenance.seed = Some(2)).contains("another seed"));
        assert!(changed(|t| t.provenance.git_revision = "0".into()).contains("another version"));
        assert!(changed(|t| t.inputs = "1:2".into()).contains("another content of the files it names"));
        assert!(changed(|t| t.level = "maps".into()).contains("another level"));
        assert!(changed(|t| t.all_haloes[0].values[0] += 1e-9).contains("sightline 2 differs"));
    }
}
