// Runs another verb of this program in a process of its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "covsplat/core/result.hpp"

namespace covsplat {

/// Waits for `covsplat WORDS...`, whose stdout goes into a file; errors of the verb are printed by
/// it and come back as one sentence. In a process of its own it gives back all its memory, and a
/// verb that crashes takes nothing with it.
Result<void> RunOwnVerb(const std::vector<std::string>& words, const std::filesystem::path& out);

}  // namespace covsplat
