// Text of single config values, both ways.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "covsplat/config/schema.hpp"

namespace covsplat::internal {

/// A value as a file or the command line spells it.
struct RawValue {
  bool is_list = false;
  std::vector<std::string> items;  ///< exactly one unless it is a list

  std::string Text() const;
};

/// Sets the field, or says what it must be: "must be a whole number within 1 to 200".
std::optional<std::string> Assign(const ConfigEntry& field, const RawValue& raw);

/// What is wrong with the field's present value, if anything.
std::optional<std::string> FindProblem(const ConfigEntry& field);

/// As YAML: numbers in the shortest form that reads back the same, strings in quotes.
std::string FormatValue(const ConfigEntry& field);

/// "1 to 200", "fast, exact", "true, false"; empty where anything goes.
std::string FormatChoices(const ConfigEntry& field);

}  // namespace covsplat::internal
