// The words this process was started with.
#pragma once

#include <string>

namespace covsplat {

/// As one line that a shell would take again; words that need quotes have them.
std::string CommandLine();

/// The same from words that each end in a zero byte, as in /proc/self/cmdline.
std::string QuoteWords(const std::string& words);

}  // namespace covsplat
