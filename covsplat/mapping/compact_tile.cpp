#include "covsplat/mapping/compact_tile.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

#include "covsplat/io/binary.hpp"
#include "covsplat/io/compression.hpp"

namespace covsplat {
namespace {

// What each step of an integer stands for. All are part of the format.
constexpr double kStepsPerMetre = 2048.0;
constexpr int kCubeBits = 17;       // 2^17 steps are 64 m
constexpr double kLogSteps = 64.0;  // per factor of e: scales, odds of the opacity, intensity
constexpr std::int64_t kNormalSteps = 2047;  // from the middle of the octahedral map to its edge
constexpr int kTwistSteps = 256;             // of half a turn in the plane
constexpr double kConfidenceSteps = 255.0;
constexpr double kScoreSteps = 254.0;
constexpr int kUnknown = -1;  // control score, keyframes
constexpr double kMaxLog = 100.0;
constexpr int kNoIntensity = -8192;  // less than any logarithm
constexpr double kMaxMeanM = 1e7;

/// The columns after the positions, in the order of the file.
enum Column : std::size_t {
  kNormalU,
  kNormalV,
  kTwist,
  kLnScaleU,
  kLnScaleV,
  kLogit,
  kConfidence,
  kControlScore,
  kLnIntensity,
  kKeyframe,
  kLastSeen,
  kColumnCount
};
using Codes = std::array<std::int64_t, kColumnCount>;

struct Bounds {
  std::int64_t low = 0;
  std::int64_t high = 0;
};
constexpr std::int64_t kMaxLogCode = 6400;  // kMaxLog * kLogSteps
constexpr Bounds kLogs = {-kMaxLogCode, kMaxLogCode};
constexpr Bounds kKeyframes = {kUnknown, (std::int64_t{1} << 31) - 1};
constexpr std::array<Bounds, kColumnCount> kBounds = {{{0, 2 * kNormalSteps},
                                                       {0, 2 * kNormalSteps},
                                                       {0, kTwistSteps - 1},
                                                       kLogs,
                                                       kLogs,
                                                       kLogs,
                                                       {0, 255},
                                                       {kUnknown, 254},
                                                       {kNoIntensity, kMaxLogCode},
                                                       kKeyframes,
                                                       kKeyframes}};
constexpr std::uint64_t kMortonEnd = std::uint64_t{1} << (3 * kCubeBits);

bool CanBeStored(const GaussianColumns<float>& table, std::size_t row) {
  return IsSound(table, row) &&
         static_cast<double>(MeanOf(table, row).cwiseAbs().maxCoeff()) < kMaxMeanM;
}

// --- positions

std::uint64_t Interleave(const std::array<std::int64_t, 3>& steps) {
  std::uint64_t code = 0;
  for (int bit = kCubeBits - 1; bit >= 0; --bit) {
    for (int axis = 2; axis >= 0; --axis) {
      code = 2 * code +
             (static_cast<std::uint64_t>(steps[static_cast<std::size_t>(axis)] >> bit) & 1u);
    }
  }
  return code;
}

std::array<std::int64_t, 3> Deinterleave(std::uint64_t code) {
  std::array<std::int64_t, 3> steps = {};
  for (int bit = 0; bit < 3 * kCubeBits; ++bit) {
    steps[static_cast<std::size_t>(bit % 3)] |= static_cast<std::int64_t>((code >> bit) & 1u)
                                                << (bit / 3);
  }
  return steps;
}

struct Place {
  std::array<std::int32_t, 3> cube = {};
  std::uint64_t morton = 0;  ///< of the step within the cube
};

Place PlaceOf(const Eigen::Vector3f& mean) {
  Place place;
  std::array<std::int64_t, 3> within = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double metres = static_cast<double>(mean[static_cast<Eigen::Index>(axis)]);
    const auto steps = static_cast<std::int64_t>(std::floor(metres * kStepsPerMetre));
    place.cube[axis] = static_cast<std::int32_t>(steps >> kCubeBits);
    within[axis] = steps & ((std::int64_t{1} << kCubeBits) - 1);
  }
  place.morton = Interleave(within);
  return place;
}

/// The middle of a step.
Eigen::Vector3f MeanAt(const std::array<std::int32_t, 3>& cube, std::uint64_t morton) {
  const std::array<std::int64_t, 3> within = Deinterleave(morton);
  Eigen::Vector3f mean;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t steps = (std::int64_t{cube[axis]} << kCubeBits) + within[axis];
    mean[static_cast<Eigen::Index>(axis)] =
        static_cast<float>((static_cast<double>(steps) + 0.5) / kStepsPerMetre);
  }
  return mean;
}

// --- orientations

/// The octahedral map: the unit sphere unfolded to the square [-1, 1]^2.
Eigen::Vector2d UnfoldNormal(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = normal / normal.lpNorm<1>();
  if (n.z() >= 0.0) return n.head<2>();
  return {(1.0 - std::abs(n.y())) * std::copysign(1.0, n.x()),
          (1.0 - std::abs(n.x())) * std::copysign(1.0, n.y())};
}

Eigen::Vector3d FoldNormal(std::int64_t code_u, std::int64_t code_v) {
  double x = static_cast<double>(code_u - kNormalSteps) / kNormalSteps;
  double y = static_cast<double>(code_v - kNormalSteps) / kNormalSteps;
  const double z = 1.0 - std::abs(x) - std::abs(y);
  if (z < 0.0) {
    const double folded_x = (1.0 - std::abs(y)) * std::copysign(1.0, x);
    y = (1.0 - std::abs(x)) * std::copysign(1.0, y);
    x = folded_x;
  }
  return Eigen::Vector3d(x, y, z).normalized();
}

/// The shortest rotation from z to a normal; about x if the normal is -z.
Eigen::Quaterniond SwingTo(const Eigen::Vector3d& normal) {
  const Eigen::Quaterniond swing(1.0 + normal.z(), -normal.y(), normal.x(), 0.0);
  return swing.norm() < 1e-6 ? Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0) : swing.normalized();
}

void EncodeRotation(const Eigen::Quaternionf& rotation, Codes& codes) {
  const Eigen::Quaterniond q = rotation.cast<double>().normalized();
  const Eigen::Vector2d square = UnfoldNormal(q * Eigen::Vector3d::UnitZ());
  codes[kNormalU] = std::llround((square.x() + 1.0) * kNormalSteps);
  codes[kNormalV] = std::llround((square.y() + 1.0) * kNormalSteps);
  // On an edge of the square a code and its mirror image are one normal; keep the larger.
  for (const auto& [edge, along] : {std::pair(kNormalU, kNormalV), std::pair(kNormalV, kNormalU)}) {
    if (codes[edge] % (2 * kNormalSteps) != 0) continue;
    codes[along] = std::max(codes[along], 2 * kNormalSteps - codes[along]);
  }
  // The twist is measured from the normal as it will be read, so the two fit.
  const Eigen::Quaterniond rest =
      SwingTo(FoldNormal(codes[kNormalU], codes[kNormalV])).conjugate() * q;
  const double half_turns = 2.0 * std::atan2(rest.z(), rest.w()) / std::numbers::pi;
  const std::int64_t code = std::llround(half_turns * kTwistSteps);
  codes[kTwist] = code & (kTwistSteps - 1);  // half a turn more is the same ellipse
}

Eigen::Quaternionf DecodeRotation(const Codes& codes) {
  const double angle = static_cast<double>(codes[kTwist]) * std::numbers::pi / kTwistSteps;
  const Eigen::Quaterniond twist(std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle));
  return (SwingTo(FoldNormal(codes[kNormalU], codes[kNormalV])) * twist).cast<float>();
}

// --- the rest

std::int64_t EncodeLog(float value) {
  return std::llround(std::clamp(static_cast<double>(value), -kMaxLog, kMaxLog) * kLogSteps);
}

float DecodeLog(std::int64_t code) {
  return static_cast<float>(static_cast<double>(code) / kLogSteps);
}

/// Of a value in [0, 1]; what is not is unknown.
std::int64_t EncodeShare(float value, double steps, int unknown) {
  if (!(value >= 0.0f)) return unknown;
  return std::llround(std::min(static_cast<double>(value), 1.0) * steps);
}

Codes Encode(const SavedMap& map, std::size_t row) {
  Codes codes = {};
  EncodeRotation(RotationOf(map.gaussians, row), codes);
  codes[kLnScaleU] = EncodeLog(map.gaussians.Column(kLogScaleU)[row]);
  codes[kLnScaleV] = EncodeLog(map.gaussians.Column(kLogScaleV)[row]);
  codes[kLogit] = EncodeLog(map.gaussians.Column(kOpacityLogit)[row]);
  codes[kConfidence] = EncodeShare(map.confidence[row], kConfidenceSteps, 0);
  codes[kControlScore] = EncodeShare(map.control_score[row], kScoreSteps, kUnknown);
  const bool has_intensity = map.intensity[row] > 0.0f;  // false for NaN
  codes[kLnIntensity] = has_intensity ? EncodeLog(std::log(map.intensity[row])) : kNoIntensity;
  codes[kKeyframe] = std::max(map.keyframe[row], kUnknown);
  codes[kLastSeen] = std::max(map.last_seen[row], kUnknown);
  return codes;
}

void Decode(const Codes& codes, const Eigen::Vector3f& mean, std::size_t row, SavedMap& map) {
  WriteGaussian(map.gaussians,
                row,
                mean,
                DecodeRotation(codes),
                {DecodeLog(codes[kLnScaleU]), DecodeLog(codes[kLnScaleV])},
                DecodeLog(codes[kLogit]));
  map.confidence[row] =
      static_cast<float>(static_cast<double>(codes[kConfidence]) / kConfidenceSteps);
  const bool has_score = codes[kControlScore] != kUnknown;
  map.control_score[row] =
      has_score ? static_cast<float>(static_cast<double>(codes[kControlScore]) / kScoreSteps)
                : -1.0f;
  const bool has_intensity = codes[kLnIntensity] != kNoIntensity;
  map.intensity[row] = has_intensity ? std::exp(DecodeLog(codes[kLnIntensity])) : 0.0f;
  map.keyframe[row] = static_cast<int>(codes[kKeyframe]);
  map.last_seen[row] = static_cast<int>(codes[kLastSeen]);
}

// --- columns of integers

/// The smallest value, the number of byte planes, and the planes of what the values are above it:
/// first all lowest bytes, then all second ones. A plane of its own compresses best.
void AppendColumn(std::span<const std::int64_t> values, std::string& bytes) {
  const auto ends = std::minmax_element(values.begin(), values.end());
  const std::int64_t low = *ends.first;
  const auto offset = [low](std::int64_t value) { return static_cast<std::uint64_t>(value - low); };
  int planes = 1;
  while (planes < 8 && (offset(*ends.second) >> (8 * planes)) != 0) ++planes;
  AppendBinary(bytes, low);
  AppendBinary(bytes, static_cast<std::uint8_t>(planes));
  for (int plane = 0; plane < planes; ++plane) {
    std::string column;
    column.reserve(values.size());
    for (const std::int64_t value : values) {
      column.push_back(static_cast<char>(offset(value) >> (8 * plane)));
    }
    const std::string packed = Deflate(column);
    AppendBinary(bytes, static_cast<std::uint32_t>(packed.size()));
    bytes += packed;
  }
}

/// `count` values; nothing if they are damaged or out of bounds.
std::optional<std::vector<std::int64_t>> ReadColumn(BinaryReader& reader,
                                                    std::size_t count,
                                                    const Bounds& bounds) {
  const auto low = reader.Read<std::int64_t>();
  const int planes = reader.Read<std::uint8_t>();
  if (reader.Failed() || planes < 1 || planes > 8) return std::nullopt;
  std::vector<std::uint64_t> offsets(count, 0);
  for (int plane = 0; plane < planes; ++plane) {
    const auto size = reader.Read<std::uint32_t>();
    const std::optional<std::string> column = Inflate(reader.Take(size), count);
    if (!column) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
      offsets[i] |= std::uint64_t{static_cast<unsigned char>((*column)[i])} << (8 * plane);
    }
  }
  std::vector<std::int64_t> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    values[i] = static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + offsets[i]);
    if (values[i] < bounds.low || values[i] > bounds.high) return std::nullopt;
  }
  return values;
}

}  // namespace

std::vector<TileRows> SortIntoTiles(const SavedMap& map) {
  struct Item {
    Place place;
    std::size_t row;
  };
  std::vector<Item> items;
  for (std::size_t row = 0; row < map.Size(); ++row) {
    if (CanBeStored(map.gaussians, row))
      items.push_back({PlaceOf(MeanOf(map.gaussians, row)), row});
  }
  std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
    return std::tie(a.place.cube, a.place.morton, a.row) <
           std::tie(b.place.cube, b.place.morton, b.row);
  });
  std::vector<TileRows> tiles;
  for (const Item& item : items) {
    if (tiles.empty() || tiles.back().cube != item.place.cube ||
        tiles.back().rows.size() == kMaxTileGaussians) {
      tiles.push_back({item.place.cube, {}});
    }
    tiles.back().rows.push_back(item.row);
  }
  return tiles;
}

std::string PackTile(const SavedMap& map, const TileRows& tile) {
  std::vector<std::int64_t> positions;
  std::array<std::vector<std::int64_t>, kColumnCount> columns;
  std::int64_t last = 0;
  for (const std::size_t row : tile.rows) {
    const auto morton = static_cast<std::int64_t>(PlaceOf(MeanOf(map.gaussians, row)).morton);
    positions.push_back(morton - last);
    last = morton;
    const Codes codes = Encode(map, row);
    for (std::size_t c = 0; c < kColumnCount; ++c) columns[c].push_back(codes[c]);
  }
  std::string bytes;
  for (const std::int32_t coordinate : tile.cube) AppendBinary(bytes, coordinate);
  AppendBinary(bytes, static_cast<std::uint32_t>(tile.rows.size()));
  AppendColumn(positions, bytes);
  for (const std::vector<std::int64_t>& column : columns) AppendColumn(column, bytes);
  return bytes;
}

std::optional<SavedMap> UnpackTile(std::string_view bytes) {
  BinaryReader reader(bytes);
  std::array<std::int32_t, 3> cube = {};
  for (std::int32_t& coordinate : cube) coordinate = reader.Read<std::int32_t>();
  const std::size_t count = reader.Read<std::uint32_t>();
  if (reader.Failed() || count == 0 || count > kMaxTileGaussians) return std::nullopt;
  const auto positions = ReadColumn(reader, count, {0, static_cast<std::int64_t>(kMortonEnd) - 1});
  if (!positions) return std::nullopt;
  std::vector<Codes> codes(count);
  for (std::size_t c = 0; c < kColumnCount; ++c) {
    const auto column = ReadColumn(reader, count, kBounds[c]);
    if (!column) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) codes[i][c] = (*column)[i];
  }
  if (reader.Left() != 0) return std::nullopt;
  SavedMap map;
  map.Resize(count);
  std::uint64_t morton = 0;
  for (std::size_t i = 0; i < count; ++i) {
    morton += static_cast<std::uint64_t>((*positions)[i]);
    if (morton >= kMortonEnd) return std::nullopt;
    Decode(codes[i], MeanAt(cube, morton), i, map);
  }
  return map;
}

}  // namespace covsplat
