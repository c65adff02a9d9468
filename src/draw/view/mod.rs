//! Owns the view that turns under the mouse: one HTML file a specimen, which needs no network.
//!
//! The file holds the mask, reduced and compressed, and a viewer (`view.min.js`, made of `viewer/` with three.js) that lays the
//! surface through it.

use crate::draw::colour_bar::Coloured;
use crate::draw::map::short;
use crate::draw::reduced::Reduced;
use crate::grid::Axis;
use crate::volume::Volume;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use std::io::Write;

const PAGE: &str = include_str!("page.html");
const VIEWER: &str = include_str!("view.min.js");

/// Voxels of the reduced mask: a cube of 128.
const MOST: usize = 1 << 21;

/// The page of a specimen that is called `title`.
pub fn page(title: &str, bone: &Volume<u8>, load: Axis, coloured: Option<&Coloured>) -> String {
    let reduced = Reduced::new(bone, |n| n.iter().product::<usize>() <= MOST);
    let voxel_mm = bone.grid.spacing_mm.map(|s| s * reduced.factor as f64);
    let specimen = format!(
        "{{\"n\":{:?},\"voxel_mm\":{:?},\"size_mm\":{:?},\"level\":{},\"load_axis\":{},\"scale\":{:?}}}",
        reduced.n,
        voxel_mm,
        bone.grid.size_mm(),
        f64::from(reduced.level) - 0.5,
        load.index(),
        coloured.map_or(&[][..], |c| c.range.scale()),
    );
    let of_field = coloured.map(|c| packed(&reduced.field(c.values, [c.range.low, c.range.high])));
    let title = escaped(title);
    let hint = "Drag to turn; wheel or two fingers to zoom.";
    let parts = [
        ("title", title.as_str()),
        ("hint", hint),
        ("axis", load.name()),
        ("colours", &coloured.map(colours).unwrap_or_default()),
        ("specimen", &specimen),
        ("values", &packed(&reduced.share)),
        (
            "field",
            &of_field
                .map(|text| format!("<script type=\"text/plain\" id=\"field\">{text}</script>\n"))
                .unwrap_or_default(),
        ),
        ("viewer", VIEWER),
    ];
    filled(PAGE, &parts)
}

/// A template with `{name}` replaced, once each, from left to right.
fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    while let Some(at) = rest.find('{') {
        let part = parts
            .iter()
            .find(|(name, _)| rest[at + 1..].starts_with(&format!("{name}}}")));
        let (text, used) = part.map_or(("{", 1), |(name, text)| (*text, name.len() + 2));
        page.push_str(&rest[..at]);
        page.push_str(text);
        rest = &rest[at + used..];
    }
    page.push_str(rest);
    page
}

/// A bar of the field's colours with its name and the values at its ends.
fn colours(field: &Coloured) -> String {
    let steps = (0..=16).map(|k| {
        let value = field.range.low + f64::from(k) / 16.0 * (field.range.high - field.range.low);
        let [r, g, b] = field.range.colour(value).0;
        format!("rgb({r} {g} {b})")
    });
    format!(
        "<div id=\"colours\"><span>{}</span><div style=\"background:linear-gradient(to right,{})\"></div><p><span>{}</span><span>{}</span></p></div>\n",
        escaped(&field.name.replace('\n', " ")),
        steps.collect::<Vec<_>>().join(","),
        short(field.range.low),
        short(field.range.high),
    )
}

/// Compressed, as text.
fn packed(values: &[u8]) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    let written = encoder.write_all(values).and_then(|()| encoder.finish());
    STANDARD.encode(written.expect("memory takes all that is written"))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::map::Range;
    use crate::grid::Grid;

    fn cube() -> Volume<u8> {
        let grid = Grid::new([30; 3], [0.05; 3]);
        let at = |i: usize| [i % 30, i / 30 % 30, i / 900];
        let bone = |i| at(i).iter().all(|c| (5..25).contains(c));
        Volume::from_vec(grid, (0..grid.len()).map(|i| u8::from(bone(i))).collect())
    }

    #[test]
    fn a_view_needs_no_network() {
        let page = page("a", &cube(), Axis::Z, None);
        for words in [
            "fetch(",
            "XMLHttpRequest",
            "import(",
            "importScripts",
            "src=",
            "href=",
            "@import",
            "url(",
        ] {
            assert!(!page.contains(words), "{words}");
        }
        // The name of a language, which nothing is read from.
        let addresses = page.matches("http").count();
        assert_eq!(
            addresses,
            page.matches("http://www.w3.org/1999/xhtml").count()
        );
        assert!(page.contains("Copyright 2010-2026 Three.js Authors"));
    }

    #[test]
    fn a_view_of_the_most_voxels_is_small() {
        // Values that do not compress: more than any bone has.
        let grid = Grid::new([128; 3], [0.02; 3]);
        let bone = Volume::from_vec(
            grid,
            (0..grid.len())
                .map(|i| u8::from(i.wrapping_mul(2_654_435_761) >> 13 & 1 == 1))
                .collect(),
        );
        let size = page("a", &bone, Axis::Z, None).len();
        assert!(size < 5_000_000, "{size}");
    }

    #[test]
    fn a_view_says_of_its_specimen_what_the_viewer_reads() {
        let bone = cube();
        let values = Volume::from_vec(
            bone.grid,
            bone.as_slice().iter().map(|&b| f32::from(b)).collect(),
        );
        let range = Range {
            low: 0.0,
            high: 2.0,
        };
        let coloured = Coloured {
            values: &values,
            name: "strain\n(1)",
            range,
        };
        let page = page("<a & b>", &bone, Axis::X, Some(&coloured));
        assert!(page.contains("<title>&lt;a &amp; b&gt;</title>") && page.contains("load x<"));
        let (_, rest) = page.split_once("id=\"specimen\">").unwrap();
        let json = rest.split_once('<').unwrap().0;
        assert!(
            json.starts_with("{\"n\":[30, 30, 30],\"voxel_mm\":[0.05, 0.05, 0.05],"),
            "{json}"
        );
        assert!(
            json.contains("\"level\":127.5,\"load_axis\":0,\"scale\":[[68, 1, 84],"),
            "{json}"
        );
        assert!(page.contains("<span>strain (1)</span>"));
        let field = page
            .split_once("id=\"field\">")
            .unwrap()
            .1
            .split_once('<')
            .unwrap()
            .0;
        let packed = STANDARD.decode(field).unwrap();
        let mut values = Vec::new();
        std::io::Read::read_to_end(
            &mut flate2::read::ZlibDecoder::new(&packed[..]),
            &mut values,
        )
        .unwrap();
        // Half of the range in bone; nothing in pores.
        assert_eq!((values[0], values[15 + 30 * (15 + 30 * 15)]), (0, 128));
    }
}
