//! Description of the machine and the build that a record needs.

use std::process::Command;

/// Instruction sets beyond the baseline that the processor has.
fn processor_features() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    {
        let all = [
            ("sse4.2", is_x86_feature_detected!("sse4.2")),
            ("avx", is_x86_feature_detected!("avx")),
            ("avx2", is_x86_feature_detected!("avx2")),
            ("fma", is_x86_feature_detected!("fma")),
            ("f16c", is_x86_feature_detected!("f16c")),
            ("avx512f", is_x86_feature_detected!("avx512f")),
            ("avx512vl", is_x86_feature_detected!("avx512vl")),
        ];
        all.iter().filter(|(_, has)| *has).map(|(name, _)| *name).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    Vec::new()
}

/// Instruction sets that this program was compiled for. Run-time dispatch may use more.
fn compiled_features() -> Vec<&'static str> {
    let all = [
        ("sse2", cfg!(target_feature = "sse2")),
        ("sse4.2", cfg!(target_feature = "sse4.2")),
        ("avx2", cfg!(target_feature = "avx2")),
        ("fma", cfg!(target_feature = "fma")),
        ("f16c", cfg!(target_feature = "f16c")),
        ("avx512f", cfg!(target_feature = "avx512f")),
        ("neon", cfg!(target_feature = "neon")),
    ];
    all.iter().filter(|(_, has)| *has).map(|(name, _)| *name).collect()
}

/// The first line of a program's output, or "unknown".
fn line_of(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let text = output.ok().filter(|o| o.status.success()).and_then(|o| String::from_utf8(o.stdout).ok());
    text.and_then(|t| t.lines().next().map(String::from)).unwrap_or_else(|| "unknown".into())
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    model.map_or_else(|| std::env::consts::ARCH.into(), |(_, name)| name.trim().into())
}

/// Commit, compiler, processor, instruction sets, threads and the cost of a clock read, as a
/// Markdown list.
///
/// The commit is that of the source tree the program was compiled in, looked up at run time.
#[must_use]
pub fn description() -> String {
    let commit = line_of("git", &["rev-parse", "--short=12", "HEAD"]);
    let changed = match line_of("git", &["status", "--porcelain", "--untracked-files=no"]).as_str() {
        "unknown" => "",
        _ => " with changes",
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let build = if cfg!(debug_assertions) { ", **debug build**" } else { "" };
    format!(
        "* commit {commit}{changed}\n* {}{build}\n* {}, {threads} threads; queries run on one\n\
         * processor has: {}; compiled for: {}\n* an empty measurement takes {:.0} ns, part of every time below\n",
        line_of("rustc", &["--version"]),
        processor(),
        processor_features().join(" "),
        compiled_features().join(" "),
        crate::clock::cost(),
    )
}
