#include <string>

#include <fmt/format.h>

#include "covsplat/config/config.hpp"
#include "covsplat/config/field_value.hpp"

namespace covsplat::internal {
namespace {

constexpr const char* kTableHead = "\n| key | default | range | meaning |\n|---|---|---|---|\n";

/// Text that cannot end a table cell.
std::string Cell(const std::string& text) {
  std::string cell;
  for (const char c : text) {
    if (c == '|') cell += '\\';
    cell += c == '\n' ? ' ' : c;
  }
  return cell;
}

std::string Row(const ConfigEntry& field) {
  const std::string name = field.path.substr(field.path.rfind('.') + 1);
  return fmt::format("| `{}` | `{}` | {} | {} |\n",
                     name,
                     Cell(FormatValue(field)),
                     Cell(FormatChoices(field)),
                     Cell(field.doc));
}

}  // namespace

std::string DescribeConfig(const ConfigSchema& schema) {
  std::string text;
  bool in_table = false;
  for (const ConfigEntry& entry : schema) {
    if (entry.IsSection()) {
      text += fmt::format("{}## `{}`\n", text.empty() ? "" : "\n", entry.path);
      if (!entry.doc.empty()) text += fmt::format("\n{}\n", entry.doc);
    } else {
      text += in_table ? Row(entry) : kTableHead + Row(entry);
    }
    in_table = !entry.IsSection();
  }
  return text;
}

}  // namespace covsplat::internal
