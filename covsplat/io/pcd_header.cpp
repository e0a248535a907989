#include "covsplat/io/pcd_header.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::array<std::string_view, 10> kKeys = {
    "VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};
// A scan has far fewer; more than this is a damaged header.
constexpr std::int64_t kMostPoints = std::int64_t{1} << 31;
constexpr std::int64_t kMostCount = 1 << 16;
constexpr std::size_t kLargestPoint = 1 << 20;  // bytes
// The header as key and words, and where it ends.
struct RawHeader {
  std::map<std::string_view, Words> entries;
  std::size_t offset = 0;
  std::int64_t lines = 0;

  Words Of(std::string_view key) const {
    const auto found = entries.find(key);
    return found == entries.end() ? Words() : found->second;
  }
  // The only word of an entry as a whole number.
  std::optional<std::int64_t> Count(std::string_view key) const {
    const Words words = Of(key);
    return words.size() == 1 ? ParseInteger(words[0]) : std::nullopt;
  }
};

tl::unexpected<Error> BadHeader(const std::string& file, std::string_view problem) {
  return Fail(ErrorCode::kInput, "{}: not a valid PCD header: {}", file, problem);
}

Result<RawHeader> SplitHeader(std::string_view bytes, const std::string& file) {
  RawHeader header;
  LineReader reader(bytes);
  while (reader.NextWithContent()) {
    Words words = SplitWords(reader.Line());
    const std::string_view key = words.front();
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
      return BadHeader(file, fmt::format("line {} starts with no known keyword", reader.Number()));
    }
    words.erase(words.begin());
    header.entries[key] = std::move(words);
    header.offset = reader.Offset();
    header.lines = reader.Number();
    if (key == "DATA") return header;
  }
  return BadHeader(file, "it has no DATA line, so the file is empty or truncated");
}

std::optional<ScalarType> TypeOf(std::string_view letter, std::string_view size) {
  static const std::map<std::string_view, ScalarType> kTypes = {{"I1", ScalarType::kInt8},
                                                                {"U1", ScalarType::kUint8},
                                                                {"I2", ScalarType::kInt16},
                                                                {"U2", ScalarType::kUint16},
                                                                {"I4", ScalarType::kInt32},
                                                                {"U4", ScalarType::kUint32},
                                                                {"I8", ScalarType::kInt64},
                                                                {"U8", ScalarType::kUint64},
                                                                {"F4", ScalarType::kFloat32},
                                                                {"F8", ScalarType::kFloat64}};
  const auto found = kTypes.find(std::string(letter) + std::string(size));
  if (found == kTypes.end()) return std::nullopt;
  return found->second;
}

Result<std::vector<PcdField>> ParseFields(const RawHeader& raw, const std::string& file) {
  const Words names = raw.Of("FIELDS");
  const Words sizes = raw.Of("SIZE");
  const Words types = raw.Of("TYPE");
  const Words counts = raw.Of("COUNT");
  if (names.empty()) return BadHeader(file, "FIELDS is missing or empty");
  if (sizes.size() != names.size() || types.size() != names.size() ||
      (!counts.empty() && counts.size() != names.size())) {
    return BadHeader(file, "FIELDS, SIZE, TYPE and COUNT differ in length");
  }
  std::vector<PcdField> fields;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::optional<ScalarType> type = TypeOf(types[i], sizes[i]);
    const auto count = counts.empty() ? std::optional<std::int64_t>(1) : ParseInteger(counts[i]);
    if (!type || !count || *count < 1 || *count > kMostCount) {
      return BadHeader(file, fmt::format("field {} has no known TYPE, SIZE and COUNT", names[i]));
    }
    fields.push_back({std::string(names[i]), *type, static_cast<std::size_t>(*count)});
  }
  return fields;
}

Result<std::size_t> ParsePointCount(const RawHeader& raw, const std::string& file) {
  const std::optional<std::int64_t> width = raw.Count("WIDTH");
  const std::optional<std::int64_t> height =
      raw.Of("HEIGHT").empty() ? std::optional<std::int64_t>(1) : raw.Count("HEIGHT");
  const std::optional<std::int64_t> points =
      raw.Of("POINTS").empty() && width && height && *width <= kMostPoints && *height <= kMostPoints
          ? std::optional<std::int64_t>(*width * *height)
          : raw.Count("POINTS");
  const auto valid = [](const std::optional<std::int64_t>& n) {
    return n && *n >= 0 && *n <= kMostPoints;
  };
  if (!valid(width) || !valid(height) || !valid(points)) {
    return BadHeader(file, "WIDTH, HEIGHT and POINTS have to be whole numbers from 0 on");
  }
  if (*width * *height != *points) {
    return BadHeader(
        file, fmt::format("WIDTH {} times HEIGHT {} is not POINTS {}", *width, *height, *points));
  }
  return static_cast<std::size_t>(*points);
}

}  // namespace

Result<PcdHeader> ParsePcdHeader(std::string_view bytes, const std::string& file) {
  const Result<RawHeader> raw = SplitHeader(bytes, file);
  if (!raw) return Forward(raw);
  Result<std::vector<PcdField>> fields = ParseFields(*raw, file);
  if (!fields) return Forward(fields);
  const Result<std::size_t> points = ParsePointCount(*raw, file);
  if (!points) return Forward(points);
  PcdHeader header;
  const Words data = raw->Of("DATA");
  if (data.size() == 1) header.data = data[0];
  if (header.data != "ascii" && header.data != "binary" && header.data != "binary_compressed") {
    return BadHeader(file, "DATA has to be ascii, binary or binary_compressed");
  }
  header.fields = std::move(*fields);
  header.points = *points;
  header.offset = raw->offset;
  header.lines = raw->lines;
  for (const PcdField& field : header.fields) {
    header.stride += field.count * SizeOf(field.type);
    header.numbers += field.count;
    if (header.stride > kLargestPoint) return BadHeader(file, "its points are too large");
  }
  return header;
}

}  // namespace covsplat
