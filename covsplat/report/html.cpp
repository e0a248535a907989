#include "covsplat/report/html.hpp"

#include <cstdint>

#include <fmt/format.h>

namespace covsplat {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Length of the UTF-8 sequence at the start, 0 if it is broken or not allowed in XML.
std::size_t SequenceLength(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  const bool is_control = lead < 0x20 && lead != '\t' && lead != '\n' && lead != '\r';
  if (lead < 0x80) return is_control || lead == 0x7F ? 0 : 1;
  if (lead < 0xC2 || lead > 0xF4) return 0;
  const std::size_t length = lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  if (text.size() < length) return 0;
  std::uint32_t code = lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = code << 6 | (byte(i) & 0x3FU);
  }
  const bool too_long = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool forbidden = (code >= 0xD800 && code < 0xE000) || code == 0xFFFE || code == 0xFFFF;
  return too_long || forbidden || code > 0x10FFFF ? 0 : length;
}

}  // namespace

std::string EscapeHtml(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    const std::size_t length = SequenceLength(text);
    switch (length == 0 ? '\0' : text.front()) {
      case '\0':
        escaped += kReplacement;
        break;
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return escaped;
}

std::string ImageTag(const Image<Rgb>& image, std::string_view alt, std::string_view css_class) {
  const auto png = EncodePng(image);
  if (!png) return "";
  return fmt::format(
      "<img class='{}' alt='{}' width='{}' height='{}' src='data:image/png;base64,{}'/>",
      css_class,
      EscapeHtml(alt),
      image.Columns(),
      image.Rows(),
      Base64(*png));
}

}  // namespace covsplat
