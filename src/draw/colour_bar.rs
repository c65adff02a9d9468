//! Owns the colour bar of a field, and what its ends stand for.

use super::ink::{self, INK};
use super::map::{Range, short};
use crate::volume::Volume;
use image::RgbImage;

/// Width of a bar, pixels.
const WIDE: u32 = 24;

/// Colours end here: a few elements at the grips or at thin struts have many times what all others have.
const SHOWN: f64 = 0.98;

/// A field that colours a picture.
pub struct Coloured<'a> {
    /// One value a voxel of the mask, 0 where no element is.
    pub values: &'a Volume<f32>,
    /// With its unit, in lines, as `strain energy\ndensity (MPa)`.
    pub name: &'a str,
    /// What the ends of the colours stand for.
    pub range: Range,
}

/// Draws a bar with its upper left corner at `left`, `top`, the field's name over it and round values next to it, in letters
/// `px` high.
pub(super) fn draw(
    picture: &mut RgbImage,
    field: &Coloured,
    [left, top]: [u32; 2],
    length: u32,
    px: f32,
) {
    let range = field.range;
    for y in 0..length {
        let share = 1.0 - f64::from(y) / f64::from(length - 1);
        let colour = range.colour(range.low + share * (range.high - range.low));
        (0..WIDE).for_each(|x| picture.put_pixel(left + x, top + y, colour));
    }
    let end = (left + WIDE) as f32;
    for value in ticks(range) {
        let share = (value - range.low) / (range.high - range.low);
        let y = (f64::from(top) + (1.0 - share) * f64::from(length - 1)) as f32;
        ink::line(picture, [[end, y], [end + 6.0, y]], 1.4, INK, |_, _| true);
        let text = ink::with_minus(&short(value));
        ink::write(picture, [end + 11.0, y + 0.36 * px], px, &text);
    }
    for (k, line) in field.name.split('\n').rev().enumerate() {
        let y = top as f32 - 0.8 * px - 1.2 * px * k as f32;
        ink::write(picture, [left as f32, y], px, line);
    }
}

/// Multiples of a round step, three to seven of them.
fn ticks(range: Range) -> Vec<f64> {
    let step = ink::round_length((range.high - range.low) / 3.0);
    let [first, last] = [
        (range.low / step - 1e-6).ceil(),
        (range.high / step + 1e-6).floor(),
    ];
    (first as i64..=last as i64)
        .map(|k| k as f64 * step)
        .collect()
}

/// From 0 to what 98 % of the elements do not exceed, below 0 where nearly all values lie there; to both sides of 0 where
/// values are of either sign. None where all values are 0, which stands for no element.
pub fn range(values: &Volume<f32>) -> Option<Range> {
    let step = (values.grid.len() / 400_000).max(1);
    let sample = values.as_slice().iter().step_by(step).copied();
    let mut found: Vec<f32> = sample.filter(|v| *v != 0.0 && v.is_finite()).collect();
    found.sort_unstable_by(f32::total_cmp);
    let last = found.len().checked_sub(1)?;
    let at = |share: f64| f64::from(found[(share * last as f64).round() as usize]);
    let [below, above] = [(-at(1.0 - SHOWN)).max(0.0), at(SHOWN).max(0.0)];
    Some(if below <= 0.1 * above {
        Range {
            low: 0.0,
            high: rounded_up(above),
        }
    } else if above <= 0.1 * below {
        Range {
            low: -rounded_up(below),
            high: 0.0,
        }
    } else {
        let high = rounded_up(below.max(above));
        Range { low: -high, high }
    })
}

/// The next number of few digits.
fn rounded_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let steps = [
        1.0, 1.2, 1.5, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0,
    ];
    let least = steps
        .into_iter()
        .find(|step| step * power * (1.0 + 1e-6) >= value);
    least.map_or(value, |step| step * power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn range_of(values: &[f32]) -> Option<Range> {
        range(&Volume::from_vec(
            Grid::new([values.len(), 1, 1], [1.0; 3]),
            values.to_vec(),
        ))
    }

    #[test]
    fn colours_begin_at_zero_and_have_two_sides_only_where_values_do() {
        assert_eq!(range_of(&[0.0, 0.0]), None);
        assert_eq!(
            range_of(&[0.0, 0.3, 2.3]),
            Some(Range {
                low: 0.0,
                high: 2.5
            })
        );
        assert_eq!(
            range_of(&[-2.3, 0.1]),
            Some(Range {
                low: -2.5,
                high: 0.0
            })
        );
        assert_eq!(
            range_of(&[-2.3, 1.0]),
            Some(Range {
                low: -2.5,
                high: 2.5
            })
        );
    }

    #[test]
    fn ticks_are_round_and_lie_in_the_range() {
        let near = |a: Vec<f64>, b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        assert!(near(
            ticks(Range {
                low: 0.0,
                high: 0.13
            }),
            &[0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12]
        ));
        assert!(near(
            ticks(Range {
                low: -2.5,
                high: 2.5
            }),
            &[-2.0, -1.0, 0.0, 1.0, 2.0]
        ));
    }
}
