//! How much memory this run has used at most.

/// Peak resident memory of this process so far, bytes (`VmHWM` of `/proc/self/status`); `None` where the system
/// does not say.
pub fn peak_bytes() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn parse(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_s_line_is_read() {
        assert_eq!(parse("VmPeak:\t  10 kB\nVmHWM:\t   2048 kB\nThreads:\t1\n"), Some(2048 * 1024));
        assert_eq!(parse("VmPeak:\t  10 kB\n"), None);
        assert!(peak_bytes().is_some_and(|b| b > 1 << 20));
    }
}
