#include "apps/system_info.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <sched.h>

namespace covsplat {

MemoryUse ParseMemoryUse(const std::string& status) {
  MemoryUse use;
  std::istringstream lines(status);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    std::int64_t kilobytes = 0;
    if (!(words >> name >> kilobytes)) continue;
    if (name == "VmRSS:") use.rss_bytes = kilobytes * 1024;
    if (name == "VmHWM:") use.peak_rss_bytes = kilobytes * 1024;
  }
  // The kernel updates the two counters at different times.
  use.peak_rss_bytes = std::max(use.peak_rss_bytes, use.rss_bytes);
  return use;
}

MemoryUse ReadMemoryUse() {
  std::ostringstream status;
  status << std::ifstream("/proc/self/status").rdbuf();
  return ParseMemoryUse(status.str());
}

int CpuCount() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof(allowed), &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

std::string MachineName() {
  const int cpus = CpuCount();
  std::string count = fmt::format("{} CPU{}", cpus, cpus == 1 ? "" : "s");
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) {
      return line.substr(colon + 2) + ", " + count;
    }
  }
  return count;
}

}  // namespace covsplat
