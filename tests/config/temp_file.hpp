// A file that lives as long as the test that needs it.
#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

namespace covsplat {

class TempFile {
 public:
  explicit TempFile(std::string_view content)
      : path_((std::filesystem::temp_directory_path() /
               ("covsplat_config_test_" + std::to_string(getpid()) + ".yaml"))
                  .string()) {
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~TempFile() { std::remove(path_.c_str()); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  const std::string& Path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace covsplat
