//! The legend below a picture: the meaning of its colours, and a sentence about it.

use crate::canvas::{Area, Canvas, Colour, FINE};
use crate::font;

/// Size of letters; see [`Canvas::text`].
pub const LETTERS: usize = 2 * FINE;

/// Height of a line, in fine pixels.
pub const LINE: usize = 26 * FINE;

const INK: Colour = [30, 34, 40];
const PATCH: usize = font::CAPITAL * LETTERS;
const GAP: usize = 8 * FINE;

/// Space between entries.
const SPACE: usize = 26 * FINE;

/// Writes entries beside each other from `[left, top]`, `width` wide at most. An entry with a
/// colour has a patch of it in front. The longest entries are shortened until all fit.
pub fn entries(
    canvas: &mut Canvas,
    [mut left, top]: [usize; 2],
    width: usize,
    entries: &[(Option<Colour>, &str)],
) {
    let patch = |colour: &Option<Colour>| if colour.is_some() { PATCH + GAP } else { 0 };
    let fixed: usize = entries.iter().map(|(colour, _)| patch(colour) + SPACE).sum();
    let wanted: Vec<usize> = entries.iter().map(|(_, text)| Canvas::text_width(LETTERS, text)).collect();
    let most = shared(width.saturating_sub(fixed.saturating_sub(SPACE)), &wanted);
    for (colour, text) in entries {
        if let Some(colour) = colour {
            canvas.fill(Area { left, top, width: PATCH, height: PATCH }, *colour);
        }
        left += patch(colour);
        let text = font::elided(LETTERS, text, most);
        canvas.text([left, top], LETTERS, INK, &text);
        left += Canvas::text_width(LETTERS, &text) + SPACE;
    }
}

/// Writes a sentence from `[left, top]`, shortened to `width`.
pub fn sentence(canvas: &mut Canvas, [left, top]: [usize; 2], width: usize, text: &str) {
    canvas.text([left, top], LETTERS, INK, &font::elided(LETTERS, text, width));
}

/// Returns the greatest width of an entry with which all entries fit into `room`.
fn shared(room: usize, wanted: &[usize]) -> usize {
    let mut sorted = wanted.to_vec();
    sorted.sort_unstable();
    let mut left = room;
    for (i, &width) in sorted.iter().enumerate() {
        let share = left / (sorted.len() - i);
        if width > share {
            return share;
        }
        left -= width;
    }
    usize::MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_entries_share_what_short_ones_leave() {
        assert_eq!(shared(100, &[20, 30]), usize::MAX);
        assert_eq!(shared(100, &[20, 90, 300]), 40);
        assert_eq!(shared(100, &[80, 300]), 50);
        assert_eq!(shared(0, &[1]), 0);
    }

    #[test]
    fn entries_stay_within_their_width() {
        let name = "a-name-that-is-far-too-long-for-any-legend-".repeat(6);
        let mut canvas = Canvas::new(1200, 100, [255; 3]);
        entries(
            &mut canvas,
            [20, 20],
            900,
            &[(Some([9; 3]), &name), (None, &name), (Some([9; 3]), "B: short.ply")],
        );
        let picture = canvas.picture();
        let (width, _) = picture.size();
        let written = |x: usize| {
            picture.pixels.chunks(3 * width).any(|row| row[3 * x..3 * x + 3].iter().any(|&c| c < 200))
        };
        let last = (0..width).rev().find(|&x| written(x)).unwrap();
        assert!((840 / FINE..=920 / FINE).contains(&last), "{last}");
    }
}
