//! What ImageJ, OME and tifffile write into a TIFF's description, row by row of the readers' tables.

use super::write::{Order, Page, Value, tiff};
use super::{documented, file};
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;

/// A stack of `n` pages of 4 × 3 pixels, page k all k, with a description and 50 × 25 pixels a unit.
fn stack(text: &[u8], n: usize) -> Result<Stored, String> {
    let mut pages: Vec<Page> = (0..n)
        .map(|k| Page::grey(4, 3, vec![k as u64; 12]))
        .collect();
    pages[0] = pages[0]
        .clone()
        .with(270, Value::Ascii(text.to_vec()))
        .with(282, Value::Rational(50, 1))
        .with(283, Value::Rational(25, 1))
        .with(296, Value::Short(vec![1]));
    let (_dir, path) = file("a.tif", &tiff(&pages, Order::default()));
    scan::stored(&path).map_err(|e| e.to_string())
}

fn size(found: Result<Stored, String>) -> Option<[f64; 3]> {
    let size = found.unwrap().spacing_mm?;
    Some(size.map(|h| (h * 1e9).round() / 1e9))
}

fn imagej(lines: &str) -> Result<Stored, String> {
    stack(
        format!("ImageJ=1.54f\nimages=3\nslices=3\n{lines}").as_bytes(),
        3,
    )
}

const MM: &str = "unit=mm\nspacing=0.06\n";

#[test]
fn every_key_of_imagej_does_what_the_table_says() {
    let plain = imagej(MM).unwrap();
    assert_eq!(plain.spacing_mm, Some([0.02, 0.04, 0.06]));
    for row in documented(include_str!("../../src/image/description/imagej.rs")) {
        let key = row[0].as_str();
        let changed = imagej(&format!("{MM}{key}=7\n"));
        match row[1].split(':').next().unwrap() {
            "harmless" => {
                let found = changed.unwrap();
                assert_eq!(
                    (&found.values, found.spacing_mm),
                    (&plain.values, plain.spacing_mm),
                    "{key}"
                );
                assert_eq!(found.notes, plain.notes, "{key}");
            }
            "read" => {
                let seen = match key {
                    "images" => stack(b"ImageJ=1.54f\nimages=5\n", 3)
                        .is_err_and(|e| e.contains("5 slices, and holds 3")),
                    "channels" => {
                        changed.is_err_and(|e| e.contains("7 channels, 3 slices and 1 frames"))
                    }
                    "slices" => imagej("slices=3\nframes=2\n")
                        .is_err_and(|e| e.contains("3 slices and 2 frames")),
                    "frames" => {
                        stack(b"ImageJ=1.54f\nimages=3\nframes=3\n", 3)
                            .is_ok_and(|s| s.n == [4, 3, 3])
                            && stack(b"ImageJ=1.54f\nimages=3\nframes=3\nunit=mm\n", 3).is_ok_and(
                                |s| s.notes.join("").contains("frames of time: read as slices"),
                            )
                    }
                    "unit" => size(imagej("unit=um\nspacing=60\n")) == Some([2e-5, 4e-5, 0.06]),
                    "yunit" => size(imagej(&format!("{MM}yunit=cm\n"))) == Some([0.02, 0.4, 0.06]),
                    "zunit" => size(imagej(&format!("{MM}zunit=um\n"))) == Some([0.02, 0.04, 6e-5]),
                    "spacing" => {
                        size(imagej("unit=mm\nspacing=-0.06\n")) == Some([0.02, 0.04, 0.06])
                            && size(imagej("unit=mm\n")) == Some([0.02, 0.04, 1.0])
                            && imagej("unit=mm\n").is_ok_and(|s| s.notes.join("").contains("1 mm"))
                    }
                    "cf" | "c0" | "c1" => imagej(&format!("{MM}cf=0\nc0=-1000\nc1=2\n"))
                        .is_ok_and(|s| s.values[35] == -996.0),
                    "vunit" => imagej(&format!("{MM}cf=0\nc0=-1000\nc1=2\nvunit=HU\n"))
                        .is_ok_and(|s| s.unit.as_deref() == Some("HU")),
                    _ => panic!("no file for {key}"),
                };
                assert!(seen, "{key}");
            }
            other => panic!("{key}: `{other}` is no word of the table"),
        }
    }
}

#[test]
fn units_are_read_however_they_are_spelled() {
    let expected = Some([2e-5, 4e-5, 0.06]);
    for unit in [
        "um",
        "µm",
        "μm",
        "micron",
        "microns",
        "micrometer",
        "micrometers",
        "\\u00B5m",
        "Micrometre",
    ] {
        assert_eq!(
            size(imagej(&format!("unit={unit}\nspacing=60\n"))),
            expected,
            "{unit}"
        );
    }
    // Latin-1, and UTF-8 that was taken for it.
    for unit in [&b"\xb5m"[..], b"\xc3\x82\xc2\xb5m"] {
        let text = [b"ImageJ=1.54f\nimages=3\nunit=", unit, b"\nspacing=60\n"].concat();
        assert_eq!(size(stack(&text, 3)), expected);
    }
    for (unit, said) in [("pixel", false), ("furlong", true)] {
        let found = imagej(&format!("unit={unit}\nspacing=60\n")).unwrap();
        assert_eq!(found.spacing_mm, None, "{unit}");
        assert!(!said || found.notes.is_empty() || found.notes.join("").contains(unit));
    }
}

/// OME-XML with these attributes of `Pixels`; the others are those of three slices of one channel.
fn ome(attributes: &[(&str, &str)], inside: &str) -> Vec<u8> {
    let mut all = vec![
        ("ID", "Pixels:0"),
        ("DimensionOrder", "XYZCT"),
        ("Type", "uint16"),
        ("SizeX", "4"),
        ("SizeY", "3"),
        ("SizeZ", "3"),
        ("SizeC", "1"),
        ("SizeT", "1"),
        ("PhysicalSizeX", "20"),
        ("PhysicalSizeY", "40"),
        ("PhysicalSizeZ", "60"),
    ];
    for (key, value) in attributes {
        all.retain(|(other, _)| other != key);
        all.push((key, value));
    }
    let words: Vec<String> = all.iter().map(|(k, v)| format!("{k}=\"{v}\"")).collect();
    format!(
        "<?xml version=\"1.0\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image ID=\"Image:0\"><Pixels {}>{inside}</Pixels></Image></OME>",
        words.join(" ")
    )
    .into_bytes()
}

#[test]
fn every_attribute_of_ome_does_what_the_table_says() {
    let with = |key: &str, value: &str| stack(&ome(&[(key, value)], ""), 3);
    let plain = stack(&ome(&[], ""), 3).unwrap();
    assert_eq!(size(Ok(plain.clone())), Some([0.02, 0.04, 0.06]));
    for row in documented(include_str!("../../src/image/description/ome.rs")) {
        let key = row[0].as_str();
        match row[1].split(':').next().unwrap() {
            "harmless" => {
                let found = with(key, "7").unwrap();
                assert_eq!(
                    (&found.values, found.spacing_mm, &found.notes),
                    (&plain.values, plain.spacing_mm, &plain.notes),
                    "{key}"
                );
            }
            "read" => {
                let seen = match key {
                    "SizeX" | "SizeY" => {
                        with(key, "7").is_err_and(|e| e.contains("pixels, its pages have 4 × 3"))
                    }
                    "SizeZ" => with(key, "7").is_err_and(|e| e.contains("7 slices, and holds 3")),
                    "SizeC" => with(key, "2").is_err_and(|e| e.contains("2 channels")),
                    "SizeT" => {
                        with(key, "2").is_err_and(|e| e.contains("3 slices at 2 times"))
                            && stack(&ome(&[("SizeZ", "1"), ("SizeT", "3")], ""), 3)
                                .is_ok_and(|s| s.n[2] == 3 && s.notes.join("").contains("times"))
                    }
                    "PhysicalSizeX" => size(with(key, "10")) == Some([0.01, 0.04, 0.06]),
                    "PhysicalSizeY" => size(with(key, "10")) == Some([0.02, 0.01, 0.06]),
                    "PhysicalSizeZ" => size(with(key, "10")) == Some([0.02, 0.04, 0.01]),
                    "PhysicalSizeXUnit" => {
                        size(with(key, "nm")) == Some([2e-5, 0.04, 0.06])
                            && with(key, "furlong").is_ok_and(|s| {
                                s.spacing_mm.is_none() && s.notes.join("").contains("furlong")
                            })
                    }
                    "PhysicalSizeYUnit" => size(with(key, "&#181;m")) == Some([0.02, 0.04, 0.06]),
                    "PhysicalSizeZUnit" => size(with(key, "mm")) == Some([0.02, 0.04, 60.0]),
                    _ => panic!("no file for {key}"),
                };
                assert!(seen, "{key}");
            }
            other => panic!("{key}: `{other}` is no word of the table"),
        }
    }
}

#[test]
fn ome_elements_that_are_no_one_scan_are_refused() {
    let pages = |inside: &str| stack(&ome(&[], inside), 3);
    let order = pages(
        "<TiffData IFD=\"0\" FirstZ=\"2\"/><TiffData IFD=\"1\" FirstZ=\"1\"/><TiffData IFD=\"2\" FirstZ=\"0\"/>",
    );
    assert_eq!(order.unwrap().values[0], 2.0);
    let set = "<TiffData IFD=\"0\"><UUID FileName=\"a.tif\">u</UUID></TiffData><TiffData FirstZ=\"1\"><UUID FileName=\"b.tif\">v</UUID></TiffData>";
    let two = String::from_utf8(ome(&[], ""))
        .unwrap()
        .replace("</OME>", "<Image><Pixels SizeZ=\"3\"/></Image></OME>");
    for (found, said) in [
        (pages("<TiffData IFD=\"0\"/>"), "names no page for slice 1"),
        (pages(set), "one of the 2 files"),
        (stack(two.as_bytes(), 3), "holds 2 images"),
        (
            stack(b"<OME><BinaryOnly MetadataFile=\"x\"/></OME>", 3),
            "in another file",
        ),
        (stack(b"<OME><Pixels", 3), "OME-XML description is damaged"),
    ] {
        let words = found.map(|s| s.n).unwrap_err();
        assert!(words.contains(said), "{words}");
    }
}

#[test]
fn tifffiles_shape_of_four_axes_is_refused() {
    assert_eq!(stack(b"{\"shape\": [3, 3, 4]}", 3).unwrap().n, [4, 3, 3]);
    assert_eq!(stack(b"{\"shape\": [1, 3, 3, 4]}", 3).unwrap().n, [4, 3, 3]);
    let words = stack(b"{\"shape\": [2, 2, 3, 4]}", 4)
        .map(|s| s.n)
        .unwrap_err();
    assert!(words.contains("shape [2, 2, 3, 4]"), "{words}");
}

#[test]
fn ome_attributes_are_read_however_they_are_written() {
    let plain = String::from_utf8(ome(&[], "")).unwrap();
    let micro =
        " PhysicalSizeXUnit=\"&#181;m\" PhysicalSizeYUnit=\"&#xB5;m\" PhysicalSizeZUnit=\"µm\">";
    for (kind, text) in [
        (
            "entities",
            plain.replacen("\"></Pixels", &format!("\"{micro}</Pixels"), 1),
        ),
        ("single quotes", plain.replace('"', "'")),
        (
            "line breaks",
            plain.replace(" PhysicalSize", "\n\tPhysicalSize"),
        ),
    ] {
        assert_ne!(text, plain, "{kind}");
        let found = size(stack(text.as_bytes(), 3));
        assert_eq!(found, Some([0.02, 0.04, 0.06]), "{kind}");
    }
    // Without sizes of its own the resolution tags are left: 50 and 25 pixels a centimetre.
    let bare = plain.replace(" PhysicalSize", " Other");
    let mut page = Page::grey(4, 3, vec![1; 12])
        .with(
            270,
            Value::Ascii(bare.replace("SizeZ=\"3\"", "SizeZ=\"1\"").into()),
        )
        .with(282, Value::Rational(50_000, 100))
        .with(283, Value::Rational(25_000, 100));
    page = page.with(296, Value::Short(vec![3]));
    let (_dir, path) = file("a.tif", &tiff(&[page], Order::default()));
    let found = scan::stored(&path).unwrap().spacing_mm.unwrap();
    assert!((found[0] - 0.02).abs() < 1e-9, "{found:?}");
}

#[test]
fn a_depth_that_imagej_leaves_out_is_one_and_its_sign_does_not_count() {
    assert_eq!(size(imagej("unit=mm\n")), Some([0.02, 0.04, 1.0]));
    assert_eq!(size(imagej("unit=um\n")), Some([2e-5, 4e-5, 0.001]));
    let negative = imagej("unit=mm\nspacing=-0.06\n");
    assert_eq!(size(negative), Some([0.02, 0.04, 0.06]));
}

#[test]
fn a_stack_of_times_alone_is_one_of_slices() {
    let found = stack(
        b"ImageJ=1.54f\nimages=3\nframes=3\nunit=mm\nspacing=0.06\n",
        3,
    )
    .unwrap();
    assert_eq!(
        (found.n, found.spacing_mm),
        ([4, 3, 3], Some([0.02, 0.04, 0.06]))
    );
    assert!(
        found.notes.join("").contains("read as slices"),
        "{:?}",
        found.notes
    );
    let both = stack(b"ImageJ=1.54f\nimages=4\nslices=2\nframes=2\n", 4);
    assert!(
        both.map(|s| s.n)
            .unwrap_err()
            .contains("2 slices and 2 frames")
    );
}
