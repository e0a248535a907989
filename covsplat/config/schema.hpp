// The fields of a config struct as a flat list: one visitor turns any Visit-able struct into data,
// so that everything else here is ordinary code.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "covsplat/core/config_field.hpp"

namespace covsplat {

/// Access to an enum field by the position of its value in `names`.
struct EnumAccess {
  std::vector<std::string> names;
  std::function<std::size_t()> get;  ///< names.size() if the value has no name
  std::function<void(std::size_t)> set;
};

/// One field or section of a config struct; points into the struct it was made from.
struct ConfigEntry {
  using Value = std::variant<std::monostate,  // a section
                             int*,
                             double*,
                             bool*,
                             std::string*,
                             std::vector<double>*,
                             EnumAccess>;

  std::string path;  ///< with dots: "tracking.gicp.max_iterations"
  std::string doc;
  Range range;  ///< of numbers, and of the numbers in a list
  Value value;

  bool IsSection() const { return std::holds_alternative<std::monostate>(value); }
};

/// In the order of Visit; a section comes right before its fields.
using ConfigSchema = std::vector<ConfigEntry>;

/// The visitor behind MakeSchema.
class SchemaBuilder {
 public:
  template <class T>
  requires std::is_same_v<T, int> || std::is_same_v<T, double> ||
      std::is_same_v<T, std::vector<double>>
  void Field(std::string_view name, T& value, Range range, std::string_view doc) {
    Add(name, doc, range, &value);
  }

  template <class T>
  requires std::is_same_v<T, bool> || std::is_same_v<T, std::string>
  void Field(std::string_view name, T& value, std::string_view doc) { Add(name, doc, {}, &value); }

  template <class E>
  requires std::is_enum_v<E>
  void Field(std::string_view name, E& value, std::string_view doc) {
    constexpr const auto& kNames = EnumNames<E>::kNames;
    EnumAccess access;
    for (const EnumName<E>& choice : kNames) access.names.emplace_back(choice.name);
    access.get = [&value] {
      std::size_t i = 0;
      while (i < kNames.size() && kNames[i].value != value) ++i;
      return i;
    };
    access.set = [&value](std::size_t i) { value = kNames[i].value; };
    Add(name, doc, {}, std::move(access));
  }

  template <class Nested>
  void Section(std::string_view name, Nested& nested, std::string_view doc) {
    Add(name, doc, {}, std::monostate());
    const std::string outer = prefix_;
    prefix_ += std::string(name) + ".";
    Nested::Visit(nested, *this);
    prefix_ = outer;
  }

  ConfigSchema Take() { return std::move(schema_); }

 private:
  void Add(std::string_view name, std::string_view doc, Range range, ConfigEntry::Value value) {
    schema_.push_back({prefix_ + std::string(name), std::string(doc), range, std::move(value)});
  }

  std::string prefix_;
  ConfigSchema schema_;
};

/// `config` must outlive the schema.
template <class Config>
ConfigSchema MakeSchema(Config& config) {
  SchemaBuilder builder;
  Config::Visit(config, builder);
  return builder.Take();
}

}  // namespace covsplat
