// The body of a PLY file, element by element.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/result.hpp"
#include "covsplat/io/ply_header.hpp"
#include "covsplat/io/point_table.hpp"
#include "covsplat/io/text.hpp"

namespace covsplat {

/// Reads the elements in the order of the header, each with one of the Read functions. Header and
/// bytes must outlive it.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, const PlyHeader& header, std::string file);

  /// The scalar properties of all rows; lists are passed over.
  Result<std::vector<PointColumn>> ReadColumns(const PlyElement& element);

  /// The property vertex_indices (or vertex_index) of all rows, cut into triangles. Every index is
  /// below `vertex_count`.
  Result<std::vector<Eigen::Vector3i>> ReadTriangles(const PlyElement& element,
                                                     std::size_t vertex_count);

 private:
  Result<std::vector<PointColumn>> ReadColumnsAtOnce(const PlyElement& element);
  Result<void> ReadRow(const PlyElement& element,
                       std::vector<PointColumn>& columns,
                       std::vector<double>& list);
  Result<void> ReadList(const PlyProperty& property, std::vector<double>& items);
  bool BeginRow();
  bool RowIsOver() const { return !ascii_ || next_word_ == words_.size(); }
  std::optional<double> Next(ScalarType type);
  tl::unexpected<Error> Broken(const PlyElement& element, std::string_view problem) const;

  std::string_view bytes_;
  std::string file_;
  bool ascii_;
  bool big_endian_;
  std::size_t offset_;  // binary: of the next value
  LineReader lines_;    // ascii: at the current row
  std::vector<std::string_view> words_;
  std::size_t next_word_ = 0;
};

}  // namespace covsplat
