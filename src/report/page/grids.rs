//! Maps and images of a run, as numbers that a page can draw, zoom and read off.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::model::{Grid, GridKind, GridSet};
use super::words::{flat, label};
use crate::error::Result;
use crate::io::{AttributeValue, ImageFile, RunFileReader};

/// Grids of more nodes are averaged over blocks of them.
const MOST_NODES: usize = 256 * 256;
/// Grids beyond this sum are left to their files.
const LARGEST_SUM_BYTES: usize = 2_000_000;

/// The grids of HDF5 files, or where there are none of FITS images; a set for what shares a field.
pub(super) fn grids(folder: &Path, files: &[String]) -> Vec<GridSet> {
    let ending = |end: &'static str| files.iter().filter(move |file| file.ends_with(end));
    let top = |file: &&String| !file.contains('/');
    let mut sets: Vec<GridSet> =
        ending(".h5").filter(top).flat_map(|file| of_hdf5(&folder.join(file)).unwrap_or_default()).collect();
    if sets.is_empty() {
        let images: Vec<Grid> = ending(".fits").filter_map(|file| of_fits(folder, file)).collect();
        let id = "images".to_owned();
        sets.extend((!images.is_empty()).then(|| GridSet { id, title: "Images".into(), grids: images }));
    }
    let mut sum = 0;
    for set in &mut sets {
        set.grids.retain(|grid| {
            sum += grid.data.len();
            sum < LARGEST_SUM_BYTES
        });
    }
    sets.retain(|set| !set.grids.is_empty());
    sets
}

fn of_hdf5(path: &Path) -> Result<Vec<GridSet>> {
    let file = RunFileReader::open(path)?;
    let mut sets = Vec::new();
    for group in file.names("")? {
        let mut grids = of_group(&file, &group, "");
        let inner: Vec<String> = file.names(&group).unwrap_or_default();
        let mut places = Vec::new();
        for name in &inner {
            let (start, place) = (grids.len(), name.split('_').next().unwrap_or(name));
            grids.extend(of_group(&file, &format!("{group}/{name}"), place));
            if grids.len() > start {
                places.push((place.to_owned(), start, grids.len() - start));
            }
        }
        // Two views of one sky: what one has and the other has not.
        if let [(first, a, count), (second, b, same)] = places.as_slice()
            && count == same
        {
            for k in 0..*count {
                if grids[a + k].shape != grids[b + k].shape {
                    continue;
                }
                let what = grids[a + k].name.split(", ").last().unwrap_or_default().to_owned();
                let (name, kind) = (format!("{first} − {second}, {what}"), GridKind::Signed);
                let difference_of = Some([a + k, b + k]);
                grids.push(Grid { name, kind, difference_of, data: String::new(), ..grids[a + k].clone() });
            }
        }
        let title = match group.as_str() {
            "maps" => "Maps of the line of sight".to_owned(),
            "images" | "image" => "Images".to_owned(),
            "rays" => "Rays".to_owned(),
            _ => group.replace('_', " "),
        };
        if !grids.is_empty() {
            sets.push(GridSet { id: group, title, grids });
        }
    }
    Ok(sets)
}

/// The two-dimensional data of a group whose attributes say how large its field is.
fn of_group(file: &RunFileReader, group: &str, place: &str) -> Vec<Grid> {
    let number = |name: &str| match file.read_attribute(group, name) {
        Ok(AttributeValue::F64(value)) => Some(value),
        _ => None,
    };
    let (nodes_to, pixel) = (number("half_width_arcsec"), number("pixel_scale_arcsec"));
    if nodes_to.is_none() && pixel.is_none() {
        return Vec::new();
    }
    let grid = |name: &String| {
        let (values, (ny, nx)) = file.read_2d(group, name).ok()?;
        // Nodes out to ± half width: the outermost cells reach half a step further.
        let half = |n: usize| match (nodes_to, pixel) {
            (Some(half), _) => half * n as f64 / (n.max(2) - 1) as f64,
            (None, pixel) => 0.5 * n as f64 * pixel.unwrap_or(1.0),
        };
        let unit = match file.read_attribute(&format!("{group}/{name}"), "unit") {
            Ok(AttributeValue::Text(unit)) => unit,
            _ => String::new(),
        };
        let shown = flat(&label(name));
        let name = if place.is_empty() { shown } else { format!("{place}, {shown}") };
        Some(packed(name, &unit, &values, [ny, nx], [half(nx), half(ny)]))
    };
    file.names(group).unwrap_or_default().iter().filter_map(grid).collect()
}

fn of_fits(folder: &Path, name: &str) -> Option<Grid> {
    let image = ImageFile::read(&folder.join(name)).ok()?;
    let half = [image.nx, image.ny].map(|n| 0.5 * n as f64 * image.pixel_scale_arcsec);
    let shown = name.trim_end_matches(".fits").trim_start_matches("images/").replace('_', " ");
    Some(packed(shown, "electron/s", &image.data, [image.ny, image.nx], half))
}

fn packed(name: String, unit: &str, values: &[f64], shape: [usize; 2], half_arcsec: [f64; 2]) -> Grid {
    let block = (1..).find(|block| shape[0].div_ceil(*block) * shape[1].div_ceil(*block) <= MOST_NODES);
    let (values, shape) = averaged(values, shape, block.unwrap_or(1));
    let (unit, kind) = match unit {
        "electron/s" => ("e⁻/s", GridKind::Light),
        unit => {
            let is_signed = values.iter().any(|value| *value < 0.0);
            let unit = if unit == "arcsec^-1" { "arcsec⁻¹" } else { unit };
            (unit, if is_signed { GridKind::Signed } else { GridKind::Positive })
        }
    };
    let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    let [x, y] = half_arcsec;
    Grid {
        name: if block == Some(1) { name } else { format!("{name} (averaged)") },
        unit: unit.into(),
        shape,
        extent_arcsec: [-x, x, -y, y],
        kind,
        data: STANDARD.encode(bytes),
        difference_of: None,
    }
}

/// Means over blocks of that side; the last ones may be smaller.
fn averaged(values: &[f64], [ny, nx]: [usize; 2], block: usize) -> (Vec<f64>, [usize; 2]) {
    if block == 1 {
        return (values.to_vec(), [ny, nx]);
    }
    let shape = [ny.div_ceil(block), nx.div_ceil(block)];
    let mean = |k: usize| {
        let (rows, columns) = ((k / shape[1]) * block..ny, (k % shape[1]) * block..nx);
        let cells = rows.take(block).flat_map(|y| columns.clone().take(block).map(move |x| y * nx + x));
        let (sum, count) = cells.fold((0.0, 0.0), |(sum, count), cell| (sum + values[cell], count + 1.0));
        sum / count
    };
    ((0..shape[0] * shape[1]).map(mean).collect(), shape)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{Provenance, RunFile};

    #[test]
    fn two_views_have_a_difference_and_maps_reach_half_a_step_beyond_their_nodes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        let file = RunFile::create(&path, &Provenance::new(None, "")).unwrap();
        let four = [1.0, 2.0, 3.0, 4.0];
        file.write_2d("maps", "kappa", &four, (2, 2), "", "").unwrap();
        file.attribute("maps", "half_width_arcsec", 1.0).unwrap();
        for view in ["all_haloes", "tidal_haloes"] {
            let group = format!("images/{view}");
            file.write_2d(&group, "noisy", &four, (2, 2), "electron/s", "").unwrap();
            file.attribute(&group, "pixel_scale_arcsec", 0.5).unwrap();
        }
        file.write_1d("haloes", "z", &four, "", "").unwrap();
        file.close().unwrap();
        let sets = grids(folder.path(), &["run.h5".into()]);
        let names: Vec<&str> =
            sets.iter().flat_map(|set| &set.grids).map(|grid| grid.name.as_str()).collect();
        assert_eq!(names, ["κ", "all, noisy", "tidal, noisy", "all − tidal, noisy"]);
        assert_eq!(sets[0].grids[0].extent_arcsec, [-2.0, 2.0, -2.0, 2.0]);
        assert_eq!(sets[1].grids[0].extent_arcsec, [-0.5, 0.5, -0.5, 0.5]);
        assert_eq!(sets[1].grids[2].difference_of, Some([0, 1]));
        let bytes = STANDARD.decode(&sets[0].grids[0].data).unwrap();
        assert_eq!(bytes[4..8], 2f32.to_le_bytes());
    }

    #[test]
    fn large_grids_are_averaged() {
        let values: Vec<f64> = (0..9).map(f64::from).collect();
        let (means, shape) = averaged(&values, [3, 3], 2);
        assert_eq!((means, shape), (vec![2.0, 3.5, 6.5, 8.0], [2, 2]));
    }
}
