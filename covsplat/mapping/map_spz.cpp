#include "covsplat/mapping/map_spz.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "covsplat/io/binary.hpp"
#include "covsplat/io/compression.hpp"

namespace covsplat {
namespace {

constexpr std::uint32_t kMagic = 0x5053474e;  // "NGSP"
constexpr int kWrittenVersion = 3;            // newest that all readers we know take
constexpr int kMaxFractionBits = 12;          // steps of 0.24 mm, up to 2048 m from the origin
constexpr int kPositionLimit = 1 << 23;       // 24 bits with a sign
constexpr double kScaleOffset = 10.0;
constexpr double kScaleSteps = 16.0;   // per factor of e
constexpr double kColorSpread = 0.15;  // what SPZ makes of a colour coefficient of 1
constexpr double kShOfColor = 0.28209479177387814;
constexpr int kRotationSteps = 511;  // of a component up to sqrt(1/2)
constexpr std::size_t kHeaderBytes = 16;
constexpr std::array<std::size_t, 5> kShBytes = {0, 9, 24, 45, 72};  // by degree
constexpr std::size_t kMaxExtraBytes = std::size_t{1} << 20;         // vendors' extensions

struct Header {
  std::uint32_t magic = 0;
  int version = 0;
  std::size_t gaussians = 0;
  int sh_degree = 0;
  int fraction_bits = 0;

  std::size_t RotationBytes() const { return version == 2 ? 3 : 4; }
  std::size_t BodyBytes() const {
    return gaussians *
           (9 + 1 + 3 + 3 + RotationBytes() + kShBytes[static_cast<std::size_t>(sh_degree)]);
  }
};

/// SPZ's x is right, y up and z back; ours are forward, left and up.
Eigen::Matrix3d SpzFromMap() {
  Eigen::Matrix3d R_spz_map;
  R_spz_map << 0.0, -1.0, 0.0,  //
      0.0, 0.0, 1.0,            //
      -1.0, 0.0, 0.0;
  return R_spz_map;
}

std::uint8_t ByteOf(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

/// The three smallest components of a unit quaternion (x y z w) with the number of the largest.
std::uint32_t PackRotation(const Eigen::Quaterniond& rotation) {
  const Eigen::Vector4d q = rotation.normalized().coeffs();
  Eigen::Index largest = 0;
  q.cwiseAbs().maxCoeff(&largest);
  auto bits = static_cast<std::uint32_t>(largest);
  for (Eigen::Index k = 0; k < 4; ++k) {
    if (k == largest) continue;
    const double component = q[largest] < 0.0 ? -q[k] : q[k];
    const long size = std::lround(std::abs(component) * std::numbers::sqrt2 * kRotationSteps);
    bits = (bits << 10) | (component < 0.0 ? 1u << 9 : 0u) |
           static_cast<std::uint32_t>(std::min<long>(size, kRotationSteps));
  }
  return bits;
}

Eigen::Quaterniond UnpackRotation(std::uint32_t bits) {
  const auto largest = static_cast<Eigen::Index>(bits >> 30);
  Eigen::Vector4d q = Eigen::Vector4d::Zero();
  for (Eigen::Index k = 3; k >= 0; --k) {
    if (k == largest) continue;
    const double size = static_cast<double>(bits & 511u) / (std::numbers::sqrt2 * kRotationSteps);
    q[k] = (bits & 512u) != 0 ? -size : size;
    bits >>= 10;
  }
  q[largest] = std::sqrt(std::max(0.0, 1.0 - q.squaredNorm()));
  return Eigen::Quaterniond(q).normalized();
}

/// Version 2: x y z as bytes, w >= 0.
Eigen::Quaterniond UnpackRotation(std::string_view xyz) {
  Eigen::Vector4d q = Eigen::Vector4d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    q[static_cast<Eigen::Index>(k)] = static_cast<unsigned char>(xyz[k]) / 127.5 - 1.0;
  }
  q.w() = std::sqrt(std::max(0.0, 1.0 - q.squaredNorm()));
  return Eigen::Quaterniond(q).normalized();
}

/// As many as leave room for the farthest coordinate; negative if there is none.
int FractionBitsFor(double farthest_m) {
  int bits = kMaxFractionBits;
  while (bits >= 0 && std::ldexp(farthest_m, bits) >= kPositionLimit - 1) --bits;
  return bits;
}

/// The attributes of all Gaussians, one after the other, as the file has them.
struct PackedBody {
  std::string positions, alphas, colors, scales, rotations;
};

void AppendGaussian(const GaussianColumns<float>& table,
                    std::size_t row,
                    int fraction_bits,
                    PackedBody& body) {
  const Eigen::Quaterniond R_spz_map(SpzFromMap());
  const Eigen::Vector3d position = R_spz_map * MeanOf(table, row).cast<double>();
  const Eigen::Vector3d color = NormalOf(table, row).cast<double>().normalized();
  const Eigen::Vector3d log_scale(
      table.Column(kLogScaleU)[row], table.Column(kLogScaleV)[row], std::log(kThicknessM));
  for (int axis = 0; axis < 3; ++axis) {
    const auto steps =
        static_cast<std::uint32_t>(std::lround(std::ldexp(position[axis], fraction_bits)));
    for (int shift = 0; shift < 24; shift += 8) {
      body.positions.push_back(static_cast<char>(steps >> shift));
    }
    const double coefficient = 0.5 * color[axis] / kShOfColor;  // as in map.ply
    AppendBinary(body.colors, ByteOf((coefficient * kColorSpread + 0.5) * 255.0));
    AppendBinary(body.scales, ByteOf((log_scale[axis] + kScaleOffset) * kScaleSteps));
  }
  AppendBinary(body.alphas, ByteOf(255.0 * static_cast<double>(OpacityOf(table, row))));
  AppendBinary(body.rotations, PackRotation(R_spz_map * RotationOf(table, row).cast<double>()));
}

Header ReadHeader(std::string_view bytes) {
  BinaryReader reader(bytes);
  Header header;
  header.magic = reader.Read<std::uint32_t>();
  header.version = static_cast<int>(reader.Read<std::uint32_t>());
  header.gaussians = reader.Read<std::uint32_t>();
  header.sh_degree = reader.Read<std::uint8_t>();
  header.fraction_bits = reader.Read<std::uint8_t>();
  return header;
}

Result<void> CheckHeader(const Header& header, const std::string& file) {
  if (header.magic != kMagic) {
    return Fail(ErrorCode::kInput,
                "{}: is gzip, but neither an SPZ file nor anything else that holds a map",
                file);
  }
  if (header.version != 2 && header.version != 3) {
    return Fail(ErrorCode::kInput,
                "{}: is SPZ of version {}, and covsplat reads 2 and 3; save it as one of these",
                file,
                header.version);
  }
  if (header.sh_degree < 0 || header.sh_degree > 4 || header.fraction_bits > 23) {
    return Fail(ErrorCode::kInput,
                "{}: is damaged: its header has spherical harmonics of degree {} and {} fractional "
                "bits; save it again",
                file,
                header.sh_degree,
                header.fraction_bits);
  }
  return {};
}

/// The same of a file that is read.
struct Body {
  std::string_view positions, alphas, colors, scales, rotations;
};

Eigen::Vector3d PositionOf(const Body& body, const Header& header, std::size_t i) {
  Eigen::Vector3d position;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int32_t steps = 0;
    for (std::size_t byte = 0; byte < 3; ++byte) {
      const auto value = static_cast<unsigned char>(body.positions[9 * i + 3 * axis + byte]);
      steps |= static_cast<std::int32_t>(value) << (8 * byte);
    }
    if (steps >= kPositionLimit) steps -= 2 * kPositionLimit;
    position[static_cast<Eigen::Index>(axis)] = std::ldexp(steps, -header.fraction_bits);
  }
  return position;
}

Eigen::Quaterniond RotationOf(const Body& body, const Header& header, std::size_t i) {
  const std::string_view bytes =
      body.rotations.substr(header.RotationBytes() * i, header.RotationBytes());
  if (header.version == 2) return UnpackRotation(bytes);
  return UnpackRotation(BinaryReader(bytes).Read<std::uint32_t>());
}

SavedMap MapOf(const Body& body, const Header& header) {
  const Eigen::Quaterniond R_map_spz(Eigen::Matrix3d(SpzFromMap().transpose()));
  SavedMap map;
  map.Resize(header.gaussians);
  for (std::size_t i = 0; i < header.gaussians; ++i) {
    Eigen::Vector3f log_scale;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto code = static_cast<unsigned char>(body.scales[3 * i + k]);
      log_scale[static_cast<Eigen::Index>(k)] =
          static_cast<float>(code / kScaleSteps - kScaleOffset);
    }
    const auto alpha_code = static_cast<unsigned char>(body.alphas[i]);
    const double alpha = std::clamp<double>(alpha_code, 0.5, 254.5) / 255.0;  // finite odds
    SetRow(map,
           i,
           (R_map_spz * PositionOf(body, header, i)).cast<float>(),
           (R_map_spz * RotationOf(body, header, i)).cast<float>(),
           log_scale,
           static_cast<float>(std::log(alpha / (1.0 - alpha))));
  }
  return map;
}

}  // namespace

Result<std::string> PackSpz(const SavedMap& map, const std::string& file) {
  std::vector<std::size_t> rows;
  double farthest_m = 0.0;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    if (!IsSound(map.gaussians, i)) continue;
    rows.push_back(i);
    const float coordinate_m = MeanOf(map.gaussians, i).cwiseAbs().maxCoeff();
    farthest_m = std::max(farthest_m, static_cast<double>(coordinate_m));
  }
  const int fraction_bits = FractionBitsFor(farthest_m);
  if (fraction_bits < 0) {
    return Fail(
        ErrorCode::kOutput,
        "{}: SPZ holds no coordinates beyond 8000 km, and this map has {} m; export to .ply",
        file,
        farthest_m);
  }
  PackedBody body;
  for (const std::size_t row : rows) AppendGaussian(map.gaussians, row, fraction_bits, body);
  std::string bytes;
  AppendBinary(bytes, kMagic);
  AppendBinary(bytes, std::uint32_t{kWrittenVersion});
  AppendBinary(bytes, static_cast<std::uint32_t>(rows.size()));
  AppendBinary(bytes, std::uint8_t{0});  // degree of the spherical harmonics
  AppendBinary(bytes, static_cast<std::uint8_t>(fraction_bits));
  AppendBinary(bytes, std::uint16_t{0});  // flags, reserved
  return Gzip(bytes + body.positions + body.alphas + body.colors + body.scales + body.rotations);
}

Result<SpzFile> ParseSpz(std::string_view bytes, const std::string& file) {
  const Header header = ReadHeader(GunzipStart(bytes, kHeaderBytes));
  if (const Result<void> good = CheckHeader(header, file); !good) return Forward(good);
  const std::size_t needed = kHeaderBytes + header.BodyBytes();
  const std::optional<std::string> whole = Gunzip(bytes, needed + kMaxExtraBytes);
  if (!whole || whole->size() < needed) {
    return Fail(ErrorCode::kInput,
                "{}: is truncated or damaged: it does not unpack to the {} bytes of the {} "
                "Gaussians that its header names; copy or save it again",
                file,
                needed,
                header.gaussians);
  }
  BinaryReader reader(*whole);
  reader.Take(kHeaderBytes);
  Body body;
  body.positions = reader.Take(9 * header.gaussians);
  body.alphas = reader.Take(header.gaussians);
  body.colors = reader.Take(3 * header.gaussians);
  body.scales = reader.Take(3 * header.gaussians);
  body.rotations = reader.Take(header.RotationBytes() * header.gaussians);
  return SpzFile{header.version, MapOf(body, header)};
}

}  // namespace covsplat
