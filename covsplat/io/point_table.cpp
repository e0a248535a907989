#include "covsplat/io/point_table.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace covsplat {
namespace {

static_assert(std::endian::native == std::endian::little, "files are read as little-endian");

template <class T>
T Load(const char* bytes, bool big_endian) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

template <class T>
bool Fits(double number) {
  if constexpr (std::is_floating_point_v<T>) {
    return true;
  } else {
    const double limit = std::ldexp(1.0, std::numeric_limits<T>::digits);
    const double low = std::is_signed_v<T> ? -limit : 0.0;
    return number >= low && number < limit && std::trunc(number) == number;
  }
}

template <class Values>
using ValueOf = typename std::decay_t<Values>::value_type;

}  // namespace

std::size_t PointColumn::Size() const {
  return std::visit([](const auto& vector) { return vector.size(); }, values);
}

std::vector<double> PointColumn::Doubles() const {
  std::vector<double> doubles;
  doubles.reserve(Size());
  std::visit(
      [&](const auto& vector) {
        for (const auto value : vector) doubles.push_back(static_cast<double>(value));
      },
      values);
  return doubles;
}

const PointColumn* PointTable::Find(std::string_view name) const {
  const auto found = std::find_if(columns.begin(), columns.end(), [&](const PointColumn& column) {
    return column.name == name;
  });
  return found == columns.end() ? nullptr : &*found;
}

std::size_t SizeOf(ScalarType type) {
  const auto size = [](const auto& vector) { return sizeof(ValueOf<decltype(vector)>); };
  return std::visit(size, EmptyValues(type));
}

ColumnValues EmptyValues(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
      return std::vector<std::int8_t>();
    case ScalarType::kUint8:
      return std::vector<std::uint8_t>();
    case ScalarType::kInt16:
      return std::vector<std::int16_t>();
    case ScalarType::kUint16:
      return std::vector<std::uint16_t>();
    case ScalarType::kInt32:
      return std::vector<std::int32_t>();
    case ScalarType::kUint32:
      return std::vector<std::uint32_t>();
    case ScalarType::kInt64:
      return std::vector<std::int64_t>();
    case ScalarType::kUint64:
      return std::vector<std::uint64_t>();
    case ScalarType::kFloat32:
      return std::vector<float>();
    case ScalarType::kFloat64:
      break;
  }
  return std::vector<double>();
}

bool AppendNumber(ColumnValues& values, double number) {
  return std::visit(
      [&](auto& vector) {
        using T = ValueOf<decltype(vector)>;
        if (!Fits<T>(number)) return false;
        vector.push_back(static_cast<T>(number));
        return true;
      },
      values);
}

void AppendBytes(ColumnValues& values,
                 const char* first,
                 std::size_t stride,
                 std::size_t count,
                 bool big_endian) {
  std::visit(
      [&](auto& vector) {
        using T = ValueOf<decltype(vector)>;
        vector.reserve(vector.size() + count);
        for (std::size_t i = 0; i < count; ++i) {
          vector.push_back(Load<T>(first + i * stride, big_endian));
        }
      },
      values);
}

void CopyBytes(const ColumnValues& values, char* first, std::size_t stride) {
  std::visit(
      [&](const auto& vector) {
        for (std::size_t i = 0; i < vector.size(); ++i) {
          std::memcpy(first + i * stride, &vector[i], sizeof(vector[i]));
        }
      },
      values);
}

double DecodeNumber(ScalarType type, const char* bytes, bool big_endian) {
  ColumnValues values = EmptyValues(type);
  return std::visit(
      [&](const auto& vector) {
        return static_cast<double>(Load<ValueOf<decltype(vector)>>(bytes, big_endian));
      },
      values);
}

}  // namespace covsplat
