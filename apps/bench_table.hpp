// The figures of a bench beside the paper's, for people and for programs.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/bench_run.hpp"
#include "apps/data_sets.hpp"

namespace covsplat {

/// Two rows for each sequence, the paper's and ours, and what else there is to say.
std::string BenchTable(std::string_view data_set,
                       std::span<const BenchResult> results,
                       std::span<const MissingSequence> missing);

std::string BenchJson(std::string_view data_set,
                      std::span<const BenchResult> results,
                      std::span<const MissingSequence> missing);

}  // namespace covsplat
