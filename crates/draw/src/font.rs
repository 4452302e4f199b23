//! The typeface of pictures: Ubuntu Light, proportional and anti-aliased.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};

/// Height of a capital letter, as a multiple of the letter size.
pub const CAPITAL: usize = 7;

/// Height of a line of letters from the top of capitals to the lowest descender, as a multiple of
/// the letter size.
pub const LINE: usize = 9;

/// Widening of the strokes, as a share of the letter size. The face is light, and pictures are
/// often shown reduced.
const WIDENED: f32 = 0.2;

/// Replaces letters that are left out.
const ELLIPSIS: char = '…';

struct Face {
    font: FontRef<'static>,
    /// Height of a capital letter as a share of the scale.
    capital: f32,
}

static FACE: LazyLock<Option<Face>> = LazyLock::new(|| {
    let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
    let capital = font.outline(font.glyph_id('H'))?.bounds.height().abs() / font.height_unscaled();
    Some(Face { font, capital })
});

impl Face {
    /// The scale at which capital letters are [`CAPITAL`] times `size` high.
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    fn scale(&self, size: usize) -> PxScale {
        PxScale::from((CAPITAL * size) as f32 / self.capital)
    }

    /// Calls `visit` with each glyph of `text` and the position of its left end. Returns the right
    /// end of the last glyph.
    fn lay_out(&self, size: usize, text: &str, mut visit: impl FnMut(GlyphId, f32)) -> f32 {
        let scaled = self.font.as_scaled(self.scale(size));
        let mut x = 0.0;
        let mut last = None;
        for letter in text.chars() {
            let glyph = scaled.glyph_id(if letter.is_control() { '?' } else { letter });
            x += last.map_or(0.0, |last| scaled.kern(last, glyph));
            visit(glyph, x);
            x += scaled.h_advance(glyph);
            last = Some(glyph);
        }
        x
    }
}

/// Calls `paint` with column, row and coverage (0 to 1) of each pixel that a line of letters
/// covers; some pixels are visited more than once. Columns count from the left end of the first
/// letter, rows from the top of capital letters. Pixels of accents have negative rows, and those of
/// overhangs negative columns.
pub fn cover(size: usize, text: &str, mut paint: impl FnMut(i32, i32, f32)) {
    let Some(face) = &*FACE else { return };
    let scale = face.scale(size);
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let baseline = (CAPITAL * size) as f32;
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    let widened = WIDENED * size as f32;
    face.lay_out(size, text, |glyph, x| {
        for x in [x - 0.5 * widened, x + 0.5 * widened] {
            let placed = glyph.with_scale_and_position(scale, point(x, baseline));
            let Some(outline) = face.font.outline_glyph(placed) else { return };
            let corner = outline.px_bounds().min;
            #[expect(clippy::cast_possible_truncation, reason = "whole pixels; the cast saturates")]
            let [left, top] = [corner.x, corner.y].map(|c| c.floor() as i32);
            outline.draw(|column, row, share| {
                let at = |start: i32, offset: u32| start.saturating_add_unsigned(offset);
                paint(at(left, column), at(top, row), share);
            });
        }
    });
}

/// Returns the width of a line of letters, in whole pixels.
#[must_use]
pub fn width(size: usize, text: &str) -> usize {
    let width = FACE.as_ref().map_or(0.0, |face| face.lay_out(size, text, |_, _| ()));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
    let width = width.ceil() as usize;
    width
}

/// Returns `text` if it fits into `most` pixels. Otherwise, returns as much of its start and end as
/// fits, with an ellipsis in between.
#[must_use]
pub fn elided(size: usize, text: &str, most: usize) -> String {
    if width(size, text) <= most {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    let shortened = |kept: usize| {
        let (head, tail) = (&letters[..kept.div_ceil(2)], &letters[letters.len() - kept / 2..]);
        head.iter().chain([&ELLIPSIS]).chain(tail).collect::<String>()
    };
    let fits = |kept: &usize| width(size, &shortened(*kept)) <= most;
    (0..letters.len()).rev().find(fits).map(shortened).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the pixels of a line of letters that are covered by more than half.
    fn covered(text: &str) -> Vec<[i32; 2]> {
        let mut all = Vec::new();
        cover(4, text, |x, y, share| all.extend((share > 0.5).then_some([x, y])));
        all
    }

    #[test]
    fn letters_are_as_wide_as_they_are() {
        let [i, w, both] = ["i", "W", "iW"].map(|text| width(4, text));
        assert!(3 * i < w, "i is {i} wide, W {w}");
        assert!(both.abs_diff(i + w) <= 2, "{both}");
        assert_eq!(width(4, ""), 0);
        assert!(width(8, "spacing").abs_diff(2 * width(4, "spacing")) <= 2);
    }

    #[test]
    fn small_letters_differ_from_capitals_and_every_sign_in_use_has_a_shape() {
        assert_ne!(covered("r"), covered("R"));
        let missing = covered("\u{fffe}");
        for letter in "éüµ°×–…²³π0123456789%/()=+-_:;,.~±".chars() {
            let shape = covered(&letter.to_string());
            assert!(!shape.is_empty() && shape != missing, "{letter}");
        }
    }

    #[test]
    fn capitals_fill_their_height_and_descenders_stay_in_the_line() {
        let rows = |text: &str| {
            let rows: Vec<i32> = covered(text).into_iter().map(|[_, y]| y).collect();
            [rows.iter().copied().min().unwrap(), rows.iter().copied().max().unwrap()]
        };
        assert_eq!(rows("H"), [0, 4 * 7 - 1]);
        assert!(rows("gpq_").iter().all(|&y| (0..4 * 9).contains(&y)), "{:?}", rows("gpq_"));
    }

    #[test]
    fn long_names_keep_their_start_and_their_end() {
        let name = "A: a-very-long-name-of-a-scan-2026-11-24.laz";
        let most = width(4, name) / 2;
        let short = elided(4, name, most);
        assert!(short.starts_with("A: a-") && short.ends_with(".laz") && short.contains('…'), "{short}");
        let used = width(4, &short);
        assert!(used <= most && used + width(4, "WW") > most, "{used} of {most}");
        assert_eq!(elided(4, name, 2 * most + 2), name);
        assert_eq!(elided(4, name, 0), "");
    }
}
