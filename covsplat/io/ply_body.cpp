#include "covsplat/io/ply_body.hpp"

#include <utility>

namespace covsplat {
namespace {

std::vector<PointColumn> EmptyColumns(const PlyElement& element) {
  std::vector<PointColumn> columns;
  for (const PlyProperty& property : element.properties) {
    if (!property.is_list) columns.push_back({property.name, EmptyValues(property.type)});
  }
  return columns;
}

bool IsIndexList(const PlyProperty& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

}  // namespace

PlyBody::PlyBody(std::string_view bytes, const PlyHeader& header, std::string file)
    : bytes_(bytes),
      file_(std::move(file)),
      ascii_(header.format == PlyFormat::kAscii),
      big_endian_(header.format == PlyFormat::kBigEndian),
      offset_(header.offset),
      lines_(bytes, header.offset, header.lines) {}

tl::unexpected<Error> PlyBody::Broken(const PlyElement& element, std::string_view problem) const {
  if (ascii_) {
    return Fail(ErrorCode::kInput, "{}:{}: {}: {}", file_, lines_.Number(), element.name, problem);
  }
  return Fail(ErrorCode::kInput, "{}: at byte {}: {}: {}", file_, offset_, element.name, problem);
}

bool PlyBody::BeginRow() {
  if (!ascii_) return true;
  next_word_ = 0;
  do {
    if (!lines_.Next()) return false;
    words_ = SplitWords(lines_.Line());
  } while (words_.empty());
  return true;
}

std::optional<double> PlyBody::Next(ScalarType type) {
  if (ascii_) return RowIsOver() ? std::nullopt : ParseDouble(words_[next_word_++]);
  const std::size_t size = SizeOf(type);
  if (bytes_.size() - offset_ < size) return std::nullopt;
  const double number = DecodeNumber(type, bytes_.data() + offset_, big_endian_);
  offset_ += size;
  return number;
}

Result<void> PlyBody::ReadList(const PlyProperty& property, std::vector<double>& items) {
  items.clear();
  const std::optional<double> length = Next(property.length_type);
  if (!length || !(*length >= 0.0)) return Fail(ErrorCode::kInput, "a list has no length");
  for (double i = 0.0; i < *length; i += 1.0) {
    const std::optional<double> item = Next(property.type);
    if (!item) return Fail(ErrorCode::kInput, "a list of {} items ends after {}", *length, i);
    items.push_back(*item);
  }
  return {};
}

Result<void> PlyBody::ReadRow(const PlyElement& element,
                              std::vector<PointColumn>& columns,
                              std::vector<double>& list) {
  if (!BeginRow()) return Broken(element, "the file ends before the rows it announces");
  std::size_t column = 0;
  std::vector<double> other_list;
  for (const PlyProperty& property : element.properties) {
    if (property.is_list) {
      const Result<void> read = ReadList(property, IsIndexList(property) ? list : other_list);
      if (!read) return Broken(element, read.error().message);
      continue;
    }
    const std::optional<double> number = Next(property.type);
    if (!number || !AppendNumber(columns[column++].values, *number)) {
      return Broken(element, "no valid value for " + property.name);
    }
  }
  if (!RowIsOver()) return Broken(element, "more numbers than properties");
  return {};
}

Result<std::vector<PointColumn>> PlyBody::ReadColumnsAtOnce(const PlyElement& element) {
  std::vector<PointColumn> columns = EmptyColumns(element);
  const std::size_t stride = element.Stride();
  const std::size_t left = bytes_.size() - offset_;
  if (stride > 0 && left / stride < element.count) {
    return Broken(element,
                  fmt::format("{} rows of {} bytes are announced but {} bytes are left, so the "
                              "file is truncated",
                              element.count,
                              stride,
                              left));
  }
  const char* first = bytes_.data() + offset_;
  for (PointColumn& column : columns) {
    AppendBytes(column.values, first, stride, element.count, big_endian_);
    first += SizeOf(column.Type());
  }
  offset_ += stride * element.count;
  return columns;
}

Result<std::vector<PointColumn>> PlyBody::ReadColumns(const PlyElement& element) {
  if (element.properties.empty()) return std::vector<PointColumn>();
  if (!ascii_ && !element.HasLists()) return ReadColumnsAtOnce(element);
  std::vector<PointColumn> columns = EmptyColumns(element);
  std::vector<double> ignored;
  for (std::size_t row = 0; row < element.count; ++row) {
    const Result<void> read = ReadRow(element, columns, ignored);
    if (!read) return Forward(read);
  }
  return columns;
}

Result<std::vector<Eigen::Vector3i>> PlyBody::ReadTriangles(const PlyElement& element,
                                                            std::size_t vertex_count) {
  std::vector<Eigen::Vector3i> triangles;
  if (element.properties.empty()) return triangles;
  std::vector<PointColumn> ignored = EmptyColumns(element);
  std::vector<double> corners;
  for (std::size_t row = 0; row < element.count; ++row) {
    const Result<void> read = ReadRow(element, ignored, corners);
    if (!read) return Forward(read);
    std::vector<int> indices;
    for (const double corner : corners) {
      if (!(corner >= 0.0 && corner < static_cast<double>(vertex_count))) {
        return Broken(element, fmt::format("there is no vertex {}", corner));
      }
      indices.push_back(static_cast<int>(corner));
    }
    for (std::size_t k = 2; k < indices.size(); ++k) {
      triangles.emplace_back(indices[0], indices[k - 1], indices[k]);
    }
  }
  return triangles;
}

}  // namespace covsplat
