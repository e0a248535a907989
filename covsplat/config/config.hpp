// Reading, writing, checking and describing any struct that follows the Visit protocol. All text is
// independent of the locale.
#pragma once

#include <string>
#include <string_view>

#include "covsplat/config/schema.hpp"
#include "covsplat/core/result.hpp"

namespace covsplat {

namespace internal {
Result<void> LoadYaml(const std::string& path, const ConfigSchema& schema);
Result<void> LoadYamlText(const std::string& text,
                          const std::string& name,
                          const ConfigSchema& schema);
Result<void> ApplyOverride(std::string_view assignment, const ConfigSchema& schema);
Result<void> CheckConfig(const ConfigSchema& schema);
std::string DumpYaml(const ConfigSchema& schema);
std::string DescribeConfig(const ConfigSchema& schema);

/// Runs `change` on the schema of a copy, which replaces `config` only if all went well.
template <class Config, class Change>
Result<void> Transact(Config& config, Change&& change) {
  Config copy = config;
  Result<void> outcome = change(MakeSchema(copy));
  if (outcome) config = std::move(copy);
  return outcome;
}
}  // namespace internal

/// Overwrites the fields that the file names; the others keep their values, as do all if there is
/// an error. Unknown keys, keys given twice and values out of range are errors that name the line.
template <class Config>
Result<void> LoadYaml(const std::string& path, Config& config) {
  return internal::Transact(
      config, [&](const ConfigSchema& schema) { return internal::LoadYaml(path, schema); });
}

/// The same from text; `name` stands for the file in errors.
template <class Config>
Result<void> LoadYamlText(const std::string& text, const std::string& name, Config& config) {
  return internal::Transact(config, [&](const ConfigSchema& schema) {
    return internal::LoadYamlText(text, name, schema);
  });
}

/// Applies one "section.key=value". Lists are written "[1, 2, 3]" or "1,2,3".
template <class Config>
Result<void> ApplyOverride(std::string_view assignment, Config& config) {
  return internal::Transact(config, [&](const ConfigSchema& schema) {
    return internal::ApplyOverride(assignment, schema);
  });
}

/// Whether every number is within its range and every enum has a name; for configs made in code.
template <class Config>
Result<void> CheckConfig(Config config) {
  return internal::CheckConfig(MakeSchema(config));
}

/// All fields with their docs as comments. LoadYaml of the text gives exactly the same values.
template <class Config>
std::string DumpYaml(Config config) {
  return internal::DumpYaml(MakeSchema(config));
}

/// Reference of all fields in Markdown: a table per section with key, default, range and meaning,
/// where the defaults are the values in `config`.
template <class Config>
std::string DescribeConfig(Config config) {
  return internal::DescribeConfig(MakeSchema(config));
}

}  // namespace covsplat
