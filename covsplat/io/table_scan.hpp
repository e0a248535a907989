// From the columns of a point file to a scan.
#pragma once

#include <string>

#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

struct TableScan {
  Scan scan;                       ///< index is left at 0
  bool stamp_from_points = false;  ///< the points have absolute times; else stamp_s is left at 0
};

/// Takes x, y, z, an intensity and a time of each point where there are such columns, and leaves
/// others alone. All rows are kept, also those that are not finite. `file` is for messages.
Result<TableScan> ScanFromTable(const PointTable& table, const std::string& file);

}  // namespace covsplat
