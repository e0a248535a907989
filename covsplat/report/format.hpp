// Quantities as short text for people; "n/a" for what is not finite.
#pragma once

#include <string>

namespace covsplat {

/// "512 B", "3.4 MB", "1.2 GB" (powers of 1000).
std::string FormatBytes(double bytes);

/// "950", "12 345", "1.23 M": whole numbers with thin groups, millions shortened.
std::string FormatCount(double count);

/// "12.3 s", "4:05 min", "1:02:03 h".
std::string FormatSeconds(double seconds);

/// "3.2 mm", "4.7 cm", "12.3 m", "1.25 km".
std::string FormatMetres(double metres);

/// Three significant digits and never an exponent for everyday sizes.
std::string FormatNumber(double number);

}  // namespace covsplat
