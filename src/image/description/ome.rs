//! Owns OME-XML, the description of OME-TIFF files (schema 2016-06 and older): sizes of axes and voxels, and which page is
//! which slice.
//!
//! Attributes of `Pixels`, and what becomes of each. A test of the repository reads this table and tries every row.
//!
//! | attribute | what becomes of it |
//! |---|---|
//! | SizeX | read: refused where the pages differ |
//! | SizeY | read: refused where the pages differ |
//! | SizeZ | read |
//! | SizeC | read: refused above 1 |
//! | SizeT | read: refused above 1 where there are several slices, else taken as slices with a note |
//! | DimensionOrder | harmless: with one channel, one order is left |
//! | PhysicalSizeX | read |
//! | PhysicalSizeXUnit | read: µm where it is missing; one that is no length is said |
//! | PhysicalSizeY | read |
//! | PhysicalSizeYUnit | read |
//! | PhysicalSizeZ | read |
//! | PhysicalSizeZUnit | read |
//! | Type | harmless: the pages' tags say it |
//! | SignificantBits | harmless |
//! | BigEndian | harmless: the file says it |
//! | Interleaved | harmless |
//! | TimeIncrement | harmless |
//! | TimeIncrementUnit | harmless |
//! | ID | harmless |
//!
//! Elements: several `Image` are refused; `TiffData` (IFD, FirstZ, FirstT, PlaneCount) orders the pages; one whose `UUID` names
//! several files, and `BinaryOnly`, are refused: the rest of the scan is elsewhere.

use crate::format::length::{is_pixel, millimetres_per};
use roxmltree::{Document, Node};
use std::collections::BTreeSet;

/// What a description says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ome {
    pub images: usize,
    /// Along x, y, z, channels and times; 0 where it does not say.
    pub sizes: [usize; 5],
    /// Along x, y, z.
    pub size_mm: [Option<f64>; 3],
    blocks: Vec<Block>,
    /// Files that hold planes of the image.
    pub files: usize,
    /// The description is in another file.
    pub elsewhere: bool,
    pub notes: Vec<String>,
}

/// Consecutive pages that are consecutive slices.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block {
    page: usize,
    slice: usize,
    /// None: all that follow.
    count: Option<usize>,
}

/// Whether a description is OME's.
pub fn is_ome(text: &str) -> bool {
    text.contains("<OME") || text.contains(":OME ")
}

/// # Errors
/// The text is no XML, or an attribute is no number.
pub fn parse(text: &str) -> Result<Ome, String> {
    let document = Document::parse(text.trim_matches(['\0', ' ', '\n', '\r', '\t', '\u{feff}']))
        .map_err(|e| format!("its OME-XML description is damaged ({e})"))?;
    let named = |name: &'static str| {
        let nodes = document.root().descendants();
        nodes.filter(move |node| node.has_tag_name_any(name))
    };
    let mut ome = Ome {
        images: named("Pixels").count(),
        elsewhere: named("BinaryOnly").next().is_some(),
        ..Ome::default()
    };
    let Some(pixels) = named("Pixels").next() else {
        return Ok(ome);
    };
    for (size, axis) in ome
        .sizes
        .iter_mut()
        .zip(["SizeX", "SizeY", "SizeZ", "SizeC", "SizeT"])
    {
        *size = count(pixels, axis)?.unwrap_or(0);
    }
    for a in 0..3 {
        ome.size_mm[a] = physical_size(pixels, ["X", "Y", "Z"][a], &mut ome.notes);
    }
    let mut files = BTreeSet::new();
    for data in pixels.children().filter(|n| n.has_tag_name_any("TiffData")) {
        let page = count(data, "IFD")?;
        let slice = count(data, "FirstZ")?.unwrap_or(0) + count(data, "FirstT")?.unwrap_or(0);
        let one = page.map(|_| 1);
        ome.blocks.push(Block {
            page: page.unwrap_or(0),
            slice,
            count: count(data, "PlaneCount")?.or(one),
        });
        let uuid = data.children().find(|n| n.has_tag_name_any("UUID"));
        files.extend(uuid.and_then(|n| n.attribute("FileName")));
    }
    ome.files = files.len();
    Ok(ome)
}

trait AnyNamespace {
    fn has_tag_name_any(&self, name: &str) -> bool;
}

impl AnyNamespace for Node<'_, '_> {
    /// Older schemas put elements in other namespaces.
    fn has_tag_name_any(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn count(node: Node, attribute: &str) -> Result<Option<usize>, String> {
    let Some(word) = node.attribute(attribute) else {
        return Ok(None);
    };
    match word.trim().parse() {
        Ok(n) if n < 1 << 40 => Ok(Some(n)),
        _ => Err(format!(
            "its OME-XML has {attribute} = `{word}`, a count was expected"
        )),
    }
}

fn physical_size(pixels: Node, axis: &str, notes: &mut Vec<String>) -> Option<f64> {
    let word = pixels.attribute(format!("PhysicalSize{axis}").as_str())?;
    let unit = pixels.attribute(format!("PhysicalSize{axis}Unit").as_str());
    let unit = unit
        .filter(|unit| !unit.trim().is_empty())
        .unwrap_or("\u{b5}m");
    let Some(mm) = millimetres_per(unit) else {
        if !is_pixel(unit) {
            notes.push(format!(
                "OME's size along {axis} has the unit `{unit}`, which is not known: it is not taken"
            ));
        }
        return None;
    };
    let value: f64 = word.trim().parse().ok()?;
    (value.is_finite() && value > 0.0).then_some(value * mm)
}

impl Ome {
    /// What speaks against taking the file for one scan, in words.
    pub fn fault(&self) -> Option<String> {
        let [_, _, z, c, t] = self.sizes;
        Some(match () {
            _ if self.elsewhere => {
                "is one part of an OME-TIFF set whose description is in another file".to_owned()
            }
            _ if self.images > 1 => format!("holds {} images (OME)", self.images),
            _ if self.files > 1 => format!("is one of the {} files of an OME-TIFF set", self.files),
            _ if c > 1 => format!("holds {c} channels (OME SizeC)"),
            _ if z > 1 && t > 1 => format!("holds {z} slices at {t} times (OME SizeZ, SizeT)"),
            _ => return None,
        })
    }

    /// Whether it says other pixels than a page has.
    pub fn contradicts(&self, [nx, ny]: [usize; 2]) -> bool {
        let [x, y, ..] = self.sizes;
        x > 0 && x != nx || y > 0 && y != ny
    }

    /// How many pages the scan has; None where it is not said.
    pub fn slices(&self) -> Option<usize> {
        let [_, _, z, _, t] = self.sizes;
        Some(z.max(1).checked_mul(t.max(1))?).filter(|_| z > 0 || t > 0)
    }

    /// The page (counted from 0) of each of `n` slices.
    ///
    /// # Errors
    /// A page that is not there, or not each slice once.
    pub fn pages_of(&self, n: usize) -> Result<Vec<usize>, String> {
        let mut pages = vec![None; n];
        for block in &self.blocks {
            let left = n.saturating_sub(block.slice);
            for i in 0..block.count.unwrap_or(left).min(n) {
                let (slice, page) = (block.slice + i, block.page + i);
                let known = pages.get(slice).is_some_and(Option::is_none) && page < n;
                if !known {
                    return Err(format!(
                        "its OME-XML puts page {page} at slice {slice} of {n}"
                    ));
                }
                pages[slice] = Some(page);
            }
        }
        if self.blocks.is_empty() {
            return Ok((0..n).collect());
        }
        let missing = pages.iter().position(Option::is_none);
        let mut seen: Vec<usize> = pages.iter().flatten().copied().collect();
        let found = seen.clone();
        seen.sort_unstable();
        seen.dedup();
        match missing {
            Some(slice) => Err(format!(
                "its OME-XML names no page for slice {slice} of {n}"
            )),
            None if seen.len() < n => Err("its OME-XML names one page for two slices".to_owned()),
            None => Ok(found),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_however_they_are_spelled() {
        for text in [
            r#"<OME><Pixels PhysicalSizeX="19.5" PhysicalSizeY="19.5" PhysicalSizeZ="39"/></OME>"#,
            "<OME xmlns=\"http://x\"><Image><Pixels PhysicalSizeX='19.5' PhysicalSizeXUnit='&#181;m'\n PhysicalSizeY='19500'\tPhysicalSizeYUnit='nm' PhysicalSizeZ='.039' PhysicalSizeZUnit='mm'/></Image></OME>",
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?><ome:OME xmlns:ome=\"http://y\"><ome:Pixels PhysicalSizeX=\"1.95E1\" PhysicalSizeXUnit=\"\u{b5}m\" PhysicalSizeY=\"19.5\" PhysicalSizeZ=\"39\"/></ome:OME>\0",
        ] {
            assert!(is_ome(text));
            let size = parse(text).unwrap().size_mm.map(Option::unwrap);
            let expected = [0.0195, 0.0195, 0.039];
            assert!(
                (0..3).all(|a| (size[a] - expected[a]).abs() < 1e-12),
                "{size:?}"
            );
        }
        assert!(parse("<OME><Pixels").is_err());
    }

    #[test]
    fn pages_are_put_in_the_order_of_slices() {
        let pages = |data: &str| {
            let text =
                format!("<OME><Pixels SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\">{data}</Pixels></OME>");
            parse(&text).unwrap().pages_of(3)
        };
        assert_eq!(pages("").unwrap(), [0, 1, 2]);
        assert_eq!(pages("<TiffData/>").unwrap(), [0, 1, 2]);
        assert_eq!(
            pages("<TiffData IFD='0' PlaneCount='3'/>").unwrap(),
            [0, 1, 2]
        );
        let reversed =
            "<TiffData IFD='0' FirstZ='2'/><TiffData IFD='1' FirstZ='1'/><TiffData IFD='2'/>";
        assert_eq!(pages(reversed).unwrap(), [2, 1, 0]);
        for wrong in [
            "<TiffData IFD='0'/>",
            "<TiffData IFD='0'/><TiffData IFD='0' FirstZ='1'/><TiffData IFD='0' FirstZ='2'/>",
            "<TiffData IFD='7' PlaneCount='3'/>",
        ] {
            assert!(pages(wrong).is_err(), "{wrong}");
        }
    }
}
