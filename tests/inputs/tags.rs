//! TIFF's tags, row by row of the reader's table, and how pages are stored.

use super::write::{Order, Packing, Page, Value, tiff};
use super::{documented, file};
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;

const TABLE: &str = include_str!("../../src/image/tiff/tags.rs");

fn read(pages: &[Page]) -> Result<Stored, String> {
    let (_dir, path) = file("a.tif", &tiff(pages, Order::default()));
    scan::stored(&path).map_err(|e| e.to_string())
}

/// Six pixels of 16 bits.
fn plain() -> Page {
    Page::grey(3, 2, vec![1, 200, 65_535, 4, 0, 300])
}

const VALUES: [f32; 6] = [1.0, 200.0, 65_535.0, 4.0, 0.0, 300.0];

fn short(n: u16) -> Value {
    Value::Short(vec![n])
}

/// Whether what was read shows a change.
type Seen = fn(Result<Stored, String>) -> bool;

/// A change that only this tag makes, and what has to be seen of it.
fn effect(tag: u16) -> Option<(Vec<Page>, Seen)> {
    let tagged = |value| plain().with(tag, value);
    let one = |page: Page| vec![page];
    Some(match tag {
        254 => (vec![plain(), tagged(short(1)), plain()], |s| {
            s.is_ok_and(|s| s.n == [3, 2, 2] && s.notes.join("").contains("left out"))
        }),
        255 => (vec![plain(), tagged(short(2))], |s| {
            s.is_ok_and(|s| s.n == [3, 2, 1])
        }),
        256 | 257 => {
            let page = Page::grey(2, 3, plain().values);
            (one(page), |s| s.is_ok_and(|s| s.n == [2, 3, 1]))
        }
        258 => {
            let page = Page {
                bits: 12,
                values: vec![1, 4095, 2, 3, 4, 5],
                ..plain()
            };
            (one(page), |s| {
                s.is_ok_and(|s| s.values == [1.0, 4095.0, 2.0, 3.0, 4.0, 5.0])
            })
        }
        259 => (one(tagged(short(34925))), |s| {
            s.is_err_and(|e| e.contains("compressed by LZMA") && e.contains("sound"))
        }),
        262 => (one(tagged(short(0))), |s| {
            s.is_ok_and(|s| s.values == VALUES && s.notes.join("").contains("white"))
        }),
        266 => {
            let page = Page {
                reversed_bits: true,
                ..plain()
            };
            (one(page), |s| s.is_ok_and(|s| s.values == VALUES))
        }
        270 => {
            let text = Value::Ascii(b"ImageJ=1.54f\nunit=mm\n".to_vec());
            let page = tagged(text)
                .with(282, Value::Rational(50, 1))
                .with(283, Value::Rational(25, 1));
            (one(page), |s| {
                s.is_ok_and(|s| s.spacing_mm == Some([0.02, 0.04, 0.04]))
            })
        }
        273 | 278 | 279 => {
            let page = Page {
                rows_per_strip: 1,
                packing: Packing::Deflate,
                ..plain()
            };
            (one(page), |s| s.is_ok_and(|s| s.values == VALUES))
        }
        277 | 338 => {
            let page = Page {
                samples: 2,
                values: vec![7, 1, 8, 2, 9, 3, 10, 4, 11, 5, 12, 6],
                ..plain()
            };
            let opacity = page.clone().with(338, short(2));
            match tag {
                277 => (one(page), |s| {
                    s.is_err_and(|e| e.contains("2 samples (channels)"))
                }),
                _ => (one(opacity), |s| {
                    s.is_ok_and(|s| {
                        s.values == [7.0, 8.0, 9.0, 10.0, 11.0, 12.0]
                            && s.notes.join("").contains("alpha")
                    })
                }),
            }
        }
        282 | 283 | 296 => {
            let page = plain()
                .with(282, Value::Rational(51_282, 100))
                .with(283, Value::Rational(51_282, 100))
                .with(296, short(3));
            (one(page), |s| {
                s.is_ok_and(|s| {
                    s.spacing_mm.is_some_and(|h| (h[0] - 0.0195).abs() < 1e-6)
                        && s.notes.join("").contains("resolution tags")
                })
            })
        }
        317 => {
            let page = Page {
                predictor: 2,
                ..plain()
            };
            (one(page), |s| s.is_ok_and(|s| s.values == VALUES))
        }
        320 => (one(palette(|i| 255 - i)), |s| {
            s.is_ok_and(|s| {
                s.values == [0.0, 1.0, 255.0, 4.0, 5.0, 6.0] && s.notes.join("").contains("palette")
            })
        }),
        322..=325 => {
            let page = Page {
                tile: Some([16, 16]),
                ..plain()
            };
            (one(page), |s| s.is_ok_and(|s| s.values == VALUES))
        }
        339 => (one(tagged(short(5))), |s| {
            s.is_err_and(|e| e.contains("complex numbers"))
        }),
        // Only read beside JPEG, which cannot be written here: a table too short is refused.
        347 => (
            one(plain().with(259, short(7)).with(347, Value::Bytes(vec![1]))),
            |s| s.is_err(),
        ),
        _ => return None,
    })
}

fn palette(shade: impl Fn(u16) -> u16) -> Page {
    let table: Vec<u16> = (0..768).map(|i| shade(i % 256) * 257).collect();
    Page {
        bits: 8,
        values: vec![0, 1, 255, 4, 5, 6],
        photometric: 3,
        ..plain()
    }
    .with(320, Value::Short(table))
}

/// What makes a file with a tag that is refused.
fn refused(tag: u16) -> Page {
    let page = match tag {
        284 => Page {
            samples: 2,
            values: [plain().values, plain().values].concat(),
            ..plain()
        },
        _ => plain(),
    };
    page.with(tag, Value::Long(vec![2]))
}

#[test]
fn every_tag_does_what_the_table_says() {
    for row in documented(TABLE) {
        let tag: u16 = row[0].parse().unwrap();
        let what = row[2].split(':').next().unwrap();
        match what {
            "read" => {
                let (pages, seen) = effect(tag).unwrap_or_else(|| panic!("no file for tag {tag}"));
                let found = read(&pages);
                let words = format!(
                    "{:?}",
                    found
                        .as_ref()
                        .map(|s| (s.n, &s.values, s.spacing_mm, &s.notes))
                );
                assert!(seen(found), "tag {tag}: {words}");
            }
            "refused" => {
                let words = read(&[refused(tag)]).map(|s| s.values).unwrap_err();
                assert!(words.contains("what to do"), "tag {tag}: {words}");
            }
            "said" => {
                let found = read(&[plain().with(tag, short(3))]).unwrap();
                assert_eq!(found.values, VALUES, "tag {tag}");
                assert!(!found.notes.is_empty(), "tag {tag}");
            }
            "harmless" => {
                for value in [
                    short(3),
                    Value::Ascii(b"3.5".to_vec()),
                    Value::Rational(7, 2),
                ] {
                    let found = read(&[plain().with(tag, value)]).unwrap();
                    assert_eq!(
                        (found.values.as_slice(), found.spacing_mm),
                        (&VALUES[..], None),
                        "tag {tag}"
                    );
                    assert!(found.notes.is_empty(), "tag {tag}: {:?}", found.notes);
                }
            }
            other => panic!("tag {tag}: `{other}` is no word of the table"),
        }
    }
}

#[test]
fn samples_of_every_width_are_read_in_every_packing() {
    for bits in (1..=24).chain([32]) {
        let most = u64::MAX >> (64 - bits);
        let values: Vec<u64> = (0..77u64)
            .map(|i| i.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 7 & most)
            .collect();
        let expected: Vec<f32> = values.iter().map(|&v| v as f32).collect();
        let page = Page {
            bits,
            ..Page::grey(11, 7, values)
        };
        for packing in [
            Packing::None,
            Packing::Deflate,
            Packing::Lzw,
            Packing::PackBits,
            Packing::Zstandard,
        ] {
            for reversed_bits in [false, true] {
                for photometric in [0, 1] {
                    for tile in [None, Some([16, 16])] {
                        let page = Page {
                            packing,
                            reversed_bits,
                            photometric,
                            tile,
                            rows_per_strip: 3,
                            ..page.clone()
                        };
                        let found = read(&[page])
                            .unwrap_or_else(|e| panic!("{bits} bits, {packing:?}: {e}"));
                        assert_eq!(
                            found.values, expected,
                            "{bits} bits, {packing:?}, {reversed_bits}, {tile:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn white_for_0_leaves_floats_as_they_are() {
    let values = [0.1f32, 0.7, 1.0, -3.0, 0.0, 1e9];
    let bits = values.map(|v| u64::from(v.to_bits())).to_vec();
    for predictor in [1, 3] {
        let page = Page {
            bits: 32,
            format: 3,
            photometric: 0,
            predictor,
            ..Page::grey(3, 2, bits.clone())
        };
        assert_eq!(read(&[page]).unwrap().values, values);
    }
}

#[test]
fn colours_are_read_where_they_are_grey_and_else_refused_as_sound() {
    let grey = Page {
        samples: 3,
        photometric: 2,
        values: vec![5, 5, 5, 6, 6, 6],
        ..Page::grey(2, 1, vec![])
    };
    let found = read(std::slice::from_ref(&grey)).unwrap();
    assert_eq!(found.values, [5.0, 6.0]);
    let coloured = Page {
        values: vec![5, 5, 5, 6, 7, 6],
        ..grey
    };
    for page in [coloured, palette(|i| i % 7)] {
        let words = read(&[page]).map(|s| s.values).unwrap_err();
        assert!(words.contains("the file is sound"), "{words}");
    }
    // A table of colours from ImageJ shows labels; one in a straight line changes nothing.
    let labels = palette(|i| i % 7).with(270, Value::Ascii(b"ImageJ=1.54f\n".to_vec()));
    for page in [labels, palette(|i| i)] {
        assert_eq!(
            read(&[page]).unwrap().values,
            [0.0, 1.0, 255.0, 4.0, 5.0, 6.0]
        );
    }
    let faded = Page {
        samples: 2,
        values: vec![5, 65_535, 6, 65_535],
        ..Page::grey(2, 1, vec![])
    };
    let faded = faded.with(338, short(1));
    assert_eq!(
        read(std::slice::from_ref(&faded)).unwrap().values,
        [5.0, 6.0]
    );
    let words = read(&[Page {
        values: vec![5, 65_535, 6, 9],
        ..faded
    }])
    .map(|s| s.values)
    .unwrap_err();
    assert!(words.contains("multiplied by an opacity"), "{words}");
}

#[test]
fn pages_of_two_kinds_are_refused() {
    for (other, said) in [
        (
            Page { bits: 8, ..plain() },
            "page 2 holds uint8, the first uint16",
        ),
        (
            Page {
                format: 2,
                ..plain()
            },
            "page 2 holds int16",
        ),
        (
            Page {
                photometric: 0,
                ..plain()
            },
            "white for 0",
        ),
        (Page::grey(2, 3, plain().values), "page 2 has 2 × 3 pixels"),
    ] {
        let words = read(&[plain(), other]).map(|s| s.n).unwrap_err();
        assert!(words.contains(said), "{words}");
    }
}

#[test]
fn resolutions_of_printers_are_no_voxel_sizes() {
    let size = |per_unit: u32, unit: u16| {
        let page = plain()
            .with(282, Value::Rational(per_unit, 100))
            .with(283, Value::Rational(per_unit, 100))
            .with(296, short(unit));
        read(&[page]).unwrap().spacing_mm.map(|h| h[0])
    };
    for (per_unit, unit) in [
        (7200, 2),
        (14_400, 2),
        (24_000, 2),
        (30_000, 2),
        (240_000, 2),
        (11_811, 3),
        (2835, 3),
        (5900, 3),
        (100, 1),
    ] {
        assert_eq!(
            size(per_unit, unit),
            None,
            "{per_unit} / 100 in unit {unit}"
        );
    }
    assert_eq!(size(50_000, 3), Some(0.02));
    assert_eq!(size(127_000, 2), Some(0.02));
}
