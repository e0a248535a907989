#include "covsplat/io/ply_header.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

using Words = std::vector<std::string_view>;

struct TypeName {
  std::string_view classic;
  std::string_view sized;
  ScalarType type;
};
constexpr std::array<TypeName, 8> kTypes = {{{"char", "int8", ScalarType::kInt8},
                                             {"uchar", "uint8", ScalarType::kUint8},
                                             {"short", "int16", ScalarType::kInt16},
                                             {"ushort", "uint16", ScalarType::kUint16},
                                             {"int", "int32", ScalarType::kInt32},
                                             {"uint", "uint32", ScalarType::kUint32},
                                             {"float", "float32", ScalarType::kFloat32},
                                             {"double", "float64", ScalarType::kFloat64}}};

std::optional<ScalarType> TypeOf(std::string_view word) {
  for (const TypeName& name : kTypes) {
    if (word == name.classic || word == name.sized) return name.type;
  }
  return std::nullopt;
}

std::optional<PlyFormat> FormatOf(const Words& words) {
  if (words.size() != 3 || words[2] != "1.0") return std::nullopt;
  if (words[1] == "ascii") return PlyFormat::kAscii;
  if (words[1] == "binary_little_endian") return PlyFormat::kLittleEndian;
  if (words[1] == "binary_big_endian") return PlyFormat::kBigEndian;
  return std::nullopt;
}

std::optional<PlyElement> ElementOf(const Words& words) {
  if (words.size() != 3) return std::nullopt;
  const std::optional<std::int64_t> count = ParseInteger(words[2]);
  if (!count || *count < 0) return std::nullopt;
  return PlyElement{std::string(words[1]), static_cast<std::size_t>(*count), {}};
}

std::optional<PlyProperty> PropertyOf(const Words& words) {
  const bool is_list = words.size() == 5 && words[1] == "list";
  if (!is_list && words.size() != 3) return std::nullopt;
  const std::optional<ScalarType> type = TypeOf(words[words.size() - 2]);
  const std::optional<ScalarType> length_type = is_list ? TypeOf(words[2]) : ScalarType::kUint8;
  if (!type || !length_type) return std::nullopt;
  return PlyProperty{std::string(words.back()), *type, is_list, *length_type};
}

// Takes in one line of the header that is neither first nor last; false if it is not a valid one.
bool ParseLine(std::string_view line, PlyHeader& header, bool& has_format) {
  const Words words = SplitWords(line);
  if (words.empty() || words[0] == "obj_info") return true;
  if (words[0] == "comment") {
    header.comments.emplace_back(line.substr(std::min(line.find("comment") + 8, line.size())));
    return true;
  }
  if (words[0] == "format") {
    const std::optional<PlyFormat> format = FormatOf(words);
    header.format = format.value_or(PlyFormat::kAscii);
    has_format = format.has_value();
    return has_format;
  }
  if (words[0] == "element") {
    std::optional<PlyElement> element = ElementOf(words);
    if (element) header.elements.push_back(std::move(*element));
    return element.has_value();
  }
  if (words[0] != "property" || header.elements.empty()) return false;
  std::optional<PlyProperty> property = PropertyOf(words);
  if (property) header.elements.back().properties.push_back(std::move(*property));
  return property.has_value();
}

}  // namespace

bool PlyElement::HasLists() const {
  return std::any_of(
      properties.begin(), properties.end(), [](const PlyProperty& p) { return p.is_list; });
}

std::size_t PlyElement::Stride() const {
  std::size_t bytes = 0;
  for (const PlyProperty& property : properties) bytes += SizeOf(property.type);
  return bytes;
}

Result<PlyHeader> ParsePlyHeader(std::string_view bytes, const std::string& file) {
  LineReader reader(bytes);
  if (!reader.Next() || reader.Line() != "ply") {
    return Fail(ErrorCode::kInput, "{}: is not a PLY file: its first line is not \"ply\"", file);
  }
  PlyHeader header;
  bool has_format = false;
  while (reader.Next()) {
    if (reader.Line() == "end_header") {
      if (!has_format) return Fail(ErrorCode::kInput, "{}: its header names no format", file);
      header.offset = reader.Offset();
      header.lines = reader.Number();
      return header;
    }
    if (!ParseLine(reader.Line(), header, has_format)) {
      return Fail(
          ErrorCode::kInput, "{}:{}: is not a valid line of a PLY header", file, reader.Number());
    }
  }
  return Fail(ErrorCode::kInput, "{}: has no end_header line, so it is truncated", file);
}

std::string_view PlyTypeName(ScalarType type) {
  for (const TypeName& name : kTypes) {
    if (name.type == type) return name.classic;
  }
  return {};
}

}  // namespace covsplat
