// What this process and machine use and have (Linux).
#pragma once

#include <cstdint>
#include <string>

namespace covsplat {

/// Resident memory; zeros where /proc does not tell.
struct MemoryUse {
  std::int64_t rss_bytes = 0;
  std::int64_t peak_rss_bytes = 0;
};

MemoryUse ReadMemoryUse();

/// From the text of /proc/self/status.
MemoryUse ParseMemoryUse(const std::string& status);

/// Processors that this process may use, at least 1.
int CpuCount();

/// "Intel(R) Xeon(R) ..., 2 CPUs", for reports.
std::string MachineName();

}  // namespace covsplat
