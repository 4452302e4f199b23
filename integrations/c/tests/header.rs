//! The header that is checked in is that of the sources.

use std::path::Path;

/// The version of the header, which is that of the package.
const VERSION: &str = concat!(
    "\n/*\n The version of this header. That of the library must be the same: see `nearmiss_version`.\n */",
    "\n#define NEARMISS_VERSION \"",
    env!("CARGO_PKG_VERSION"),
    "\"\n#define NEARMISS_VERSION_MAJOR ",
    env!("CARGO_PKG_VERSION_MAJOR"),
    "\n#define NEARMISS_VERSION_MINOR ",
    env!("CARGO_PKG_VERSION_MINOR"),
    "\n#define NEARMISS_VERSION_PATCH ",
    env!("CARGO_PKG_VERSION_PATCH"),
);

#[test]
fn the_header_is_that_of_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("the configuration");
    config.after_includes = Some(VERSION.to_owned());
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
