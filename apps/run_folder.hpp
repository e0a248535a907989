// Where a run writes. Nothing is ever deleted.
#pragma once

#include <ctime>
#include <filesystem>
#include <optional>

#include "covsplat/core/result.hpp"

namespace covsplat {

struct RunFolderRequest {
  std::optional<std::filesystem::path> out;  ///< -o; without it a dated folder below `base`
  bool overwrite = false;  ///< allow a non-empty `out`; the run replaces its files
  std::filesystem::path base = "covsplat_out";
};

/// Makes the folder and checks that it can be written to. A dated folder is named after the local
/// time `now` and becomes what the link `latest` beside it points to.
Result<std::filesystem::path> MakeRunFolder(const RunFolderRequest& request, std::time_t now);

}  // namespace covsplat
