//! The figures of a run inside its page: the saved SVGs with identifiers of their own, or their PNGs where those are smaller.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::model::PageFigure;

/// An SVG above this size gives way to its PNG.
const LARGEST_SVG_BYTES: usize = 500_000;
/// Figures beyond this sum are left to their files.
const LARGEST_SUM_BYTES: usize = 2_000_000;

/// Name, title and caption of the figures of all commands, in the order of a page.
const CAPTIONS: [(&str, &str, &str); 40] = [
    (
        "images",
        "Images",
        "Columns: through all haloes, through the tidal ones alone (Δ_h below the threshold), and all − tidal. Upper row before \
         noise, lower row with noise. The last column is what a tidal model of the line of sight cannot know.",
    ),
    ("image", "Image", "The exposure before and with noise, on one scale of colours."),
    (
        "tidal_maps",
        "Convergence and shear",
        "κ, γ₁ and γ₂ of the haloes over the field, main lens excluded; white is what the bar says. The dashed circle is the Einstein radius, solid lines \
         are critical curves of the lens, where they were asked for. In a tidal field the three would be flat.",
    ),
    (
        "flexion_maps",
        "Flexion and Δ",
        "|F| and |G|, the derivatives of the field, and Δ, its change relative to the shear on the axis; curves as above.",
    ),
    (
        "cylinder",
        "Where the haloes are",
        "Haloes beyond the tidal regime, and a tenth of the others, in the plane of the distance and one direction across.",
    ),
    (
        "histograms",
        "What single haloes do",
        "How many haloes have which κ_h, |γ_h| and Δ_h on the axis; right of the threshold a halo acts beyond the tidal regime.",
    ),
    (
        "mass_function",
        "Mass function",
        "The relation, and the haloes that were drawn over the volume in which they would be kept.",
    ),
    (
        "reconstruction",
        "Data, model, residual",
        "The image, the best fit, and (data − model)/noise. Structure in the residual is what the model lacks.",
    ),
    (
        "corner",
        "Posterior",
        "Each parameter against each: contours hold 68% and 95% of the draws; the diagonal shows each alone. Lines, where there are any, are true values.",
    ),
    ("corner_shear", "Posterior of the shears", "The same for the shears alone."),
    ("corner_all", "Posterior of all parameters", "Every quantity of the fit."),
    ("source", "Source", "The source of the best fit in its plane."),
    (
        "profiles",
        "Profile likelihoods",
        "How high the likelihood gets where a parameter is held, beside its posterior density; grey lines end intervals of 68 and 95%. \
         Where both differ, the priors of all parameters decide.",
    ),
    (
        "trace",
        "Chains",
        "Draws of every chain in their order. Chains that agree look like one band without drift.",
    ),
    ("mosaic", "Images", "The images of the catalogue, each on its own scale of colours."),
    (
        "tidal_residuals",
        "What tidal and flexion models leave",
        "Left the tidal, in the middle the flexion model: above what each leaves in β, below in the image of the first sightline. \
         Right both models in all sightlines.",
    ),
    ("cut", "What the shear cut changes", "Changes against the loosest cut, of tensors and of the image."),
    (
        "expected",
        "The shear to be expected of each lens",
        "The part of the sightlines whose |γ_LOS| is smaller, on the axis, along the Einstein ring and averaged over discs.",
    ),
    (
        "smoothing",
        "What smoothing leaves",
        "σ of a component of γ_LOS with its error, against the radius of the ring or disc over which it is averaged.",
    ),
    (
        "distributions",
        "Distributions over the sightlines",
        "How many sightlines have which shear and convergence of the line of sight, which Δ and which flexions.",
    ),
    (
        "joint",
        "Joint distributions",
        "Each quantity against each over the sightlines: contours hold 68% and 95% of them.",
    ),
    (
        "convergence",
        "How many sightlines are enough",
        "The scatter of γ_LOS from the first N sightlines, with its standard error.",
    ),
    (
        "which_shear",
        "Which γ_LOS is measured",
        "How many fits lie within how many σ of γ_LOS by each definition.",
    ),
    (
        "fitted",
        "Fitted γ_LOS against its definitions",
        "Both components of every sightline with their errors; on the dashed line a fit finds what the definition says. Orange: fits \
         whose χ² speaks against the model.",
    ),
    (
        "coverage",
        "Fits within their errors of each definition",
        "On the dashed curve errors are right. Tidal twins: images behind the tensors of the axis alone, what the fitter itself does.",
    ),
    (
        "excess",
        "Misfit and variation of the shear",
        "χ² above that of the tidal twin, whose noise is the same; what lies below 0.1 is drawn there.",
    ),
    (
        "failing",
        "Sightlines that are not tidal",
        "Shares of the sightlines when haloes up to which Δ_h are seen, with binomial errors.",
    ),
    (
        "h0",
        "H0 from delays",
        "Lens known and tensors of the axis or of the ring on the line of sight, and lens and line of sight of the best fit.",
    ),
    (
        "varying_haloes",
        "The halo whose shear changes most",
        "Mass and redshift of the halo of the largest Δ_h|γ_h|, by whether χ² exceeds that of the tidal twin.",
    ),
    (
        "calibration",
        "Calibration",
        "Ranks of the truth among the draws of each posterior; flat inside the band if posteriors are right. Above each: the \
         probability of ranks as uneven, and how many 68% intervals hold the truth, which the last panel has of all.",
    ),
    (
        "recovery",
        "γ_LOS found and put in",
        "One point an image; on the diagonal, what was put in was found. Arrows: outside the frame.",
    ),
    ("uncertainties", "Uncertainties and residuals", "Histograms over the images, a line a model."),
    (
        "quality",
        "Precision and quality",
        "Uncertainty and residual against the quality Q of the image, first model.",
    ),
    ("contours", "Posteriors of one image", "γ_LOS of the image of median Q by each model."),
    (
        "full_os_ds",
        "os and ds shears of the full model",
        "They trade against each other along straight lines: the image knows their sum, not each.",
    ),
    (
        "full_od_ellipticity",
        "od shear and ellipticity of the full model",
        "What the foreground does and how the lens is shaped, which an image tells apart.",
    ),
    (
        "minimal_od_ellipticity",
        "od shear and ellipticity of the minimal model",
        "The same of the minimal model.",
    ),
    (
        "minimal_los_ellipticity",
        "γ_LOS and ellipticity of the minimal model",
        "The shear that an image measures, hardly tied to the shape of the lens.",
    ),
    (
        "curves",
        "Critical curves and caustics",
        "Left the sky with the images, right the source plane. Across a critical curve images merge in pairs.",
    ),
    (
        "los_of_both",
        "γ_LOS of both models",
        "The full model's γ_LOS is derived from its od, os and ds shears.",
    ),
];

/// The figures among `files` of a folder; what did not find room is named in the second list.
pub(super) fn figures(folder: &Path, files: &[String]) -> (Vec<PageFigure>, Vec<String>) {
    let stem_of = |file: &'_ String| {
        let stem = file.strip_suffix(".svg").or_else(|| file.strip_suffix(".png"));
        stem.map(String::from)
    };
    let mut names: Vec<String> = files.iter().filter_map(stem_of).collect();
    let stem = |name: &str| name.rsplit('/').next().unwrap_or(name).to_owned();
    let rank =
        |name: &str| CAPTIONS.iter().position(|(own, _, _)| *own == stem(name)).unwrap_or(CAPTIONS.len());
    // Figures of parts are on the parts' pages.
    names.retain(|name| !name.contains('/') || name.starts_with("figures/"));
    names.sort_by_key(|name| (rank(name), name.clone()));
    names.dedup();
    let (mut figures, mut left_out, mut sum) = (Vec::new(), Vec::new(), 0);
    for (number, name) in names.into_iter().enumerate() {
        let told = CAPTIONS.get(rank(&name));
        let stem = stem(&name);
        let title = told.map_or_else(|| stem.replace('_', " "), |(_, title, _)| (*title).into());
        let caption = told.map_or(String::new(), |(_, _, caption)| (*caption).into());
        let id = format!("figure-{number}");
        let markup =
            markup(folder, &name, &id, &title).filter(|(text, _)| sum + text.len() < LARGEST_SUM_BYTES);
        match markup {
            Some((markup, width_mm)) => {
                sum += markup.len();
                let page_colour = page_colour(folder, &name);
                figures.push(PageFigure { id, title, caption, markup, width_mm, page_colour });
            }
            None => left_out.push(format!("{name}.svg")),
        }
    }
    (figures, left_out)
}

/// What stands for a figure in the page, and its width in millimetres.
fn markup(folder: &Path, name: &str, id: &str, title: &str) -> Option<(String, f64)> {
    /// Of a figure that is there as PNG alone.
    const WIDTH_MM: f64 = 174.0;
    let Ok(svg) = std::fs::read_to_string(folder.join(format!("{name}.svg"))) else {
        let data = STANDARD.encode(std::fs::read(folder.join(format!("{name}.png"))).ok()?);
        return Some((format!("<img alt=\"{title}\" src=\"data:image/png;base64,{data}\">"), WIDTH_MM));
    };
    let width_mm = attribute(&svg, "width")?.strip_suffix("mm")?.parse().ok()?;
    if svg.len() <= LARGEST_SVG_BYTES {
        return Some((inline(&svg, id)?, width_mm));
    }
    let png = std::fs::read(folder.join(format!("{name}.png"))).ok().filter(|png| png.len() < svg.len());
    let (kind, bytes) = png.map_or_else(|| ("svg+xml", svg.into_bytes()), |png| ("png", png));
    let data = STANDARD.encode(bytes);
    Some((format!("<img alt=\"{title}\" src=\"data:image/{kind};base64,{data}\">"), width_mm))
}

/// The colour of the page of a drawing, which is its first rectangle; empty for white.
fn page_colour(folder: &Path, name: &str) -> String {
    let svg = std::fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap_or_default();
    let rectangle = svg.split("<rect").nth(1).and_then(|rest| rest.split('>').next()).unwrap_or_default();
    attribute(rectangle, "fill").filter(|colour| *colour != "#ffffff").unwrap_or_default().into()
}

/// The SVG as part of a page: as wide as there is room, its identifiers its own.
fn inline(svg: &str, id: &str) -> Option<String> {
    let (head, rest) = svg.get(svg.find("<svg")?..)?.split_once('>')?;
    let (view_box, family) =
        (attribute(head, "viewBox")?, attribute(head, "font-family").unwrap_or("sans-serif"));
    let (title, body) = rest.trim_start().strip_prefix("<title>")?.split_once("</title>")?;
    let body = body.replace("id=\"id", &format!("id=\"{id}-")).replace("url(#id", &format!("url(#{id}-"));
    Some(format!(
        "<svg role=\"img\" aria-label=\"{}\" viewBox=\"{view_box}\" font-family=\"{family}\" xml:space=\"preserve\">{body}",
        title.replace('"', "&quot;")
    ))
}

/// The value of an attribute of the first element.
fn attribute<'a>(svg: &'a str, name: &str) -> Option<&'a str> {
    let start = svg.find(&format!(" {name}=\""))? + name.len() + 3;
    svg.get(start..)?.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"84mm\" height=\"63mm\" viewBox=\"0 0 238 178\" \
                       font-family=\"DejaVu Sans\">\n<title>a &lt; b</title>\n<clipPath id=\"id1\"/><g clip-path=\"url(#id1)\"/></svg>\n";

    #[test]
    fn identifiers_become_those_of_the_figure_and_the_title_its_name() {
        let text = inline(SVG, "figure-3").unwrap();
        assert!(text.contains("id=\"figure-3-1\"") && text.contains("url(#figure-3-1)"), "{text}");
        assert!(
            text.starts_with("<svg role=\"img\" aria-label=\"a &lt; b\" viewBox=\"0 0 238 178\""),
            "{text}"
        );
        assert!(!text.contains("mm\""), "{text}");
    }

    #[test]
    fn figures_of_parts_are_left_to_their_pages_and_known_ones_come_first() {
        let folder = tempfile::tempdir().unwrap();
        let files = ["other.svg", "figures/images.svg", "fit_x/corner.svg"].map(String::from);
        for file in &files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, SVG).unwrap();
        }
        let (figures, left_out) = figures(folder.path(), &files);
        let titles: Vec<&str> = figures.iter().map(|figure| figure.title.as_str()).collect();
        assert_eq!((titles, left_out.len()), (vec!["Images", "other"], 0));
    }
}
