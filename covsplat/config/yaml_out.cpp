#include <algorithm>
#include <sstream>
#include <string>

#include <fmt/format.h>

#include "covsplat/config/config.hpp"
#include "covsplat/config/field_value.hpp"

namespace covsplat::internal {
namespace {

/// Doc lines as comments, the last one with what the value may be.
std::string Comment(const ConfigEntry& entry, const std::string& indent) {
  std::string text = entry.doc;
  if (const std::string choices = FormatChoices(entry); !choices.empty()) {
    text += fmt::format("{}({})", text.empty() ? "" : " ", choices);
  }
  std::istringstream lines(text);
  std::string comment;
  for (std::string line; std::getline(lines, line);) {
    comment += fmt::format("{}# {}\n", indent, line);
  }
  return comment;
}

}  // namespace

std::string DumpYaml(const ConfigSchema& schema) {
  std::string yaml;
  for (const ConfigEntry& entry : schema) {
    const auto depth = std::count(entry.path.begin(), entry.path.end(), '.');
    const std::string indent(static_cast<std::size_t>(2 * depth), ' ');
    const std::string name = entry.path.substr(entry.path.rfind('.') + 1);
    if (entry.IsSection() && !yaml.empty()) yaml += "\n";
    yaml += Comment(entry, indent);
    yaml += entry.IsSection() ? fmt::format("{}{}:\n", indent, name)
                              : fmt::format("{}{}: {}\n", indent, name, FormatValue(entry));
  }
  return yaml;
}

}  // namespace covsplat::internal
