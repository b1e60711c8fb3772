//! Models and settings of fits in TOML: what can be said, what it is called, what is refused.

use haloray::Result;
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::inference::sample::{NutsSettings, SamplerSettings};
use haloray::profile::registry::{mass, mass_names};

fn compile(text: &str) -> Result<CompiledModel> {
    let base = "name = \"t\"\n[[lens]]\nprofile = \"SIE\"\nparameters = { theta_E = { uniform = [0.5, 2] }, e1 = 0.1 }\n\
                [[source]]\nprofile = \"SERSIC_ELLIPSE\"\nparameters = { R_sersic = 0.3, n_sersic = 1, e2 = \"lens.theta_E\" }\n";
    CompiledModel::new(&ModelDescription::parse(&format!("{base}{text}")).unwrap())
}

#[test]
fn every_mass_profile_can_be_fitted() {
    for name in mass_names() {
        let given = mass(name).unwrap();
        let needed = given.arguments().filter(|parameter| given.default_of(parameter).is_none());
        let rules: Vec<String> = needed.map(|p| format!("{} = {{ normal = [1.5, 0.1] }}", p.name)).collect();
        let lens = format!("[[lens]]\nprofile = \"{name}\"\nparameters = {{ {} }}\n", rules.join(", "));
        let model = compile(&lens).unwrap();
        assert_eq!(model.free.len(), 1 + rules.len(), "{name}");
        // The first is the Einstein radius of the lens beside it, which the source's e2 is tied to.
        let values: Vec<f64> = (0..model.free.len()).map(|i| if i == 0 { 0.7 } else { 1.5 }).collect();
        assert_eq!(model.lenses(&values).unwrap().len(), 2, "{name}");
    }
}

#[test]
fn labels_and_units_are_those_of_the_paper() {
    let sight = "[line_of_sight]\nmodel = \"flexion-minimal\"\n[line_of_sight.parameters]\n\
                 gamma1_los = { normal = [0, 1] }\nomega_los = { normal = [0, 1] }\nF2_1los = { normal = [0, 1] }\n\
                 [[lens_light]]\nprofile = \"SERSIC\"\nparameters = { R_sersic = 1, n_sersic = { uniform = [1, 2] } }\n";
    let quantities = compile(sight).unwrap().quantities();
    let told: Vec<(&str, &str)> = quantities.iter().map(|q| (q.label.as_str(), q.unit)).collect();
    let arcsec = "arcsec";
    let wanted = [
        ("γ_{1}^{LOS}", ""),
        ("ω_{LOS}", ""),
        ("F_{2}^{1los}", "1/arcsec"),
        ("θ_{E}", arcsec),
        ("n^{l}", ""),
    ];
    assert_eq!(told, wanted);
}

#[test]
fn descriptions_that_cannot_be_meant_are_refused() {
    let light =
        |p: &str| format!("[[lens_light]]\nprofile = \"SERSIC\"\nparameters = {{ R_sersic = 1, {p} }}\n");
    for (text, word) in [
        (light("n_sersic = 4, m = 3"), "one of"),
        (light("e1 = 0"), "missing"),
        (light("n_sersic = \"lens.q\""), "lens.q"),
        (light("n_sersic = { uniform = [2, 1] }"), "above the lower edge"),
        (light("n_sersic = nan"), "finite"),
        ("[[lens]]\nprofile = \"BLOB\"\nparameters = {}\n".into(), "BLOB"),
        ("[line_of_sight]\nmodel = \"minimal\"\nparameters = { gamma1_os = 0 }\n".into(), "gamma1_los"),
    ] {
        let message = compile(&text).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn settings_are_named_as_documented_and_refuse_what_they_do_not_know() {
    let parsed = |text: &str| toml::from_str::<SamplerSettings>(text);
    let SamplerSettings::Nuts(nuts) = parsed("kind = \"nuts\"\nchains = 6\n").unwrap() else {
        panic!("not nuts")
    };
    assert_eq!((nuts.chains, nuts.block_draws), (6, NutsSettings::default().block_draws));
    for kind in ["nuts", "valley", "ensemble-slice", "stretch", "nested"] {
        let settings = parsed(&format!("kind = \"{kind}\"")).unwrap();
        let text = toml::to_string(&settings).unwrap();
        assert_eq!(parsed(&text).unwrap(), settings);
        let error = parsed(&format!("kind = \"{kind}\"\nwalkes = 3")).unwrap_err().to_string();
        assert!(error.contains("unknown field `walkes`"), "{error}");
    }
    assert!(parsed("kind = \"emcee\"").unwrap_err().to_string().contains("ensemble-slice"));
    assert_eq!(SamplerSettings::default(), parsed("kind = \"valley\"").unwrap());
}
