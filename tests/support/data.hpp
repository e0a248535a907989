// Real recordings for tests, which are not part of the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace covsplat {

/// A file or folder of the test data: in $COVSPLAT_DATA, or in ../shared/data next to the source
/// folder. Nothing if it is not there; such a test calls GTEST_SKIP() << kNoTestData.
inline std::optional<std::filesystem::path> TestData(const std::string& name) {
  const char* variable = std::getenv("COVSPLAT_DATA");  // NOLINT(concurrency-mt-unsafe)
  const std::filesystem::path root =
      variable != nullptr ? std::filesystem::path(variable)
                          : std::filesystem::path(COVSPLAT_SOURCE_DIR) / "../shared/data";
  std::error_code ignored;
  const std::filesystem::path path = root / name;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  return path;
}

inline constexpr const char* kNoTestData =
    "real recordings are missing: set COVSPLAT_DATA to the folder that holds them";

}  // namespace covsplat
