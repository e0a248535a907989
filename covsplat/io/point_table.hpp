// PointTable: named columns of numbers, which is what PLY and PCD files are made of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace covsplat {

/// Numeric type of a column, in the order of the alternatives of ColumnValues.
enum class ScalarType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
};

using ColumnValues = std::variant<std::vector<std::int8_t>,
                                  std::vector<std::uint8_t>,
                                  std::vector<std::int16_t>,
                                  std::vector<std::uint16_t>,
                                  std::vector<std::int32_t>,
                                  std::vector<std::uint32_t>,
                                  std::vector<std::int64_t>,
                                  std::vector<std::uint64_t>,
                                  std::vector<float>,
                                  std::vector<double>>;

struct PointColumn {
  std::string name;
  ColumnValues values;

  ScalarType Type() const { return static_cast<ScalarType>(values.index()); }
  std::size_t Size() const;
  /// All values as doubles; 64-bit integers beyond 2^53 are rounded.
  std::vector<double> Doubles() const;
};

/// Columns of equal length.
struct PointTable {
  std::vector<PointColumn> columns;
  std::vector<std::string> comments;

  std::size_t Rows() const { return columns.empty() ? 0 : columns.front().Size(); }
  /// The first column of that name, or null.
  const PointColumn* Find(std::string_view name) const;
};

/// Bytes of one value.
std::size_t SizeOf(ScalarType type);

/// No values yet.
ColumnValues EmptyValues(ScalarType type);

/// Appends a number; false, and nothing appended, if the column's type cannot hold it.
bool AppendNumber(ColumnValues& values, double number);

/// Appends `count` values whose bytes start at `first` and lie `stride` bytes apart.
void AppendBytes(ColumnValues& values,
                 const char* first,
                 std::size_t stride,
                 std::size_t count,
                 bool big_endian);

/// The inverse of AppendBytes, little-endian.
void CopyBytes(const ColumnValues& values, char* first, std::size_t stride);

/// One value from its bytes.
double DecodeNumber(ScalarType type, const char* bytes, bool big_endian);

}  // namespace covsplat
