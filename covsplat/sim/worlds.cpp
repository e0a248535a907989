#include "covsplat/sim/worlds.hpp"

#include <array>

#include "covsplat/sim/courtyard.hpp"

namespace covsplat {
namespace {

constexpr std::array<std::string_view, 1> kNames = {"courtyard"};

}  // namespace

std::span<const std::string_view> WorldNames() { return kNames; }

Result<WorldMesh> MakeWorld(std::string_view name, int seed) {
  if (name == "courtyard") return MakeCourtyard(seed);
  return Fail(ErrorCode::kUsage, "unknown world '{}'; known: {}", name, fmt::join(kNames, ", "));
}

}  // namespace covsplat
