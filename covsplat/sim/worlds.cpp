#include "covsplat/sim/worlds.hpp"

#include <array>

#include "covsplat/sim/city.hpp"
#include "covsplat/sim/college.hpp"
#include "covsplat/sim/courtyard.hpp"
#include "covsplat/sim/multilevel.hpp"
#include "covsplat/sim/street.hpp"
#include "covsplat/sim/tunnel.hpp"

namespace covsplat {
namespace {

std::vector<Mover> NothingMoves(int) { return {}; }

constexpr std::array kWorlds = {
    WorldKind{"courtyard",
              "a quad between four facades: arcade, windows, trees, lawn",
              "handheld",
              MakeCourtyard,
              CourtyardRoute,
              NothingMoves},
    WorldKind{"college",
              "two courts joined by a passage, rooms, a terrace with stairs; revisits",
              "walking",
              MakeCollege,
              CollegeRoute,
              NothingMoves},
    WorldKind{"street",
              "a loop of 620 m round city blocks: traffic, people, parked cars, trees",
              "vehicle",
              MakeStreet,
              StreetRoute,
              StreetTraffic},
    WorldKind{"city",
              "10 km through a grid of streets: people, parked cars, trees; revisits",
              "vehicle",
              [](int seed) { return MakeCity(seed); },
              [] { return CityRoute(); },
              [](int seed) { return CityPeople(seed); }},
    WorldKind{"tunnel",
              "220 m of smooth tunnel between two portals; degenerate along its axis",
              "vehicle",
              MakeTunnel,
              TunnelRoute,
              NothingMoves},
    WorldKind{"multilevel",
              "three floors that look alike, joined by stairs; bait for false loops",
              "walking",
              MakeMultilevel,
              MultilevelRoute,
              NothingMoves},
};

}  // namespace

std::span<const WorldKind> Worlds() { return kWorlds; }

Result<WorldKind> FindWorld(std::string_view name) {
  std::vector<std::string_view> names;
  for (const WorldKind& world : kWorlds) {
    if (world.name == name) return world;
    names.push_back(world.name);
  }
  return Fail(ErrorCode::kUsage, "unknown world '{}'; known: {}", name, fmt::join(names, ", "));
}

}  // namespace covsplat
