#include "covsplat/io/pcd.hpp"

#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include <liblzf/lzf.h>

#include "covsplat/io/output_file.hpp"
#include "covsplat/io/pcd_header.hpp"
#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

// LZF cannot shrink anything further than to 3 bytes for 264.
constexpr std::size_t kBestCompression = 88;

// Columns without values, and which of a point's numbers each comes from.
struct Layout {
  struct Part {
    std::size_t number = 0;      // among the numbers of a point
    std::size_t byte = 0;        // within a point
    std::size_t field_byte = 0;  // where the part's field starts within a point
    std::size_t field_size = 0;  // bytes of the whole field
  };
  PointTable table;
  std::vector<Part> parts;  // of each column
};

Layout MakeLayout(const PcdHeader& header) {
  Layout layout;
  std::size_t number = 0;
  std::size_t byte = 0;
  for (const PcdField& field : header.fields) {
    const std::size_t size = SizeOf(field.type);
    for (std::size_t k = 0; k < field.count && !field.IsPadding(); ++k) {
      const std::string name = field.count == 1 ? field.name : fmt::format("{}[{}]", field.name, k);
      layout.table.columns.push_back({name, EmptyValues(field.type)});
      layout.parts.push_back({number + k, byte + k * size, byte, field.count * size});
    }
    number += field.count;
    byte += field.count * size;
  }
  return layout;
}

Result<PointTable> ParseAscii(std::string_view bytes,
                              const PcdHeader& header,
                              const std::string& file) {
  Layout layout = MakeLayout(header);
  LineReader reader(bytes, header.offset, header.lines);
  std::size_t rows = 0;
  while (rows < header.points && reader.NextWithContent()) {
    const auto numbers = ParseDoubles(reader.Line());
    if (!numbers || numbers->size() != header.numbers) {
      return Fail(
          ErrorCode::kInput, "{}:{}: expected {} numbers", file, reader.Number(), header.numbers);
    }
    for (std::size_t c = 0; c < layout.parts.size(); ++c) {
      PointColumn& column = layout.table.columns[c];
      if (!AppendNumber(column.values, (*numbers)[layout.parts[c].number])) {
        return Fail(ErrorCode::kInput,
                    "{}:{}: {} does not fit the type of field {}",
                    file,
                    reader.Number(),
                    (*numbers)[layout.parts[c].number],
                    column.name);
      }
    }
    ++rows;
  }
  if (rows < header.points) {
    return Fail(ErrorCode::kInput,
                "{}: ends after {} of {} points, so it is truncated; write it again",
                file,
                rows,
                header.points);
  }
  return std::move(layout.table);
}

tl::unexpected<Error> Truncated(const std::string& file, std::size_t has, std::size_t needs) {
  return Fail(ErrorCode::kInput,
              "{}: has {} bytes of points where its header announces {}, so it is truncated; write "
              "it again",
              file,
              has,
              needs);
}

Result<PointTable> ParseBinary(std::string_view body,
                               const PcdHeader& header,
                               const std::string& file) {
  const std::size_t needed = header.points * header.stride;
  if (body.size() < needed) return Truncated(file, body.size(), needed);
  Layout layout = MakeLayout(header);
  for (std::size_t c = 0; c < layout.parts.size(); ++c) {
    const char* first = body.data() + layout.parts[c].byte;
    AppendBytes(layout.table.columns[c].values, first, header.stride, header.points, false);
  }
  return std::move(layout.table);
}

// The uncompressed body: sizes, then an LZF block.
Result<std::string> Decompress(std::string_view body,
                               const PcdHeader& header,
                               const std::string& file) {
  std::array<std::uint32_t, 2> sizes{};  // compressed, uncompressed
  if (body.size() < sizeof(sizes)) return Truncated(file, body.size(), sizeof(sizes));
  std::memcpy(sizes.data(), body.data(), sizeof(sizes));
  body.remove_prefix(sizeof(sizes));
  if (body.size() < sizes[0]) return Truncated(file, body.size(), sizes[0]);
  const std::size_t needed = header.points * header.stride;
  if (sizes[1] != needed || needed > kBestCompression * sizes[0]) {
    return Fail(ErrorCode::kInput,
                "{}: {} compressed bytes are said to hold {}, but {} points need {}; the file is "
                "damaged",
                file,
                sizes[0],
                sizes[1],
                header.points,
                needed);
  }
  std::string bytes(needed, '\0');
  if (needed > 0 && lzf_decompress(body.data(), sizes[0], bytes.data(), sizes[1]) != sizes[1]) {
    return Fail(ErrorCode::kInput, "{}: its compressed points are damaged", file);
  }
  return bytes;
}

Result<PointTable> ParseCompressed(std::string_view body,
                                   const PcdHeader& header,
                                   const std::string& file) {
  const Result<std::string> bytes = Decompress(body, header, file);
  if (!bytes) return Forward(bytes);
  Layout layout = MakeLayout(header);
  for (std::size_t c = 0; c < layout.parts.size(); ++c) {
    const Layout::Part& part = layout.parts[c];
    const std::size_t offset = part.field_byte * header.points + (part.byte - part.field_byte);
    const char* first = bytes->data() + offset;
    AppendBytes(layout.table.columns[c].values, first, part.field_size, header.points, false);
  }
  return std::move(layout.table);
}

char TypeLetter(ScalarType type) {
  switch (type) {
    case ScalarType::kFloat32:
    case ScalarType::kFloat64:
      return 'F';
    case ScalarType::kInt8:
    case ScalarType::kInt16:
    case ScalarType::kInt32:
    case ScalarType::kInt64:
      return 'I';
    default:
      return 'U';
  }
}

std::string WrittenHeader(const PointTable& points) {
  std::string fields = "FIELDS", sizes = "SIZE", types = "TYPE", counts = "COUNT";
  for (const PointColumn& column : points.columns) {
    fields += " " + column.name;
    sizes += fmt::format(" {}", SizeOf(column.Type()));
    types += fmt::format(" {}", TypeLetter(column.Type()));
    counts += " 1";
  }
  std::string text = "# .PCD v0.7 - Point Cloud Data file format\n";
  for (const std::string& comment : points.comments) text += "# " + comment + "\n";
  return text + fmt::format(
                    "VERSION 0.7\n{}\n{}\n{}\n{}\nWIDTH {}\nHEIGHT 1\n"
                    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA binary\n",
                    fields,
                    sizes,
                    types,
                    counts,
                    points.Rows(),
                    points.Rows());
}

}  // namespace

Result<PointTable> ReadPcd(const std::filesystem::path& path) {
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  return ParsePcd(*bytes, path.string());
}

Result<PointTable> ParsePcd(std::string_view bytes, const std::string& file) {
  const Result<PcdHeader> header = ParsePcdHeader(bytes, file);
  if (!header) return Forward(header);
  if (header->data == "ascii") return ParseAscii(bytes, *header, file);
  const std::string_view body = bytes.substr(header->offset);
  if (header->data == "binary") return ParseBinary(body, *header, file);
  return ParseCompressed(body, *header, file);
}

Result<void> WritePcd(const std::filesystem::path& path, const PointTable& points) {
  std::string bytes = WrittenHeader(points);
  std::size_t stride = 0;
  for (const PointColumn& column : points.columns) stride += SizeOf(column.Type());
  std::size_t first = bytes.size();
  bytes.resize(first + stride * points.Rows());
  for (const PointColumn& column : points.columns) {
    CopyBytes(column.values, bytes.data() + first, stride);
    first += SizeOf(column.Type());
  }
  return WriteFileAtomically(path, bytes);
}

}  // namespace covsplat
