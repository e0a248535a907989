#include "covsplat/io/output_file.hpp"

#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace covsplat {
namespace {

tl::unexpected<Error> CannotWrite(const std::filesystem::path& path, int error) {
  return Fail(ErrorCode::kOutput,
              "{}: cannot be written: {}",
              path.string(),
              std::error_code(error, std::generic_category()).message());
}

// Makes a rename in the folder permanent. Some file systems cannot sync folders; that is no error.
void SyncFolder(const std::filesystem::path& folder) {
  const int descriptor = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

Result<void> WriteDurably(const std::filesystem::path& path, const WriteParts& parts) {
  Result<AppendFile> file = AppendFile::Open(path);
  if (!file) return Forward(file);
  return parts(*file).and_then([&] { return file->Sync(); }).and_then([&] {
    return file->Close();
  });
}

}  // namespace

Result<AppendFile> AppendFile::Open(const std::filesystem::path& path) {
  const int flags = O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC;
  const int descriptor = open(path.c_str(), flags, 0666);
  if (descriptor < 0) return CannotWrite(path, errno);
  return AppendFile(path, descriptor);
}

AppendFile::AppendFile(AppendFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

AppendFile& AppendFile::operator=(AppendFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<void> AppendFile::Append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return CannotWrite(path_, errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> AppendFile::Sync() {
  if (fsync(descriptor_) == 0 || errno == EINVAL) return {};  // EINVAL: a pipe or a device
  return CannotWrite(path_, errno);
}

Result<void> AppendFile::Close() {
  const int descriptor = std::exchange(descriptor_, -1);
  if (descriptor >= 0 && close(descriptor) != 0) return CannotWrite(path_, errno);
  return {};
}

Result<void> WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  return WriteFileAtomically(path, [&](AppendFile& file) { return file.Append(bytes); });
}

Result<void> WriteFileAtomically(const std::filesystem::path& path, const WriteParts& parts) {
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  Result<void> written = WriteDurably(temporary, parts);
  if (written && std::rename(temporary.c_str(), path.c_str()) != 0) {
    written = CannotWrite(path, errno);
  }
  if (!written) {
    unlink(temporary.c_str());
    return written;
  }
  SyncFolder(path.parent_path());
  return {};
}

}  // namespace covsplat
