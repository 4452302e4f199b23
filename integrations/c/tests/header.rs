//! The header that is checked in is that of the sources.

use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("the configuration");
    let bindings = cbindgen::Builder::new().with_crate(root).with_config(config).generate();
    let mut made = Vec::new();
    bindings.expect("sources that cbindgen reads").write(&mut made);
    let (made, path) = (String::from_utf8(made).expect("text"), root.join("include/nearmiss.h"));
    if std::env::var_os("NEARMISS_WRITE_HEADER").is_some() {
        std::fs::write(&path, &made).expect("a header that can be written");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = made.lines().zip(kept.lines()).position(|(made, kept)| made != kept);
    assert!(
        made == kept,
        "expected the header of the sources, got another one (line {:?}); \
         run `NEARMISS_WRITE_HEADER=1 cargo test -p nearmiss-c`",
        differs.map_or(kept.lines().count() + 1, |line| line + 1)
    );
}
