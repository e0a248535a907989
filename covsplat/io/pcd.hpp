// PCD v0.7, the point files of the Point Cloud Library.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

/// All points of a PCD file: ascii, binary or binary_compressed, organised or not. A field of COUNT
/// n > 1 becomes the columns `name[0]` to `name[n-1]`; padding fields (named "_") are left out. The
/// VIEWPOINT is not applied: points stay in the sensor frame.
Result<PointTable> ReadPcd(const std::filesystem::path& path);

/// The same from bytes in memory; `file` is for messages.
Result<PointTable> ParsePcd(std::string_view bytes, const std::string& file);

/// Writes all columns as a binary PCD, at once. Comments go into the header.
Result<void> WritePcd(const std::filesystem::path& path, const PointTable& points);

}  // namespace covsplat
