//! The memory available to this process, and the option that limits it.

use std::fs;
use std::path::Path;

use clap::Args;

/// The option that limits memory.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct MemoryArgs {
    /// Memory limit, such as 500MB or 16GB
    ///
    /// By default, the memory that the system has available, or 4 GiB for `slices build`. A command
    /// that needs more is refused before it starts. If --memory is given and does not suffice, `slices
    /// build` works on disk, next to the output. `preprocess` does the same for points without a graph,
    /// if --crop and --class are the only filters.
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory: Option<u64>,
}

/// The number of bytes that a command may use, and the origin of that limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Limit {
    /// Set by `--memory`.
    Asked(u64),
    /// The memory that the machine, or the control group of the process, has left.
    Available(u64),
    /// Not known on this system.
    Unknown,
}

impl MemoryArgs {
    pub(crate) fn limit(self) -> Limit {
        match self.memory {
            Some(bytes) => Limit::Asked(bytes),
            None => available().map_or(Limit::Unknown, Limit::Available),
        }
    }
}

/// Returns the smaller of the memory left to the machine and to the control groups. Linux only.
fn available() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| mem_available(&text));
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let group = groups_left(&groups, Path::new("/sys/fs/cgroup"));
    machine.into_iter().chain(group).min()
}

/// Returns `MemAvailable` of `/proc/meminfo`, in bytes.
fn mem_available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// Returns the smallest amount that any control group of a process has left. `text` is the content
/// of `/proc/self/cgroup`; the folders of groups are below `root`.
fn groups_left(text: &str, root: &Path) -> Option<u64> {
    // A line is `number:controllers:path`; version 2 names no controllers.
    let places = text.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        let folder = match controllers {
            "" => root.to_owned(),
            _ if controllers.split(',').any(|name| name == "memory") => root.join("memory"),
            _ => return None,
        };
        Some((folder, path.trim_start_matches('/').to_owned()))
    });
    // The limits of parent groups apply too. In a container the path may be that of the host, so
    // missing files are skipped.
    let left = places.flat_map(|(folder, path)| {
        let groups: Vec<_> = Path::new(&path).ancestors().map(|group| folder.join(group)).collect();
        groups.into_iter().filter_map(|group| group_left(&group))
    });
    left.min()
}

/// Returns what a control group has left: its limit less its usage, not counting file pages that
/// can be dropped.
fn group_left(group: &Path) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let limit = number("memory.max").or_else(|| number("memory.limit_in_bytes"))?;
    let used = number("memory.current").or_else(|| number("memory.usage_in_bytes"))?;
    let counters = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
    let counter = |name: &str| {
        let value = counters.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        value.and_then(|value| value.trim().parse::<u64>().ok())
    };
    let droppable = counter("total_inactive_file").or_else(|| counter("inactive_file")).unwrap_or(0);
    Some(limit.saturating_sub(used.saturating_sub(droppable)))
}

/// Parses a number with a unit of memory; without a unit, the number counts bytes.
fn parse_size(text: &str) -> Result<u64, String> {
    let expected = || "expected a size of memory, such as 500MB, 1.5GiB or 16GB".to_owned();
    let lower = text.trim().to_ascii_lowercase();
    let unit = lower.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    let number: f64 = lower[..lower.len() - unit.len()].parse().map_err(|_not_a_number| expected())?;
    let factor = match unit.trim() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1_048_576.0,
        "gib" => 1_073_741_824.0,
        "tib" => 1_099_511_627_776.0,
        _ => return Err(expected()),
    };
    let bytes = (number * factor).round();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be in range")]
    if (1.0..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err(expected()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units_of_memory() {
        for (text, bytes) in [
            ("16GB", 16_000_000_000),
            ("1.5GiB", 1_610_612_736),
            ("500 mb", 500_000_000),
            ("4096", 4096),
            ("2K", 2000),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "GB", "-1GB", "0", "1 m/s", "1e99", "1..2GB", "nan"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_machine_says_what_is_available() {
        let text = "MemTotal:       24000 kB\nMemFree:  1 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(mem_available(text), Some(2_097_152));
        assert_eq!(mem_available("MemTotal: 1 kB\n"), None);
    }

    #[test]
    fn the_tightest_control_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let group = root.path().join("user/shell");
        fs::create_dir_all(&group).unwrap();
        let write = |folder: &Path, name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
        assert_eq!(groups_left("0::/user/shell\n", root.path()), None, "no limits");
        write(&group, "memory.max", "max\n");
        write(&group, "memory.current", "1000\n");
        assert_eq!(groups_left("0::/user/shell\n", root.path()), None, "still none");
        write(&root.path().join("user"), "memory.max", "5000\n");
        write(&root.path().join("user"), "memory.current", "3000\n");
        write(&root.path().join("user"), "memory.stat", "anon 10\ninactive_file 500\n");
        assert_eq!(groups_left("0::/user/shell\n", root.path()), Some(2500));
        assert_eq!(groups_left("0::/elsewhere/user\n", root.path()), None, "the path of a host");
        let old = root.path().join("memory");
        fs::create_dir_all(&old).unwrap();
        write(&old, "memory.limit_in_bytes", "900\n");
        write(&old, "memory.usage_in_bytes", "1000\n");
        assert_eq!(groups_left("4:cpu,memory:/\n3:cpu:/\n", root.path()), Some(0));
    }
}
