//! Owns what ImageJ and Fiji note in the description of a TIFF's first page: how many slices, their distance, and what the
//! values mean.
//!
//! Keys, one a line as `key=value` after `ImageJ=version`, and what becomes of each. A test of the repository reads this table
//! and tries every row.
//!
//! | key | what becomes of it |
//! |---|---|
//! | images | read: refused where the pages are others |
//! | channels | read: refused above 1 |
//! | slices | read |
//! | frames | read: refused above 1 where there are several slices, else taken as slices with a note |
//! | hyperstack | harmless |
//! | mode | harmless |
//! | order | harmless: with one channel, one order is left |
//! | unit | read: of x, and of y and z where they have none; one that is no length is said |
//! | yunit | read |
//! | zunit | read |
//! | spacing | read: without its sign; a stack without it has 1 unit |
//! | cf | read: 0 is a line; other functions are said and not applied |
//! | c0 | read |
//! | c1 | read |
//! | c2 | harmless |
//! | c3 | harmless |
//! | c4 | harmless |
//! | vunit | read: HU |
//! | xorigin | harmless |
//! | yorigin | harmless |
//! | zorigin | harmless |
//! | finterval | harmless |
//! | fps | harmless |
//! | tunit | harmless |
//! | loop | harmless |
//! | min | harmless |
//! | max | harmless |

use crate::format::length::{is_pixel, millimetres_per};

/// The notes of one file. 0 where a count is not in them.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct ImageJ {
    pub images: usize,
    pub channels: usize,
    pub slices: usize,
    pub frames: usize,
    /// Along x, y, z; empty where it is not in them.
    units: [String; 3],
    spacing: Option<f64>,
    pub grey: Grey,
}

/// More channels than ImageJ shows in colours of their own.
const MOST_CHANNELS: usize = 7;

impl ImageJ {
    /// What speaks against taking the file for one scan, in words.
    pub fn fault(&self) -> Option<String> {
        let [c, z, t] = [self.channels, self.slices, self.frames].map(|n| n.max(1));
        // Stacks saved without naming their axes (tifffile's default for three) are many channels of one slice.
        if c > MOST_CHANNELS && z == 1 && t == 1 {
            return None;
        }
        (c > 1 || z > 1 && t > 1)
            .then(|| format!("is an ImageJ hyperstack of {c} channels, {z} slices and {t} frames"))
    }

    /// Millimetres per unit along an axis; None for pixels and what is no length.
    fn unit_mm(&self, axis: usize) -> Option<f64> {
        millimetres_per(self.unit(axis))
    }

    fn unit(&self, axis: usize) -> &str {
        match self.units[axis].as_str() {
            "" => &self.units[0],
            own => own,
        }
    }

    /// Size of a pixel, of which there are `per_unit` in a unit.
    pub fn pixel_mm(&self, per_unit: [f64; 2]) -> Option<[f64; 2]> {
        Some([
            self.unit_mm(0)? / per_unit[0],
            self.unit_mm(1)? / per_unit[1],
        ])
    }

    /// Distance of the slices of a stack. ImageJ leaves it out where it is 1 unit.
    pub fn slice_mm(&self) -> Option<f64> {
        Some(self.spacing.unwrap_or(1.0) * self.unit_mm(2)?)
    }

    /// What a user should know of a stack's axes.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let unit = self.unit(axis);
            let own = axis == 0 || !self.units[axis].is_empty();
            if own && self.unit_mm(axis).is_none() && !is_pixel(unit) {
                notes.push(format!("ImageJ's unit along {name} is `{unit}`, which is no length that is known: the size is not taken"));
            }
        }
        if let (None, Some(mm)) = (self.spacing, self.slice_mm()) {
            notes.push(format!(
                "ImageJ's notes give no distance of slices, which means 1 {} ({mm} mm)",
                self.unit(2)
            ));
        }
        if self.frames > 1 {
            notes.push(format!(
                "ImageJ's notes call the {} slices frames of time: read as slices (in Fiji: Image > Properties, swap slices and frames)",
                self.frames
            ));
        }
        notes
    }
}

/// ImageJ's calibration of grey values (Analyze > Calibrate).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Grey {
    function: Function,
    /// The unit of the calibrated values is HU. Other units are not reported: they are free text.
    hounsfield: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Function {
    #[default]
    None,
    /// Value = c0 + c1 · stored value (ImageJ's function 0).
    Line([f64; 2]),
    /// Not applied: the number of another function, or of the line where its coefficients or the pixels are not of its kind.
    Other(i64),
}

/// ImageJ's numbers of its functions (`ij.measure.Calibration`).
const STRAIGHT_LINE: i64 = 0;
const NO_FUNCTION: i64 = 20;
/// ImageJ shows a signed 16-bit image as unsigned with this added, and the line is of those values.
const SIGNED_SHIFT: f64 = 32768.0;

impl Grey {
    /// Brings stored values to what ImageJ shows. `stored_as`: the pixels' type; ImageJ calibrates those of 8 and 16 bits.
    pub fn apply(&mut self, values: &mut [f32], stored_as: &str) {
        let Function::Line([c0, c1]) = self.function else {
            return;
        };
        let shift = match stored_as {
            "uint8" | "uint16" => 0.0,
            "int16" => SIGNED_SHIFT,
            _ => {
                self.function = Function::Other(STRAIGHT_LINE);
                return;
            }
        };
        for value in values {
            *value = (c0 + c1 * (f64::from(*value) + shift)) as f32;
        }
    }

    /// `HU` where that is what the values are.
    pub fn unit(&self) -> Option<String> {
        let applied = matches!(self.function, Function::Line(_));
        (applied && self.hounsfield).then(|| "HU".to_owned())
    }

    /// What was done, for the user.
    pub fn notes(&self) -> Vec<String> {
        match self.function {
            Function::None => Vec::new(),
            Function::Line([c0, c1]) => {
                vec![format!(
                    "grey values by ImageJ's calibration in the file: {c0} + {c1} · stored value"
                )]
            }
            Function::Other(number) => vec![format!(
                "ImageJ's calibration in the file (cf={number}) is no line for such pixels and was not applied: grey values are as stored"
            )],
        }
    }
}

/// Reads a description; the defaults where it is none of ImageJ's.
pub fn imagej(description: &str) -> ImageJ {
    let mut found = ImageJ::default();
    if !description.starts_with("ImageJ=") {
        return found;
    }
    let (mut function, mut line) = (NO_FUNCTION, [None; 2]);
    for (key, value) in description.lines().filter_map(|l| l.split_once('=')) {
        let value = value.trim();
        let number = || value.parse().ok().filter(|v: &f64| v.is_finite());
        match key.trim() {
            "images" => found.images = value.parse().unwrap_or(0),
            "channels" => found.channels = value.parse().unwrap_or(0),
            "slices" => found.slices = value.parse().unwrap_or(0),
            "frames" => found.frames = value.parse().unwrap_or(0),
            "unit" => found.units[0] = value.to_owned(),
            "yunit" => found.units[1] = value.to_owned(),
            "zunit" => found.units[2] = value.to_owned(),
            // Zero is ImageJ's own default, 1, too; its sign says which way the stage moved.
            "spacing" => found.spacing = number().map(f64::abs).filter(|s| *s > 0.0),
            "cf" => function = value.parse().unwrap_or(NO_FUNCTION),
            "c0" => line[0] = number(),
            "c1" => line[1] = number(),
            "vunit" => {
                let unit = value.to_lowercase();
                found.grey.hounsfield = unit == "hu" || unit.starts_with("hounsfield");
            }
            _ => {}
        }
    }
    found.grey.function = match (function, line) {
        (NO_FUNCTION, _) => Function::None,
        (STRAIGHT_LINE, [Some(c0), Some(c1)]) if c1 != 0.0 => Function::Line([c0, c1]),
        (other, _) => Function::Other(other),
    };
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(notes: &str, stored_as: &str) -> (Vec<f32>, Grey) {
        let mut grey = imagej(&format!("ImageJ=1.54f\n{notes}")).grey;
        let mut values = vec![-100.0, 0.0, 200.0];
        grey.apply(&mut values, stored_as);
        (values, grey)
    }

    #[test]
    fn a_line_is_applied_to_small_integers() {
        let hu = "cf=0\nc0=-1000.0\nc1=0.5\nvunit=HU\n";
        let (values, grey_of) = grey(hu, "uint16");
        assert_eq!(values, [-1050.0, -1000.0, -900.0]);
        assert_eq!(grey_of.unit().as_deref(), Some("HU"));
        assert!(grey_of.notes()[0].contains("-1000 + 0.5 · stored value"));
        // What ImageJ notes of a signed image: its values are those stored.
        let signed = "cf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n";
        let (values, grey_of) = grey(signed, "int16");
        assert_eq!((values, grey_of.unit()), (vec![-100.0, 0.0, 200.0], None));
        // Floats are not calibrated by ImageJ.
        let (values, grey_of) = grey(hu, "float32");
        assert_eq!((values[0], grey_of.unit()), (-100.0, None));
        assert!(grey_of.notes()[0].contains("not applied"));
    }

    #[test]
    fn other_functions_are_told_and_not_applied() {
        for (notes, words) in [
            ("cf=3\nc0=1\nc1=2\nvunit=HU\n", "cf=3"),
            ("cf=0\nc0=1\n", "cf=0"),
        ] {
            let (values, grey_of) = grey(notes, "uint8");
            assert_eq!(values, [-100.0, 0.0, 200.0]);
            assert_eq!(grey_of.unit(), None);
            assert!(grey_of.notes()[0].contains(words), "{:?}", grey_of.notes());
        }
        for none in ["", "cf=20\n", "c0=5\nc1=2\n"] {
            assert!(grey(none, "uint8").1.notes().is_empty());
        }
    }
}
