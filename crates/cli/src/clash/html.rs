//! A clash list as one HTML file: summary, overview, table, and a picture of each clash.

use std::io::{self, Write};

use crate::clash::list::List;
use crate::clash::pictures::Pictures;
use crate::clash::table::{cells, sentence};
use crate::digits::{grouped, short};
use crate::html::{escaped, image};

const STYLE: &str = "\
body{font:15px/1.45 system-ui,sans-serif;color:#1e2228;max-width:1120px;margin:2em auto;padding:0 1em}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.8em}
img{max-width:100%;display:block;background:#eef0f3}
table{border-collapse:collapse;width:100%}
th,td{text-align:left;padding:.3em .7em;border-bottom:1px solid #d5d9de;font-variant-numeric:tabular-nums}
th{cursor:pointer;user-select:none;white-space:nowrap}
th[aria-sort=ascending]::after{content:' \\25b2'}th[aria-sort=descending]::after{content:' \\25bc'}
.a,.b,.hard,.clearance{display:inline-block;width:.8em;height:.8em;border-radius:2px;margin-right:.4em}
.a{background:#4a90d9}.b{background:#f08c2e}.hard{background:#c4162a}.clearance{background:#7e3ca0}
.clashes{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:1.2em}
figure{margin:0}figcaption{font-size:.9em;padding-top:.3em}
footer{margin-top:2em;color:#5a6270;font-size:.9em}
@media print{th{cursor:auto}figure{break-inside:avoid}}
";

/// Sorts the table by the header that is clicked, and in reverse at a second click. Equal rows keep
/// their order.
const SCRIPT: &str = "\
for(const th of document.querySelectorAll('th'))th.onclick=()=>{
const up=th.getAttribute('aria-sort')!=='ascending',k=th.cellIndex,body=document.querySelector('tbody');
const key=row=>{const v=row.cells[k].dataset.v;return v===undefined?row.cells[k].textContent:+v};
const rows=[...body.rows].sort((p,q)=>{const x=key(p),y=key(q);return(x<y?-1:x>y?1:0)*(up?1:-1)});
for(const h of th.parentNode.cells)h.removeAttribute('aria-sort');
th.setAttribute('aria-sort',up?'ascending':'descending');body.append(...rows)};
";

/// Writes the page. Deterministic: the same list gives the same bytes.
pub(crate) fn write(list: &List<'_>, pictures: &Pictures, out: &mut impl Write) -> io::Result<()> {
    let [a, b] = list.inputs.map(|path| {
        escaped(&path.file_name().map_or_else(|| path.to_string_lossy(), |name| name.to_string_lossy()))
    });
    writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>Clashes of {a} and {b}</title>\n\
         <style>\n{STYLE}</style>\n<h1>Clashes of {a} and {b}</h1>"
    )?;
    summary(list, [&a, &b], out)?;
    writeln!(out, "<h2>Overview</h2>")?;
    let told = if list.found.clashes.is_empty() { "" } else { ", with the numbers of the clashes" };
    image(&pictures.overview, &format!("{a} and {b}{told}"), out)?;
    if let Some(picture) = &pictures.surroundings {
        writeln!(out, "<h2>Around the smaller scan</h2>")?;
        image(picture, &format!("the surroundings of the smaller scan{told}"), out)?;
    }
    if !list.found.clashes.is_empty() {
        table(list, pictures.close.len(), out)?;
        figures(list, pictures, out)?;
    }
    writeln!(
        out,
        "<footer>Lengths are in world units. The size of a clash is the size of the axis-aligned box around its contacts. \
         Each pair of leaves of the two scans that touch or come too close has one contact. A distance from x to y is \
         proven to be at least x and shown to be at most y.</footer>"
    )?;
    if !list.found.clashes.is_empty() {
        writeln!(out, "<script>\n{SCRIPT}</script>")?;
    }
    writeln!(out, "</html>")
}

fn summary(list: &List<'_>, [a, b]: [&str; 2], out: &mut impl Write) -> io::Result<()> {
    let points = list.views.map(|view| grouped(view.scan().len() as u64));
    writeln!(out, "<p><strong>{}</strong></p>\n<ul>", escaped(&sentence(list, None)))?;
    writeln!(out, "<li><span class=\"a\"></span>a: {a}, {} points</li>", points[0])?;
    writeln!(out, "<li><span class=\"b\"></span>b: {b}, {} points</li>", points[1])?;
    writeln!(out, "<li><span class=\"hard\"></span>hard clashes: the scans touch</li>")?;
    let clearance = list.plan.clearance();
    if clearance > 0.0 {
        let near = short(clearance);
        writeln!(
            out,
            "<li><span class=\"clearance\"></span>clearance clashes: the scans come closer than {near} without \
             contact</li>"
        )?;
    }
    writeln!(out, "</ul>")
}

fn table(list: &List<'_>, pictured: usize, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "<h2>List</h2>\n<table>\n<thead><tr>")?;
    for head in ["Clash", "Kind", "Centre", "Size", "Distance", "Contacts"] {
        write!(out, "<th scope=\"col\">{head}</th>")?;
    }
    writeln!(out, "</tr></thead>\n<tbody>")?;
    for clash in list.reports() {
        let [id, kind, centre, size, distance, contacts] = cells(list, &clash).map(|cell| escaped(&cell));
        let number = if clash.id <= pictured { format!("<a href=\"#clash-{id}\">{id}</a>") } else { id };
        let (x, diagonal) = (clash.centre[0], clash.size.into_iter().fold(0.0, f64::hypot));
        write!(out, "<tr><td data-v=\"{}\">{number}</td>", clash.id)?;
        write!(out, "<td><span class=\"{kind}\"></span>{kind}</td>")?;
        write!(out, "<td data-v=\"{x}\">{centre}</td><td data-v=\"{diagonal}\">{size}</td>")?;
        let apart = clash.depth.map_or(clash.upper, |depth| -depth);
        write!(out, "<td data-v=\"{apart}\">{distance}</td>")?;
        writeln!(out, "<td data-v=\"{}\">{contacts}</td></tr>", clash.contacts)?;
    }
    writeln!(out, "</tbody>\n</table>")
}

fn figures(list: &List<'_>, pictures: &Pictures, out: &mut impl Write) -> io::Result<()> {
    let (shown, all) = (pictures.close.len(), list.found.clashes.len());
    if shown == 0 {
        return Ok(());
    }
    writeln!(out, "<h2>Close views</h2>")?;
    if shown < all {
        writeln!(out, "<p>The first {shown} of {all}.</p>")?;
    }
    writeln!(out, "<div class=\"clashes\">")?;
    for (clash, picture) in list.reports().zip(&pictures.close) {
        let [id, kind, centre, size, distance, _] = cells(list, &clash).map(|cell| escaped(&cell));
        writeln!(out, "<figure id=\"clash-{id}\">")?;
        image(picture, &format!("close view of clash {id}"), out)?;
        let distance = match (clash.kind, clash.depth) {
            ("hard", None) => String::new(),
            ("hard", Some(_)) => format!(", {distance}"),
            _ => format!(", distance {distance}"),
        };
        writeln!(
            out,
            "<figcaption><strong>{id}</strong> <span class=\"{kind}\"></span>{kind}{distance}; size {size}, around \
             {centre}; point {} of a, {} of b</figcaption>\n</figure>",
            clash.source_a, clash.source_b
        )?;
    }
    writeln!(out, "</div>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out() {
        assert_eq!(escaped("<b> & \"c'.ply"), "&lt;b&gt; &amp; &quot;c&#39;.ply");
    }
}
