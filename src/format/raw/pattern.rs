//! Owns the names of numbered files that NRRD and MetaImage headers give as `slice%03d.raw 0 7 1`.

/// More files than this are a damaged number: NIfTI-1 holds no more slices, and a million names take 90 MB.
const MOST: i64 = 32_767;

/// The names that `text` stands for: a pattern with one `%d` (`%3d`, `%03d`), first number, last number and step, where the
/// step may be left out. None where it is no such pattern, so that it is a name itself.
pub fn names(text: &str) -> Option<Vec<String>> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let of = |tail: &[&str]| -> Option<Vec<i64>> { tail.iter().map(|w| w.parse().ok()).collect() };
    // NRRD may add how many dimensions a file has; that follows from the number of files.
    let numbers = [4, 3, 2].into_iter().find_map(|count| {
        let at = words.len().checked_sub(count).filter(|at| *at > 0)?;
        Some((at, of(&words[at..])?))
    });
    let (at, numbers) = numbers?;
    let pattern = words[..at].join(" ");
    let (before, rest) = pattern.split_once('%')?;
    let digits = rest.chars().take_while(char::is_ascii_digit).count();
    let (width, after) = (
        &rest[..digits],
        rest[digits..].strip_prefix(['d', 'i', 'u'])?,
    );
    let (first, last) = (numbers[0], numbers[1]);
    let step = numbers.get(2).copied().unwrap_or(1);
    let fits = step != 0 && last.checked_sub(first)?.checked_div(step)? < MOST;
    let zeros = width.starts_with('0');
    let width: usize = width.parse().unwrap_or(0);
    if !fits || (last - first).signum() * step.signum() < 0 || width > 20 {
        return None;
    }
    let number = |v: i64| match zeros {
        true => format!("{before}{v:0width$}{after}"),
        false => format!("{before}{v:width$}{after}"),
    };
    let count = (last - first) / step + 1;
    Some((0..count).map(|k| number(first + k * step)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_count_as_printf_does() {
        let of = |text: &str| names(text).unwrap();
        assert_eq!(of("s%03d.raw 8 10 1"), ["s008.raw", "s009.raw", "s010.raw"]);
        assert_eq!(of("a b%d 4 0 -2"), ["a b4", "a b2", "a b0"]);
        assert_eq!(of("%2d.z 9 10 1 2"), [" 9.z", "10.z"]);
        assert_eq!(of("s%d.raw 1 2"), ["s1.raw", "s2.raw"]);
        assert_eq!(of("a%d 1 32767 1").len(), 32_767);
        for no in [
            "scan.raw",
            "100%d",
            "a %d 0 9 0",
            "a%d 0 99999999999 1",
            "a%d 0 32767 1",
            "a%s 0 1 1",
        ] {
            assert_eq!(names(no), None, "{no}");
        }
    }
}
