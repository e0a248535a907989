#include "covsplat/io/table_scan.hpp"

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "covsplat/io/time_field.hpp"

namespace covsplat {
namespace {

constexpr std::array<std::string_view, 4> kIntensityNames = {
    "intensity", "scalar_intensity", "i", "reflectivity"};

std::string ColumnNames(const PointTable& table) {
  std::string names;
  for (const PointColumn& column : table.columns) names += " " + column.name;
  return names.empty() ? " (none)" : names;
}

std::vector<float> Floats(const PointColumn& column) {
  const std::vector<double> doubles = column.Doubles();
  return {doubles.begin(), doubles.end()};
}

}  // namespace

Result<TableScan> ScanFromTable(const PointTable& table, const std::string& file) {
  const PointColumn* x = table.Find("x");
  const PointColumn* y = table.Find("y");
  const PointColumn* z = table.Find("z");
  if (x == nullptr || y == nullptr || z == nullptr) {
    return Fail(
        ErrorCode::kInput, "{}: needs the columns x, y and z but has{}", file, ColumnNames(table));
  }
  TableScan result;
  Scan& scan = result.scan;
  const std::vector<float> xs = Floats(*x);
  const std::vector<float> ys = Floats(*y);
  const std::vector<float> zs = Floats(*z);
  scan.points.reserve(xs.size());
  for (std::size_t i = 0; i < xs.size(); ++i) scan.points.emplace_back(xs[i], ys[i], zs[i]);
  for (const std::string_view name : kIntensityNames) {
    const PointColumn* intensity = table.Find(name);
    if (intensity != nullptr && scan.intensity.empty()) scan.intensity = Floats(*intensity);
  }
  if (const PointColumn* time = FindTimeColumn(table)) {
    const std::string where = file + ": column " + time->name;
    Result<PointTimes> times = DecodePointTimes(time->Doubles(), scan.points, where);
    if (!times) return Forward(times);
    scan.time_offset_s = std::move(times->offset_s);
    result.stamp_from_points = times->stamp_s.has_value();
    scan.stamp_s = times->stamp_s.value_or(0.0);
  }
  scan.source = file;
  return result;
}

}  // namespace covsplat
