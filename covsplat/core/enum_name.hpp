// From an enumerator to the name that configuration and result files have for it.
#pragma once

#include <string_view>

#include "covsplat/core/config_field.hpp"

namespace covsplat {

/// "unknown" for a value that EnumNames<E> does not list.
template <class E>
constexpr std::string_view NameOfEnum(E wanted) {
  for (const auto& [value, name] : EnumNames<E>::kNames) {
    if (value == wanted) return name;
  }
  return "unknown";
}

}  // namespace covsplat
