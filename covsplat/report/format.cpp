#include "covsplat/report/format.hpp"

#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace covsplat {
namespace {
constexpr const char* kNotAvailable = "n/a";
}

std::string FormatBytes(double bytes) {
  if (!std::isfinite(bytes)) return kNotAvailable;
  if (std::abs(bytes) < 999.5) return fmt::format("{:.0f} B", bytes);
  for (const char* unit : {"kB", "MB"}) {
    bytes /= 1000.0;
    if (std::abs(bytes) < 999.5) return FormatNumber(bytes) + " " + unit;
  }
  return FormatNumber(bytes / 1000.0) + " GB";
}

std::string FormatCount(double count) {
  if (!std::isfinite(count)) return kNotAvailable;
  if (std::abs(count) >= 999999.5) return fmt::format("{:.2f} M", count / 1e6);
  const auto whole = static_cast<std::int64_t>(std::llround(count));
  if (std::abs(whole) < 10000) return fmt::format("{}", whole);
  return fmt::format("{} {:03}", whole / 1000, std::abs(whole % 1000));
}

std::string FormatSeconds(double seconds) {
  if (!std::isfinite(seconds) || std::abs(seconds) > 1e9) return kNotAvailable;
  if (seconds < 59.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(seconds));
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string FormatMetres(double metres) {
  if (!std::isfinite(metres)) return kNotAvailable;
  const double size = std::abs(metres);
  if (size < 0.00995) return fmt::format("{:.1f} mm", metres * 1000.0);
  if (size < 0.9995) return fmt::format("{:.1f} cm", metres * 100.0);
  if (size < 999.95) return fmt::format("{:.1f} m", metres);
  return fmt::format("{:.2f} km", metres / 1000.0);
}

std::string FormatNumber(double number) {
  if (!std::isfinite(number)) return kNotAvailable;
  const double size = std::abs(number);
  if (size != 0.0 && (size < 1e-4 || size >= 1e7)) return fmt::format("{:.2e}", number);
  const int digits = size < 1e-12 ? 0 : static_cast<int>(std::floor(std::log10(size)));
  return fmt::format("{:.{}f}", number, digits >= 2 ? 0 : 2 - digits);
}

}  // namespace covsplat
