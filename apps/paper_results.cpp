#include "apps/paper_results.hpp"

#include <array>

namespace covsplat {
namespace {

constexpr std::array<PaperResult, 9> kResults = {{
    {"newer_college",
     "quad-easy",
     0.080,
     PaperMapResult{7.62, 15.02, 11.32, 86.78, 22.15},
     129885,
     5.0},
    {"newer_college",
     "math-easy",
     0.160,
     PaperMapResult{14.43, 18.54, 16.48, 70.35, 25.25},
     std::nullopt,
     std::nullopt},
    {"oxford_spires",
     "observatory-quarter-01",
     0.336,
     PaperMapResult{14.48, 27.18, 20.83, 56.89, 17.99},
     std::nullopt,
     std::nullopt},
    {"oxford_spires",
     "keble-college-02",
     0.177,
     PaperMapResult{12.71, 24.57, 18.64, 64.02, 19.58},
     344473,
     13.8},
    {"kitti", "00", 1.080, std::nullopt, 1510033, 42.1},
    {"kitti", "01", 2.260, std::nullopt, std::nullopt, std::nullopt},
    {"kitti", "07", 0.338, std::nullopt, std::nullopt, std::nullopt},
    {"kitti", "08", 2.900, std::nullopt, std::nullopt, std::nullopt},
    {"kitti", "09", 1.260, std::nullopt, std::nullopt, std::nullopt},
}};

}  // namespace

std::span<const PaperResult> PaperResults() { return kResults; }

std::optional<PaperResult> FindPaperResult(std::string_view data_set, std::string_view sequence) {
  for (const PaperResult& result : kResults) {
    if (result.data_set == data_set && result.sequence == sequence) return result;
  }
  return std::nullopt;
}

}  // namespace covsplat
