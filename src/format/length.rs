//! Owns the names of units of length that files carry, and what they are in millimetres.

/// Millimetres per unit, by the names and abbreviations that programs write. None for pixels and what is not a length.
///
/// The micro sign may be U+00B5, the Greek letter U+03BC, `u`, ImageJ's escape `\u00B5`, an XML entity, or the two
/// characters that UTF-8 becomes where a program took it for Latin-1.
pub fn millimetres_per(unit: &str) -> Option<f64> {
    let unit = unit.trim().trim_matches(['"', '\'']).trim();
    let mut name = unit.to_lowercase();
    for micro in [
        "\\u00b5",
        "\\u03bc",
        "&#181;",
        "&#956;",
        "&#xb5;",
        "&micro;",
        "\u{e2}\u{b5}",
        "\u{ee}\u{bc}",
        "\u{b5}",
        "\u{3bc}",
    ] {
        name = name.replace(micro, "u");
    }
    Some(match name.as_str() {
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" | "milimeter"
        | "milimeters" => 1.0,
        "u" | "um" | "umeter" | "umeters" | "umetre" | "umetres" | "micron" | "microns"
        | "micrometer" | "micrometers" | "micrometre" | "micrometres" => 1e-3,
        "nm" | "nanometer" | "nanometers" | "nanometre" | "nanometres" => 1e-6,
        "pm" | "picometer" | "picometers" | "picometre" | "picometres" => 1e-9,
        "\u{e5}" | "angstrom" | "angstroms" | "\u{e5}ngstr\u{f6}m" => 1e-7,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 10.0,
        "dm" | "decimeter" | "decimetre" => 100.0,
        "m" | "meter" | "meters" | "metre" | "metres" => 1e3,
        "km" | "kilometer" | "kilometre" => 1e6,
        "in" | "inch" | "inches" => 25.4,
        "thou" | "mil" | "mils" => 0.0254,
        _ => return None,
    })
}

/// Units that say that a size is no length.
pub fn is_pixel(unit: &str) -> bool {
    matches!(
        unit.trim().to_lowercase().as_str(),
        "" | "pixel" | "pixels" | "px" | "voxel" | "voxels" | "reference frame"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_a_micrometre_is_one() {
        for unit in [
            "um",
            "\u{b5}m",
            "\u{3bc}m",
            "\\u00B5m",
            "&#181;m",
            "\u{c2}\u{b5}m",
            "micron",
            "Microns",
            "micrometers",
            "Micrometre",
            " um ",
            "\"um\"",
        ] {
            assert_eq!(millimetres_per(unit), Some(1e-3), "{unit}");
        }
        assert_eq!(millimetres_per("inch"), Some(25.4));
        for none in ["pixel", "", "sec", "furlong"] {
            assert_eq!(millimetres_per(none), None, "{none}");
        }
        assert!(is_pixel("Pixels") && !is_pixel("um"));
    }
}
