// Pieces of HTML that is also well-formed XML.
#pragma once

#include <string>
#include <string_view>

#include "covsplat/report/png.hpp"

namespace covsplat {

/// Text for element content and for attributes in either kind of quotes. Control characters and
/// broken UTF-8 become U+FFFD.
std::string EscapeHtml(std::string_view text);

/// An <img/> with the picture inside; empty for an empty image.
std::string ImageTag(const Image<Rgb>& image, std::string_view alt, std::string_view css_class);

/// The style sheet of a report, with a dark variant.
std::string_view PageStyle();

}  // namespace covsplat
