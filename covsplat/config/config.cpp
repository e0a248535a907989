#include "covsplat/config/config.hpp"

#include "covsplat/config/field_value.hpp"
#include "covsplat/config/nearest_key.hpp"

namespace covsplat::internal {
namespace {

std::string Trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(kBlank) - first + 1));
}

/// "[1, 2]" or "1,2".
RawValue SplitList(std::string_view text) {
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  RawValue list{true, {}};
  if (Trim(text).empty()) return list;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    list.items.push_back(Trim(text.substr(begin, comma - begin)));
    begin = comma + 1;
  }
  return list;
}

}  // namespace

Result<void> ApplyOverride(std::string_view assignment, const ConfigSchema& schema) {
  const std::size_t equals = assignment.find('=');
  const std::string key = Trim(assignment.substr(0, equals));
  if (equals == std::string_view::npos || key.empty()) {
    return Fail(ErrorCode::kUsage, "'{}': must have the form section.key=value", assignment);
  }
  const std::string text = Trim(assignment.substr(equals + 1));
  for (const ConfigEntry& entry : schema) {
    if (entry.path != key) continue;
    const bool is_list = std::holds_alternative<std::vector<double>*>(entry.value);
    const auto problem = Assign(entry, is_list ? SplitList(text) : RawValue{false, {text}});
    if (problem) return Fail(ErrorCode::kUsage, "{} = {}: {}", key, text, *problem);
    return {};
  }
  return Fail(ErrorCode::kUsage, "{}", UnknownKey(key, schema, false));
}

Result<void> CheckConfig(const ConfigSchema& schema) {
  for (const ConfigEntry& entry : schema) {
    const auto problem = FindProblem(entry);
    if (!problem) continue;
    return Fail(ErrorCode::kUsage, "{} = {}: {}", entry.path, FormatValue(entry), *problem);
  }
  return {};
}

}  // namespace covsplat::internal
