//! Parts of HTML pages.

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nearmiss_draw::picture::Picture;

/// Embeds a picture in the page. `told`, escaped already, is its alternative text.
pub(crate) fn image(picture: &Picture, told: &str, out: &mut impl Write) -> io::Result<()> {
    let (width, height) = picture.size();
    let mut png = Vec::new();
    picture.encode(&mut png)?;
    let data = STANDARD.encode(png);
    writeln!(
        out,
        "<img width=\"{width}\" height=\"{height}\" alt=\"{told}\" src=\"data:image/png;base64,{data}\">"
    )
}

/// Escapes text for HTML, also within quoted attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            letter => html.push(letter),
        }
    }
    html
}
