// The real recordings that tests may use, if they are there.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "covsplat/core/scan.hpp"

namespace covsplat::test {

/// Folder of the recordings: the environment variable COVSPLAT_DATA or a sibling of the sources.
inline std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("COVSPLAT_DATA")) return folder;
  return std::filesystem::path(__FILE__).parent_path() / "../../../shared/data";
}

/// float32 x y z intensity; empty if the file is not there.
inline Scan ReadVelodyneBin(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  Scan scan;
  float values[4];
  while (file.read(reinterpret_cast<char*>(values), sizeof values)) {
    scan.points.emplace_back(values[0], values[1], values[2]);
  }
  return scan;
}

/// Binary little-endian PLY whose vertices begin with float x y z and are all floats.
inline Scan ReadFloatPly(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  std::size_t count = 0;
  std::size_t properties = 0;
  while (std::getline(file, line) && line.find("end_header") != 0) {
    if (line.find("element vertex ") == 0) count = std::stoul(line.substr(15));
    if (line.find("property float") == 0) ++properties;
  }
  Scan scan;
  std::vector<float> vertex(properties);
  for (std::size_t i = 0; i < count; ++i) {
    const auto bytes = static_cast<std::streamsize>(properties * sizeof(float));
    if (!file.read(reinterpret_cast<char*>(vertex.data()), bytes)) return {};
    scan.points.emplace_back(vertex[0], vertex[1], vertex[2]);
  }
  return scan;
}

}  // namespace covsplat::test
