// Image<T>: a row-major grid, row 0 on top.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "covsplat/core/check.hpp"

namespace covsplat {

template <class T>
class Image {
 public:
  Image() = default;
  Image(int rows, int columns, const T& value = T())
      : rows_(rows),
        columns_(columns),
        pixels_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns), value) {}

  int Rows() const { return rows_; }
  int Columns() const { return columns_; }
  bool Empty() const { return pixels_.empty(); }
  std::size_t Size() const { return pixels_.size(); }

  T& operator()(int row, int column) { return pixels_[Index(row, column)]; }
  const T& operator()(int row, int column) const { return pixels_[Index(row, column)]; }
  std::span<T> Pixels() { return pixels_; }
  std::span<const T> Pixels() const { return pixels_; }

 private:
  std::size_t Index(int row, int column) const {
    COVSPLAT_DCHECK(row >= 0 && row < rows_ && column >= 0 && column < columns_);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int rows_ = 0;
  int columns_ = 0;
  std::vector<T> pixels_;
};

}  // namespace covsplat
