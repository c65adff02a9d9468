//! Owns the recipe file: all stages' settings in TOML, unknown keys refused with the nearest known one named.

pub mod built_in;

use crate::error::{Error, Result};
use crate::image::scan;
use crate::io::percent;
use crate::measure::load_history::MOST_LOADS;
use crate::pipeline::apparent::checks::needs_modulus;
use crate::pipeline::apparent::{Load, Method, SolveParams};
use crate::pipeline::lattice::LatticeParams;
use crate::pipeline::segment::SegmentParams;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;

pub use crate::report::ReportParams;
pub use built_in::{BUILT_IN, SCENES, built_in};

/// Settings of a whole run. What a file leaves out takes its default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recipe {
    /// Stated error asked for: solver, elements and shape (0.03 is 3 %). The resolution then follows from it, and
    /// what `[lattice]` says is not used.
    #[serde(deserialize_with = "percent::optional")]
    pub error: Option<f64>,
    /// Loads of every scan, each a solve of its own with all else of `[solve]`; that of `[solve]` alone where there are none.
    pub loads: Vec<Load>,
    /// From the unit loads of `loads`: daily loads that bring the tissue nearest to this strain energy density (MPa; usual: 0.02)
    /// everywhere. None: they are not estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_vivo_mpa: Option<f64>,
    /// Table `[segment]`.
    pub segment: SegmentParams,
    /// Table `[lattice]`.
    pub lattice: LatticeParams,
    /// Table `[solve]`.
    pub solve: SolveParams,
    /// Table `[report]`.
    pub report: ReportParams,
}

impl Recipe {
    /// Reads a recipe file, or, where there is no file of this name, the recipe in the program.
    ///
    /// # Errors
    /// No such recipe, a scan in its place, unknown keys, unusable values.
    pub fn read(path: &Path) -> Result<Recipe> {
        let name = path.to_str().filter(|_| !path.is_file());
        if let Some(text) = name.and_then(|name| built_in(name).ok()) {
            return Recipe::parse(text, path);
        }
        if path.is_dir() || scan::is_scan_file(path) {
            return Err(Error::file(
                path,
                "is a scan or a folder, where a recipe was expected",
                "give the recipe first, then the scans: bonepd-ct run quick.toml SCAN -o OUT (`bonepd-ct recipe` lists recipes)",
            ));
        }
        let text = std::fs::read_to_string(path).map_err(|e| {
            let found = match e.kind() {
                std::io::ErrorKind::InvalidData => "it is not text".to_owned(),
                _ => e.to_string(),
            };
            Error::file(
                path,
                format!("expected a recipe, could not read it: {found}"),
                format!("name a TOML file with tables [segment], [lattice], [solve], [report], before the scans; or a recipe in the program: {} (`bonepd-ct recipe NAME` prints one)", built_in::names()),
            )
            .caused_by(e)
        })?;
        Recipe::parse(&text, path)
    }

    /// `path` only words the errors.
    pub fn parse(text: &str, path: &Path) -> Result<Recipe> {
        let table: toml::Table = text.parse().map_err(|e| not_toml(path, &e))?;
        refuse_unknown(&table, &known(), "", path)?;
        let recipe: Recipe = toml::from_str(text).map_err(|e| not_toml(path, &e))?;
        recipe.check()?;
        Ok(recipe)
    }

    /// The recipe with other values for some keys, which stand side by side and not in tables. `whose` words the errors.
    ///
    /// # Errors
    /// As [`Recipe::parse`].
    pub fn with(&self, settings: toml::Table, whose: &Path) -> Result<Recipe> {
        let known = known();
        let mut all = toml::Table::try_from(self).expect("settings are plain data");
        for (key, value) in settings {
            let own = TABLES.into_iter().find(|name| has(&known[name], &key));
            let table = match own {
                Some(name) => all.get_mut(name).and_then(toml::Value::as_table_mut),
                None if key == "error" => Some(&mut all),
                None => return Err(unknown_key(&key, &key, &side_by_side(&known), whose)),
            };
            table.expect("a recipe has its tables").insert(key, value);
        }
        let text = toml::to_string(&all).expect("settings are plain data");
        Recipe::parse(&text, whose)
    }

    /// Refuses values no stage can use.
    pub fn check(&self) -> Result<()> {
        if self.error.is_some_and(|e| !(e > 0.0 && e < 1.0)) {
            return Err(Error::setting(
                "error",
                format!("not usable: {}", self.error.unwrap_or_default()),
                "give a relative error between 0 and 1 (0.03 is 3 %)",
            ));
        }
        let smooth = [
            ("element_mm", self.solve.element_mm.is_some()),
            ("surface", self.solve.surface.is_some()),
        ];
        if let Some((key, _)) = smooth.into_iter().find(|(_, is_given)| *is_given)
            && self.error.is_some()
        {
            return Err(Error::setting(
                format!("solve.{key}"),
                "the error target chooses voxel elements, which do not have it",
                format!("leave out {key}, or leave out error"),
            ));
        }
        self.segment.check()?;
        self.lattice.check()?;
        self.check_in_vivo()?;
        if self.loads.len() > 1 && !self.solve.fields.is_empty() {
            return Err(Error::setting(
                "solve.fields",
                "fields of several loads would overwrite each other",
                "leave fields out, or run the loads one by one (solve --load)",
            ));
        }
        self.solves().iter().try_for_each(|solve| {
            if self.error.is_some() && solve.plasticity.is_none() {
                needs_modulus(solve.load, "error")?;
            }
            solve.check()
        })
    }

    /// Refuses settings from which no daily loads follow.
    fn check_in_vivo(&self) -> Result<()> {
        let Some(target) = self.in_vivo_mpa else {
            return Ok(());
        };
        let wrong = |found: String, advice: &str| Err(Error::setting("in_vivo_mpa", found, advice));
        if !(target > 0.0 && target.is_finite()) {
            return wrong(
                format!("not usable: {target}"),
                "give a strain energy density in MPa above 0 (usual: 0.02)",
            );
        }
        let ends = |load: &Load| !matches!(load, Load::Stiffness | Load::Labels);
        if self.loads.len() < 2 || self.loads.len() > MOST_LOADS || !self.loads.iter().all(ends) {
            return wrong(
                format!(
                    "daily loads follow from 2 to {MOST_LOADS} loads of the ends, found {}",
                    self.loads.len()
                ),
                "give loads = [\"uniaxial\", \"shear-x\", \"shear-y\"], or leave in_vivo_mpa out",
            );
        }
        if self.solve.method != Method::VoxelFe
            || self.solve.plasticity.is_some()
            || self.error.is_some()
        {
            return wrong(
                "daily loads follow from energy densities of elastic voxel elements".to_owned(),
                "set method = \"voxel-fe\", and leave plasticity and error out",
            );
        }
        Ok(())
    }

    /// The solves of every scan: one of each load.
    pub fn solves(&self) -> Vec<SolveParams> {
        if self.loads.is_empty() {
            return vec![self.solve.clone()];
        }
        let of = |&load: &Load| SolveParams {
            load,
            ..self.solve.clone()
        };
        self.loads.iter().map(of).collect()
    }
}

/// Tables of settings of one scan.
const TABLES: [&str; 3] = ["segment", "lattice", "solve"];

/// All keys of a recipe.
fn known() -> Value {
    let mut known = serde_json::to_value(Recipe::default()).expect("settings are plain data");
    known["in_vivo_mpa"] = Value::Null;
    // Where they are not used they are left out.
    for key in [
        "plasticity",
        "element_mm",
        "surface",
        "ends_depth_mm",
        "held",
        "moved",
        "pushed",
        "supports",
    ] {
        known["solve"][key] = Value::Null;
    }
    known
}

fn has(table: &Value, key: &str) -> bool {
    table.get(key).is_some()
}

/// The keys that [`Recipe::with`] takes.
fn side_by_side(known: &Value) -> Value {
    let tables = TABLES
        .into_iter()
        .filter_map(|name| known[name].as_object());
    let keys = tables.flat_map(|table| table.clone());
    keys.chain([("error".to_owned(), Value::Null)]).collect()
}

fn not_toml(path: &Path, e: &toml::de::Error) -> Error {
    if path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("csv"))
    {
        return Error::file(
            path,
            "is a table, where a recipe was expected",
            "the recipe comes first, then scans or a manifest: bonepd-ct run quick MANIFEST.csv -o OUT",
        );
    }
    Error::file(
        path,
        format!("not a valid recipe\n{e}"),
        "correct the line shown; `bonepd-ct recipe paper` shows every key",
    )
}

/// Checks the tables' keys against those of the default recipe.
fn refuse_unknown(table: &toml::Table, known: &Value, prefix: &str, path: &Path) -> Result<()> {
    for (key, value) in table {
        let name = format!("{prefix}{key}");
        match (known.get(key), value) {
            (None, _) => return Err(unknown_key(&name, key, known, path)),
            (Some(inner @ Value::Object(_)), toml::Value::Table(sub)) => {
                refuse_unknown(sub, inner, &format!("{name}."), path)?;
            }
            _ => {}
        }
    }
    Ok(())
}

fn unknown_key(name: &str, key: &str, known: &Value, path: &Path) -> Error {
    let keys: Vec<&str> = known
        .as_object()
        .map(|o| o.keys().map(String::as_str).collect())
        .unwrap_or_default();
    let nearest = keys
        .iter()
        .max_by(|a, b| strsim::jaro_winkler(key, a).total_cmp(&strsim::jaro_winkler(key, b)));
    let advice = match nearest {
        Some(best) => format!("did you mean `{best}`? Known here: {}", keys.join(", ")),
        None => "remove it".to_owned(),
    };
    Error::setting(name, format!("unknown key in {}", path.display()), advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Recipe> {
        Recipe::parse(text, Path::new("test.toml"))
    }

    #[test]
    fn an_empty_recipe_is_the_defaults() {
        assert_eq!(parse("").unwrap(), Recipe::default());
    }

    #[test]
    fn an_unknown_key_names_the_nearest() {
        let words = parse("[lattice]\nlpmm = [0.1]").unwrap_err().to_string();
        assert!(words.contains("lattice.lpmm"), "{words}");
        assert!(words.contains("did you mean `lp_mm`"), "{words}");
        let words = parse("[solver]\n").unwrap_err().to_string();
        assert!(words.contains("did you mean `solve`"), "{words}");
    }

    #[test]
    fn keys_that_are_left_out_by_default_are_known() {
        let recipe = parse("[solve]\nmethod = \"geometry-fe\"\nelement_mm = 0.05").unwrap();
        assert_eq!(recipe.solve.element_mm, Some(0.05));
        let to_an_error = "error = 0.1\n[solve]\nmethod = \"geometry-fe\"\nsurface = \"body\"";
        let refused = parse(to_an_error).and_then(|recipe| recipe.check());
        assert!(refused.is_err_and(|e| e.to_string().contains("solve.surface")));
    }

    #[test]
    fn keys_side_by_side_find_their_tables() {
        let with = |text: &str| {
            let settings = text.parse().unwrap();
            Recipe::default().with(settings, Path::new("the settings"))
        };
        let recipe = with(
            "lower = 3.0\nlp_mm = [0.1]\npoisson = 0.2\nmethod = \"geometry-fe\"\nelement_mm = 0.1",
        )
        .unwrap();
        assert_eq!(recipe.segment.lower, Some(3.0));
        assert_eq!(recipe.lattice.lp_mm, [0.1]);
        assert_eq!(
            (recipe.solve.poisson, recipe.solve.element_mm),
            (0.2, Some(0.1))
        );
        assert_eq!(with("error = 0.1").unwrap().error, Some(0.1));
        for (text, said) in [
            ("poison = 0.2", "did you mean `poisson`"),
            ("poisson = \"soft\"", "the settings: not a valid recipe"),
            ("poisson = 0.5", "poisson"),
        ] {
            let words = with(text).unwrap_err().to_string();
            assert!(words.contains(said), "{words}");
        }
        let known = known();
        let keys = TABLES.map(|name| known[name].as_object().map_or(0, |table| table.len()));
        let all = side_by_side(&known);
        assert_eq!(
            all.as_object().unwrap().len(),
            1 + keys.iter().sum::<usize>()
        );
    }

    #[test]
    fn a_value_of_the_wrong_type_names_its_line() {
        let words = parse("[solve]\npoisson = \"soft\"")
            .unwrap_err()
            .to_string();
        assert!(words.contains("poisson"), "{words}");
        assert!(words.contains("line 2"), "{words}");
    }

    #[test]
    fn a_value_no_stage_can_use_is_refused() {
        let words = parse("[solve]\npoisson = 0.5").unwrap_err().to_string();
        assert!(words.contains("poisson"), "{words}");
        let words = parse("error = 3.0").unwrap_err().to_string();
        assert!(words.contains("0.03 is 3 %"), "{words}");
    }

    #[test]
    fn shares_are_numbers_or_percentages() {
        let recipe =
            parse("error = \"5%\"\n[solve]\ntolerance = \"0.1%\"\nstrain = \"-1%\"\n").unwrap();
        assert_eq!(recipe.error, Some(0.05));
        assert_eq!(
            (recipe.solve.tolerance, recipe.solve.strain),
            (0.001, -0.01)
        );
        assert_eq!(parse("[solve]\nstrain = 1").unwrap().solve.strain, 1.0);
        let words = parse("[solve]\ntolerance = \"fine\"")
            .unwrap_err()
            .to_string();
        assert!(
            words.contains("percentage") && words.contains("line 2"),
            "{words}"
        );
    }

    #[test]
    fn recipes_in_the_program_are_recipes() {
        for (name, text) in BUILT_IN {
            assert!(Recipe::read(Path::new(name)).is_ok(), "{name}");
            assert_eq!(built_in(name).unwrap(), *text);
        }
        for (name, _) in SCENES {
            assert!(
                built_in::any(name).is_ok() && built_in(name).is_err(),
                "{name}"
            );
        }
        assert!(
            built_in("papre")
                .unwrap_err()
                .to_string()
                .contains("to-an-error")
        );
    }

    #[test]
    fn several_loads_are_several_solves() {
        let recipe = parse("loads = [\"uniaxial\", \"shear-x\"]").unwrap();
        let loads: Vec<Load> = recipe.solves().iter().map(|solve| solve.load).collect();
        assert_eq!(loads, [Load::Uniaxial, Load::ShearX]);
        for (text, said) in [
            (
                "loads = [\"uniaxial\", \"torsion\"]\n[solve]\nfields = [\"sed\"]",
                "overwrite",
            ),
            ("loads = [\"shear-z\"]", "along the long axis"),
            ("error = 0.1\nloads = [\"torsion\"]", "torsion has none"),
            (
                "in_vivo_mpa = 0.02\nloads = [\"uniaxial\"]\n[solve]\nmethod = \"voxel-fe\"",
                "from 2 to 10 loads",
            ),
            (
                "in_vivo_mpa = 0.02\nloads = [\"uniaxial\", \"torsion\"]",
                "elastic voxel elements",
            ),
            ("in_vivo_mpa = 0.0", "0.02"),
        ] {
            let words = parse(text).unwrap_err().to_string();
            assert!(words.contains(said), "{words}");
        }
    }

    #[test]
    fn a_recipe_survives_writing() {
        let mut recipe = Recipe::default();
        recipe.segment.crop = Some([[1, 2], [3, 4], [5, 6]]);
        let text = toml::to_string(&recipe).unwrap();
        assert_eq!(parse(&text).unwrap(), recipe);
    }
}
