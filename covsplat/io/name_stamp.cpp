#include "covsplat/io/name_stamp.hpp"

#include <algorithm>
#include <cctype>

#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

// Seconds since 1970 have ten digits from 2001 to 2286.
constexpr std::size_t kSecondsDigits = 10;
constexpr std::size_t kNanosecondsDigits = 9;

bool IsNumber(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isdigit(c) != 0;
  });
}

/// Digits as they stand behind a decimal point.
std::optional<double> WithFraction(std::string_view seconds, std::string_view fraction) {
  if (seconds.size() != kSecondsDigits || !IsNumber(seconds) || !IsNumber(fraction)) return {};
  return ParseDouble(std::string(seconds) + "." + std::string(fraction));
}

}  // namespace

std::optional<double> StampOfName(std::string_view stem) {
  if (const std::size_t dot = stem.rfind('.'); dot != std::string_view::npos) {
    return WithFraction(stem.substr(0, dot), stem.substr(dot + 1));
  }
  const std::size_t last = stem.rfind('_');
  if (last != std::string_view::npos) {
    std::string_view seconds = stem.substr(0, last);
    seconds.remove_prefix(seconds.rfind('_') + 1);  // npos + 1 is 0
    const std::string nanoseconds(stem.substr(last + 1));
    if (nanoseconds.size() > kNanosecondsDigits) return {};
    return WithFraction(seconds,
                        std::string(kNanosecondsDigits - nanoseconds.size(), '0') + nanoseconds);
  }
  const bool whole_unit = stem.size() == 13 || stem.size() == 16 || stem.size() == 19;
  if (!whole_unit) return {};
  return WithFraction(stem.substr(0, kSecondsDigits), stem.substr(kSecondsDigits));
}

std::vector<double> StampsOfNames(const std::vector<std::filesystem::path>& files) {
  std::vector<double> stamps;
  for (const std::filesystem::path& file : files) {
    const std::optional<double> stamp = StampOfName(file.stem().string());
    if (!stamp || (!stamps.empty() && *stamp <= stamps.back())) return {};
    stamps.push_back(*stamp);
  }
  return stamps;
}

}  // namespace covsplat
