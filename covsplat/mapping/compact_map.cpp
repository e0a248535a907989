#include "covsplat/mapping/compact_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/io/binary.hpp"
#include "covsplat/io/compression.hpp"
#include "covsplat/mapping/compact_tile.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kSectionHeadBytes = 12;
constexpr std::size_t kTagBytes = 4;
constexpr std::string_view kConfigTag = "CONF";
constexpr std::string_view kSensorTag = "SENS";
constexpr std::string_view kKeyframesTag = "KEYF";
constexpr std::string_view kTileTag = "TILE";

struct Header {
  std::uint32_t version = 0;
  std::uint32_t sections = 0;
  std::uint64_t gaussians = 0;
};

struct Section {
  std::string_view tag;
  std::string_view payload;
};

// --- writing

std::string PackHeader(const Header& header) {
  std::string bytes(kCompactMapMagic);
  AppendBinary(bytes, header.version);
  AppendBinary(bytes, header.sections);
  AppendBinary(bytes, header.gaussians);
  AppendBinary(bytes, Crc32(bytes));
  return bytes;
}

std::string PackSection(std::string_view tag, std::string_view payload) {
  COVSPLAT_CHECK(payload.size() <= std::numeric_limits<std::uint32_t>::max());
  std::string bytes(tag);
  AppendBinary(bytes, static_cast<std::uint32_t>(payload.size()));
  AppendBinary(bytes, Crc32(payload, Crc32(bytes)));
  return bytes.append(payload);
}

std::string PackConfig(const std::string& yaml) {
  std::string bytes;
  AppendBinary(bytes, static_cast<std::uint32_t>(yaml.size()));
  return bytes + Deflate(yaml);
}

std::string PackSensor(const SensorModel& sensor) {
  std::string bytes;
  AppendBinary(bytes, static_cast<std::uint32_t>(sensor.Columns()));
  AppendBinary(bytes, sensor.MinRange());
  AppendBinary(bytes, sensor.MaxRange());
  for (const double elevation_rad : sensor.Elevations()) AppendBinary(bytes, elevation_rad);
  return bytes;
}

std::string PackKeyframes(const Trajectory& keyframes) {
  std::string bytes;
  for (const TimedPose& keyframe : keyframes) {
    const Eigen::Vector3d& t = keyframe.T_world_sensor.Translation();
    const Eigen::Quaterniond& q = keyframe.T_world_sensor.Rotation();
    for (const double number :
         {keyframe.stamp_s, t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()}) {
      AppendBinary(bytes, number);
    }
  }
  return bytes;
}

// --- reading

/// Everything a header can tell is wrong. Its layout is the same in all versions, so that a damaged
/// version is not taken for a new one.
Result<Header> ReadHeader(BinaryReader& reader, std::string_view bytes, const std::string& file) {
  if (!bytes.starts_with(kCompactMapMagic)) {
    return Fail(ErrorCode::kInput,
                "{}: is no .csmap file: it does not start as one, or was copied as text",
                file);
  }
  reader.Take(kCompactMapMagic.size());
  Header header;
  header.version = reader.Read<std::uint32_t>();
  header.sections = reader.Read<std::uint32_t>();
  header.gaussians = reader.Read<std::uint64_t>();
  const std::size_t checked = reader.Offset();
  const auto crc = reader.Read<std::uint32_t>();
  if (reader.Failed()) {
    return Fail(ErrorCode::kInput,
                "{}: is truncated within its header, at {} of {} bytes; copy or export it again",
                file,
                bytes.size(),
                kHeaderBytes);
  }
  if (crc != Crc32(bytes.substr(0, checked))) {
    return Fail(ErrorCode::kInput,
                "{}: is damaged in its header (bytes 0 to {}): the checksum differs; copy or "
                "export it again",
                file,
                kHeaderBytes - 1);
  }
  if (header.version == 0 || header.version > kCompactMapVersion) {
    return Fail(ErrorCode::kInput,
                "{}: has version {} of the format, and this covsplat reads up to {}; update "
                "covsplat, or export the map as .ply with the one that wrote it",
                file,
                header.version,
                kCompactMapVersion);
  }
  return header;
}

/// "section 3 of 9 (TILE, from byte 5120)"
std::string NameOf(std::size_t number, const Header& header, std::string_view tag, std::size_t at) {
  std::string printable;
  for (const char c : tag) printable += c >= ' ' && c <= '~' ? c : '?';
  return fmt::format("section {} of {} ({}, from byte {})", number, header.sections, printable, at);
}

Result<Section> ReadSection(BinaryReader& reader,
                            std::size_t number,
                            const Header& header,
                            const std::string& file) {
  const std::size_t at = reader.Offset();
  std::string checked;
  Section section;
  section.tag = reader.Take(kTagBytes);
  const auto size = reader.Read<std::uint32_t>();
  const auto crc = reader.Read<std::uint32_t>();
  const bool has_head = !reader.Failed();
  const std::size_t left = reader.Left();
  section.payload = reader.Take(size);
  const std::string name = NameOf(number, header, section.tag, at);
  if (reader.Failed()) {
    return Fail(ErrorCode::kInput,
                "{}: is truncated or damaged in {}: it has {} of {} bytes; copy or export it again",
                file,
                name,
                has_head ? left : 0,
                has_head ? size : kSectionHeadBytes);
  }
  std::string head(section.tag);
  AppendBinary(head, size);
  if (crc != Crc32(section.payload, Crc32(head))) {
    return Fail(ErrorCode::kInput,
                "{}: is damaged in {}: the checksum differs; copy or export it again",
                file,
                name);
  }
  return section;
}

std::optional<std::string> UnpackConfig(std::string_view payload) {
  BinaryReader reader(payload);
  const auto size = reader.Read<std::uint32_t>();
  return Inflate(reader.Take(reader.Left()), size);
}

std::optional<SensorModel> UnpackSensor(std::string_view payload) {
  constexpr std::uint32_t kMaxColumns = 1 << 20;
  BinaryReader reader(payload);
  const auto columns = reader.Read<std::uint32_t>();
  const auto min_range_m = reader.Read<double>();
  const auto max_range_m = reader.Read<double>();
  if (columns < 4 || columns % 4 != 0 || columns > kMaxColumns) return std::nullopt;
  if (!(min_range_m >= 0.0 && min_range_m < max_range_m && std::isfinite(max_range_m))) {
    return std::nullopt;
  }
  std::vector<double> elevation_rad;
  double above = 0.5 * std::numbers::pi;
  while (reader.Left() > 0 && !reader.Failed()) {
    elevation_rad.push_back(reader.Read<double>());
    if (!(elevation_rad.back() < above)) return std::nullopt;
    above = elevation_rad.back();
  }
  if (reader.Failed() || elevation_rad.size() < 2 || !(above > -0.5 * std::numbers::pi)) {
    return std::nullopt;
  }
  return SensorModel(std::move(elevation_rad), static_cast<int>(columns), min_range_m, max_range_m);
}

std::optional<Trajectory> UnpackKeyframes(std::string_view payload) {
  constexpr std::size_t kNumbers = 8;
  if (payload.size() % (kNumbers * sizeof(double)) != 0) return std::nullopt;
  BinaryReader reader(payload);
  Trajectory keyframes;
  while (reader.Left() > 0) {
    std::array<double, kNumbers> v = {};
    for (double& number : v) number = reader.Read<double>();
    const Eigen::Quaterniond q(v[4], v[5], v[6], v[7]);
    const SE3 pose(q, Eigen::Vector3d(v[1], v[2], v[3]));
    if (!pose.IsFinite() || !(q.norm() > 0.5)) return std::nullopt;
    keyframes.push_back({v[0], pose});
  }
  return keyframes;
}

/// What the sections hold; tiles become one map at the end.
struct Contents {
  Trajectory keyframes;
  std::optional<SensorModel> sensor;
  std::string config_yaml;
  std::vector<SavedMap> tiles;
  std::uint64_t gaussians = 0;
};

/// False if the payload is not what its tag says. Tags that are not known are passed over: that is
/// how later covsplats may add to the format.
bool AddSection(const Section& section, Contents& contents) {
  if (section.tag == kConfigTag) {
    auto yaml = UnpackConfig(section.payload);
    if (yaml) contents.config_yaml = std::move(*yaml);
    return yaml.has_value();
  }
  if (section.tag == kSensorTag) {
    contents.sensor = UnpackSensor(section.payload);
    return contents.sensor.has_value();
  }
  if (section.tag == kKeyframesTag) {
    auto keyframes = UnpackKeyframes(section.payload);
    if (keyframes) contents.keyframes = std::move(*keyframes);
    return keyframes.has_value();
  }
  if (section.tag == kTileTag) {
    auto tile = UnpackTile(section.payload);
    if (!tile) return false;
    contents.gaussians += tile->Size();
    contents.tiles.push_back(std::move(*tile));
  }
  return true;
}

template <class T>
void CopyTo(const std::vector<T>& from, std::size_t row, std::vector<T>& to) {
  std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(row));
}

SavedMap JoinTiles(Contents contents) {
  SavedMap map;
  map.keyframes = std::move(contents.keyframes);
  map.sensor = std::move(contents.sensor);
  map.config_yaml = std::move(contents.config_yaml);
  map.Resize(contents.gaussians);
  std::size_t row = 0;
  for (const SavedMap& tile : contents.tiles) {
    for (int p = 0; p < kParameterCount; ++p) {
      std::copy_n(tile.gaussians.Column(p), tile.Size(), map.gaussians.Column(p) + row);
    }
    CopyTo(tile.confidence, row, map.confidence);
    CopyTo(tile.control_score, row, map.control_score);
    CopyTo(tile.intensity, row, map.intensity);
    CopyTo(tile.keyframe, row, map.keyframe);
    CopyTo(tile.last_seen, row, map.last_seen);
    row += tile.Size();
  }
  return map;
}

}  // namespace

std::string PackCompactMap(const SavedMap& map) {
  std::vector<std::string> sections;
  if (!map.config_yaml.empty()) {
    sections.push_back(PackSection(kConfigTag, PackConfig(map.config_yaml)));
  }
  if (map.sensor) sections.push_back(PackSection(kSensorTag, PackSensor(*map.sensor)));
  if (!map.keyframes.empty()) {
    sections.push_back(PackSection(kKeyframesTag, PackKeyframes(map.keyframes)));
  }
  Header header{kCompactMapVersion, 0, 0};
  for (const TileRows& tile : SortIntoTiles(map)) {
    sections.push_back(PackSection(kTileTag, PackTile(map, tile)));
    header.gaussians += tile.rows.size();
  }
  header.sections = static_cast<std::uint32_t>(sections.size());
  std::string bytes = PackHeader(header);
  for (const std::string& section : sections) bytes += section;
  return bytes;
}

Result<SavedMap> ParseCompactMap(std::string_view bytes, const std::string& file) {
  BinaryReader reader(bytes);
  const Result<Header> header = ReadHeader(reader, bytes, file);
  if (!header) return Forward(header);
  Contents contents;
  for (std::size_t number = 1; number <= header->sections; ++number) {
    const std::size_t at = reader.Offset();
    const Result<Section> section = ReadSection(reader, number, *header, file);
    if (!section) return Forward(section);
    if (!AddSection(*section, contents)) {
      return Fail(ErrorCode::kInput,
                  "{}: {} is not as the format has it, though its checksum is right: whatever "
                  "wrote the file made a mistake; export it again",
                  file,
                  NameOf(number, *header, section->tag, at));
    }
  }
  if (reader.Left() > 0 || contents.gaussians != header->gaussians) {
    return Fail(ErrorCode::kInput,
                "{}: holds {} Gaussians and {} further bytes where its header says {} and none; "
                "export it again",
                file,
                contents.gaussians,
                reader.Left(),
                header->gaussians);
  }
  return JoinTiles(std::move(contents));
}

}  // namespace covsplat
