// Files that survive a crash: whole files that appear at once, and logs that grow line by line.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"

namespace covsplat {

/// A file that grows: every Append has reached the operating system when it returns, so a killed
/// process loses nothing that was appended.
class AppendFile {
 public:
  /// Creates the file, or empties it if it exists.
  static Result<AppendFile> Open(const std::filesystem::path& path);

  AppendFile(AppendFile&& other) noexcept;
  AppendFile& operator=(AppendFile&& other) noexcept;
  ~AppendFile();

  /// The error names the file and the reason (disk full, read-only, ...).
  Result<void> Append(std::string_view bytes);
  /// Waits until the storage has it all.
  Result<void> Sync();
  /// Reports what the destructor would have to keep to itself. Nothing can be appended afterwards.
  Result<void> Close();

 private:
  AppendFile(std::filesystem::path path, int descriptor)
      : path_(std::move(path)), descriptor_(descriptor) {}

  std::filesystem::path path_;
  int descriptor_;  // -1 once closed
};

/// Writes a file so that a reader, or a crash at any moment, sees the old or the new one but never
/// a part: the bytes go to `path` + ".tmp" and get their name when the storage has them.
Result<void> WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// The same with bytes that come part by part.
using WriteParts = std::function<Result<void>(AppendFile&)>;
Result<void> WriteFileAtomically(const std::filesystem::path& path, const WriteParts& parts);

}  // namespace covsplat
