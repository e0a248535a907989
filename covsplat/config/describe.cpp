#include <algorithm>
#include <string>
#include <vector>

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

struct Section {
  std::string path;
  std::string doc;
  std::string rows;
};

/// Fields may come after sections within their own.
Section& SectionOf(const ConfigEntry& field, std::vector<Section>& sections) {
  const std::size_t dot = field.path.rfind('.');
  const std::string path = dot == std::string::npos ? "" : field.path.substr(0, dot);
  return *std::find_if(
      sections.begin(), sections.end(), [&](const Section& s) { return s.path == path; });
}

std::string Text(const Section& section, bool is_first) {
  std::string text;
  if (!section.path.empty()) {
    text += fmt::format("{}## `{}`\n", is_first ? "" : "\n", section.path);
    if (!section.doc.empty()) text += fmt::format("\n{}\n", section.doc);
  }
  return section.rows.empty() ? text : text + kTableHead + section.rows;
}

}  // namespace

std::string DescribeConfig(const ConfigSchema& schema) {
  std::vector<Section> sections = {{"", "", ""}};
  for (const ConfigEntry& entry : schema) {
    if (entry.IsSection()) {
      sections.push_back({entry.path, entry.doc, ""});
    } else {
      SectionOf(entry, sections).rows += Row(entry);
    }
  }
  std::string text;
  for (const Section& section : sections) text += Text(section, text.empty());
  return text;
}

}  // namespace covsplat::internal
