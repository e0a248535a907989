// The protocol by which config structs describe themselves. A struct lists its fields once:
//
//   struct GicpConfig {
//     double max_correspondence_m = 1.0;
//     template <class Self, class V>
//     static void Visit(Self& c, V&& v) {
//       v.Field("max_correspondence_m", c.max_correspondence_m, Range{0.01, 10.0}, "reject ...");
//     }
//   };
//
// and every consumer (YAML in and out, `--set`, range checks, the configuration reference) is a
// visitor with the members
//   Field(name, number, Range, doc)     int, double
//   Field(name, value, doc)             bool, std::string, enum with EnumNames
//   Field(name, vector<double>, Range, doc)
//   Section(name, nested struct, doc)
#pragma once

#include <array>
#include <string_view>

namespace covsplat {

/// Inclusive limits of a numeric field.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// Name of one enumerator in configuration files.
template <class E>
struct EnumName {
  E value;
  std::string_view name;
};

/// Specialise with `static constexpr std::array<EnumName<E>, N> kNames` for every enum that is a
/// config field.
template <class E>
struct EnumNames;

}  // namespace covsplat
