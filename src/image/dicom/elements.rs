//! Owns the elements of a DICOM data set: values by tag, as slices of what was read.

pub type Tag = [u16; 2];
pub const PIXEL_DATA: Tag = [0x7FE0, 0x0010];

/// The elements of a file, or of an item of a sequence, in their order.
#[derive(Debug, Clone, Default)]
pub struct Set<'a> {
    pub elements: Vec<(Tag, Value<'a>)>,
    pub big_endian: bool,
}

#[derive(Debug, Clone)]
pub enum Value<'a> {
    Bytes(&'a [u8]),
    Items(Vec<Set<'a>>),
    /// Compressed pixels: the table of offsets, then the fragments.
    Fragments(Vec<&'a [u8]>),
}

impl<'a> Set<'a> {
    pub fn get(&self, tag: Tag) -> Option<&Value<'a>> {
        let found = self.elements.iter().find(|(found, _)| *found == tag);
        found.map(|(_, value)| value)
    }

    pub fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        match self.get(tag)? {
            Value::Bytes(bytes) => Some(bytes),
            _ => None,
        }
    }

    pub fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?);
        let text = text.trim_matches(['\0', ' ', '\n', '\r', '\t']);
        (!text.is_empty()).then(|| text.to_string())
    }

    /// Numbers written as text, divided by backslashes; None where a word is no finite number.
    pub fn decimals(&self, tag: Tag) -> Option<Vec<f64>> {
        self.text(tag)?
            .split('\\')
            .map(|word| word.trim().parse().ok().filter(|v: &f64| v.is_finite()))
            .collect()
    }

    pub fn decimal(&self, tag: Tag) -> Option<f64> {
        self.decimals(tag)?.first().copied()
    }

    /// Numbers of two bytes.
    pub fn shorts(&self, tag: Tag) -> Vec<u16> {
        let pairs = self.bytes(tag).unwrap_or_default().chunks_exact(2);
        pairs
            .map(|b| match self.big_endian {
                true => u16::from_be_bytes([b[0], b[1]]),
                false => u16::from_le_bytes([b[0], b[1]]),
            })
            .collect()
    }

    pub fn short(&self, tag: Tag) -> Option<u16> {
        self.shorts(tag).first().copied()
    }

    /// The items of a sequence; none where it is missing.
    pub fn items(&self, tag: Tag) -> &[Set<'a>] {
        match self.get(tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    /// The first item of a sequence.
    pub fn item(&self, tag: Tag) -> Option<&Set<'a>> {
        self.items(tag).first()
    }
}
