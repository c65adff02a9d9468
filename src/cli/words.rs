//! Owns the words of the command line: lists, percentages, crops, choices; from text to plain values.

pub mod law;

use bonepd_ct::io::percent;
use bonepd_ct::physics::material::{Label, Law};
use bonepd_ct::pipeline::segment::{Align, Voi};
use clap::builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use serde::de::value::{Error as WordError, StrDeserializer};

/// One of `names`, each the serde name of a variant of `T`.
pub fn choice<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|word| {
        let word: StrDeserializer<WordError> = StrDeserializer::new(&word);
        T::deserialize(word)
    })
}

/// A finite number.
pub fn number(word: &str) -> Result<f64, String> {
    match word.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("expected a number, found `{word}`")),
    }
}

/// A number above zero.
pub fn positive(word: &str) -> Result<f64, String> {
    number(word).and_then(|v| match v > 0.0 {
        true => Ok(v),
        false => Err(format!("expected a number above 0, found `{word}`")),
    })
}

/// `0.1%` or `0.001`, as a share between 0 and 1.
pub fn fraction(word: &str) -> Result<f64, String> {
    match percent::parse(word)? {
        v if v > 0.0 && v < 1.0 => Ok(v),
        v if v >= 1.0 => Err(format!(
            "`{word}` is {} %: expected a share below 1, as 3% or 0.03",
            100.0 * v
        )),
        _ => Err(format!(
            "expected a share above 0, as 3% or 0.03, found `{word}`"
        )),
    }
}

/// `-1%` or `-0.01`; negative is compression.
pub fn strain(word: &str) -> Result<f64, String> {
    match percent::parse(word)? {
        v if v.abs() < 1.0 => Ok(v),
        v => Err(format!(
            "`{word}` is {} % of the height: expected a strain below 1, as -1% or -0.01",
            100.0 * v
        )),
    }
}

/// `X,Y,Z`.
pub fn triple(word: &str) -> Result<[f64; 3], String> {
    let parts: Vec<f64> = word.split(',').map(number).collect::<Result<_, _>>()?;
    parts
        .try_into()
        .map_err(|_| format!("expected three numbers X,Y,Z, found `{word}`"))
}

/// `A,B`.
pub fn pair(word: &str) -> Result<[f64; 2], String> {
    let parts: Vec<f64> = word.split(',').map(number).collect::<Result<_, _>>()?;
    parts
        .try_into()
        .map_err(|_| format!("expected two numbers A,B, found `{word}`"))
}

/// `labels:VALUE=E[/NU],…`, `power:C,N`, `linear:A,B`, `homminga:FULL[,N]`.
pub fn material(word: &str) -> Result<Law, String> {
    let wrong = || {
        format!(
            "expected labels:VALUE=E[/NU],…, power:C,N, linear:A,B or homminga:FULL[,N], found `{word}`"
        )
    };
    let (name, rest) = word.split_once(':').ok_or_else(wrong)?;
    if name == "labels" {
        let labels: Result<Vec<Label>, String> = rest.split(',').map(label).collect();
        return Ok(Law::Labels(labels?));
    }
    let parts: Vec<f64> = rest.split(',').map(number).collect::<Result<_, _>>()?;
    match (name, &parts[..]) {
        ("power", &[coefficient, exponent]) => Ok(Law::Power {
            coefficient,
            exponent,
        }),
        ("linear", &[slope, intercept]) => Ok(Law::Linear { slope, intercept }),
        ("homminga", &[full]) => Ok(Law::Homminga {
            full,
            exponent: 1.7,
        }),
        ("homminga", &[full, exponent]) => Ok(Law::Homminga { full, exponent }),
        _ => Err(wrong()),
    }
}

fn label(word: &str) -> Result<Label, String> {
    let wrong = || format!("expected VALUE=E or VALUE=E/NU, found `{word}`");
    let (value, moduli) = word.split_once('=').ok_or_else(wrong)?;
    let value = value.trim().parse().map_err(|_| wrong())?;
    let (young, poisson) = match moduli.split_once('/') {
        Some((young, poisson)) => (young, Some(number(poisson)?)),
        None => (moduli, None),
    };
    Ok(Label {
        value,
        young_mpa: positive(young)?,
        poisson,
    })
}

/// `H` or `X,Y,Z`, all above zero.
pub fn sizes(word: &str) -> Result<[f64; 3], String> {
    let sizes = match word.contains(',') {
        true => triple(word)?,
        false => [number(word)?; 3],
    };
    match sizes.iter().all(|s| *s > 0.0) {
        true => Ok(sizes),
        false => Err(format!("expected lengths above 0, found `{word}`")),
    }
}

/// `X0:X1,Y0:Y1,Z0:Z1` in voxels; the ends are not included.
pub fn crop(word: &str) -> Result<[[usize; 2]; 3], String> {
    let ranges: Vec<[usize; 2]> = word.split(',').map(range).collect::<Result<_, _>>()?;
    ranges
        .try_into()
        .map_err(|_| format!("expected three ranges X0:X1,Y0:Y1,Z0:Z1, found `{word}`"))
}

fn range(word: &str) -> Result<[usize; 2], String> {
    let wrong = || format!("expected first:end in voxels with first < end, found `{word}`");
    let (first, end) = word.split_once(':').ok_or_else(wrong)?;
    let first = first.trim().parse().map_err(|_| wrong())?;
    let end = end.trim().parse().map_err(|_| wrong())?;
    if first < end {
        Ok([first, end])
    } else {
        Err(wrong())
    }
}

/// `fabric` or a direction `X,Y,Z`.
pub fn align(word: &str) -> Result<Align, String> {
    match word {
        "fabric" => Ok(Align::Fabric),
        _ => triple(word)
            .map(Align::Direction)
            .map_err(|_| format!("expected fabric or a direction X,Y,Z, found `{word}`")),
    }
}

/// `box`, `cylinder`, `cylinder:D`, `cylinder:D,X,Y` (mm), or a mask file, whose name may be no text.
pub fn voi() -> impl TypedValueParser<Value = Voi> {
    OsStringValueParser::new().try_map(|word| match word.to_str() {
        Some(text) => shape(text),
        None => Ok(Voi::Mask(word.into())),
    })
}

fn shape(word: &str) -> Result<Voi, String> {
    if word == "box" {
        return Ok(Voi::Box);
    }
    let cylinder = |diameter_mm, center_mm| Voi::Cylinder {
        diameter_mm,
        center_mm,
    };
    match word.strip_prefix("cylinder") {
        Some("") => Ok(cylinder(None, None)),
        Some(rest) if rest.starts_with(':') => {
            let parts: Vec<f64> = rest[1..].split(',').map(number).collect::<Result<_, _>>()?;
            match parts[..] {
                [d] if d > 0.0 => Ok(cylinder(Some(d), None)),
                [d, x, y] if d > 0.0 => Ok(cylinder(Some(d), Some([x, y]))),
                _ => Err(format!(
                    "expected cylinder:DIAMETER or cylinder:DIAMETER,X,Y in mm, found `{word}`"
                )),
            }
        }
        _ => Ok(Voi::Mask(word.into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bonepd_ct::physics::material::Material;

    /// What a recipe holds of a law.
    #[derive(serde::Serialize)]
    struct Recipe {
        law: Law,
    }

    #[test]
    fn laws_of_density_are_read_and_said_alike() {
        for (word, said) in [
            ("power:6850,1.49", "power:6850;1.49"),
            ("linear:25,-5830", "linear:25;-5830"),
            ("homminga:1200", "homminga:1200;1.7"),
            ("homminga:1200,2", "homminga:1200;2"),
            (
                "labels:100=5000,127=9000/0.2",
                "labels:100=5000;127=9000/0.2",
            ),
        ] {
            let law = material(word).unwrap();
            let text = toml::to_string(&Recipe { law: law.clone() }).unwrap();
            let read: Material = toml::from_str(&text).unwrap();
            assert_eq!((read.law.clone(), read.words().as_str()), (law, said));
        }
        for word in [
            "power",
            "power:1",
            "linear:1,2,3",
            "homminga:",
            "labels:a=1",
            "log:1,2",
        ] {
            assert!(material(word).is_err(), "{word}");
        }
    }
    use bonepd_ct::pipeline::lattice::Structure;

    #[test]
    fn a_percentage_is_a_fraction() {
        assert_eq!(fraction("0.5%"), Ok(0.005));
        assert_eq!(fraction("0.001"), Ok(0.001));
        assert!(fraction("-1%").is_err());
        assert!(fraction("x").is_err());
        assert!(fraction("3").unwrap_err().contains("300 %"));
        assert_eq!(strain("-1%"), Ok(-0.01));
        assert!(strain("-1").unwrap_err().contains("-0.01"));
    }

    #[test]
    fn one_size_serves_all_axes() {
        assert_eq!(sizes("0.02"), Ok([0.02; 3]));
        assert_eq!(sizes("0.1, 0.2,0.3"), Ok([0.1, 0.2, 0.3]));
        assert!(sizes("0.1,0.2").is_err());
        assert!(sizes("0").is_err());
        assert!(sizes("nan").is_err());
    }

    #[test]
    fn a_crop_is_three_ranges() {
        assert_eq!(crop("0:10,5:6,2:200"), Ok([[0, 10], [5, 6], [2, 200]]));
        for bad in ["0:10", "0:10,5:5,0:1", "a:1,0:1,0:1", "0-1,0-1,0-1", ""] {
            assert!(crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_volume_of_interest_is_a_shape_or_a_file() {
        assert_eq!(shape("box"), Ok(Voi::Box));
        let cylinder = |diameter_mm, center_mm| {
            Ok(Voi::Cylinder {
                diameter_mm,
                center_mm,
            })
        };
        assert_eq!(shape("cylinder"), cylinder(None, None));
        assert_eq!(shape("cylinder:5"), cylinder(Some(5.0), None));
        assert_eq!(
            shape("cylinder:5,1,2"),
            cylinder(Some(5.0), Some([1.0, 2.0]))
        );
        assert_eq!(shape("voi.nii.gz"), Ok(Voi::Mask("voi.nii.gz".into())));
        assert!(shape("cylinder:0").is_err());
    }

    #[test]
    fn an_alignment_is_the_fabric_or_a_direction() {
        assert_eq!(align("fabric"), Ok(Align::Fabric));
        assert_eq!(align("0,-1,2"), Ok(Align::Direction([0.0, -1.0, 2.0])));
        assert!(align("1,2").is_err());
    }

    #[test]
    fn a_choice_is_a_variant_by_its_recipe_name() {
        let command =
            clap::Command::new("test")
                .arg(clap::Arg::new("s").value_parser(choice::<Structure>(&["sc", "bcc", "fcc"])));
        let words = command
            .clone()
            .try_get_matches_from(["test", "bcc"])
            .unwrap();
        assert_eq!(words.get_one("s"), Some(&Structure::Bcc));
        assert!(command.try_get_matches_from(["test", "hcp"]).is_err());
    }
}
