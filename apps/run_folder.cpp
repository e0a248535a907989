#include "apps/run_folder.hpp"

#include <cerrno>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace covsplat {
namespace {

namespace fs = std::filesystem;

Result<void> MakeFolders(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error)) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  if (!error) return {};
  return Fail(ErrorCode::kOutput,
              "{}: cannot make the output folder: {}; choose another one with -o",
              folder.string(),
              error.message());
}

Result<void> CheckWritable(const fs::path& folder) {
  if (access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return Fail(ErrorCode::kOutput,
              "{}: cannot write to the output folder: {}; choose another one with -o",
              folder.string(),
              std::generic_category().message(errno));
}

Result<fs::path> MakeChosenFolder(const fs::path& folder, bool overwrite) {
  std::error_code error;
  const bool is_new = !fs::exists(folder, error);
  if (const Result<void> made = MakeFolders(folder); !made) return Forward(made);
  const bool empty = is_new || fs::is_empty(folder, error);
  if (error) {
    return Fail(ErrorCode::kOutput, "{}: cannot look inside: {}", folder.string(), error.message());
  }
  if (!empty && !overwrite) {
    return Fail(ErrorCode::kOutput,
                "{}: the output folder is not empty; choose another one with -o, or replace the "
                "files of an earlier run with --overwrite",
                folder.string());
  }
  return folder;
}

/// base/2024-05-31_17-02-11, with _2, _3, ... if another run of that second has it.
Result<fs::path> MakeDatedFolder(const fs::path& base, std::time_t now) {
  if (const Result<void> made = MakeFolders(base); !made) return Forward(made);
  std::tm local{};
  localtime_r(&now, &local);
  char date[32] = "";
  std::strftime(date, sizeof(date), "%Y-%m-%d_%H-%M-%S", &local);
  constexpr int kMaxTries = 1000;
  std::error_code error;
  for (int i = 1; i <= kMaxTries; ++i) {
    const fs::path folder = base / (i == 1 ? std::string(date) : fmt::format("{}_{}", date, i));
    if (fs::create_directory(folder, error)) return folder;
    if (error) break;  // not an error: a folder of that name is there
  }
  return Fail(ErrorCode::kOutput,
              "{}: cannot make a folder in it: {}; choose another one with -o",
              base.string(),
              error.message());
}

/// Renaming replaces the link in one step. A `latest` that is no link is the user's: it stays.
void PointLatestTo(const fs::path& folder) {
  const fs::path link = folder.parent_path() / "latest";
  const fs::path fresh = folder.parent_path() / fmt::format(".latest.{}", getpid());
  std::error_code error;
  if (fs::symlink_status(link, error).type() != fs::file_type::symlink && fs::exists(link, error)) {
    return;
  }
  fs::create_directory_symlink(folder.filename(), fresh, error);
  if (error) return;
  fs::rename(fresh, link, error);
  if (error) fs::remove(fresh, error);
}

}  // namespace

Result<fs::path> MakeRunFolder(const RunFolderRequest& request, std::time_t now) {
  Result<fs::path> folder = request.out ? MakeChosenFolder(*request.out, request.overwrite)
                                        : MakeDatedFolder(request.base, now);
  if (!folder) return folder;
  if (const Result<void> writable = CheckWritable(*folder); !writable) return Forward(writable);
  if (!request.out) PointLatestTo(*folder);
  return folder;
}

}  // namespace covsplat
