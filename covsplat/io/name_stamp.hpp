// Stamps in the names of scan files.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace covsplat {

/// Seconds since 1970 that the name of a file without its extension stands for, or nothing:
/// "1625135858.123456789", "cloud_1710338090_123456789" (seconds and nanoseconds), or whole
/// milli-, micro- or nanoseconds ("1625135858123456789"). Times from 2001 to 2286 are known.
std::optional<double> StampOfName(std::string_view stem);

/// Of all files, if every name has one and they increase; else nothing.
std::vector<double> StampsOfNames(const std::vector<std::filesystem::path>& files);

}  // namespace covsplat
