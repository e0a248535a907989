// The valid key that a mistyped one most likely meant.
#pragma once

#include <string>
#include <string_view>

#include "covsplat/config/schema.hpp"

namespace covsplat::internal {

/// Number of insertions, deletions and replacements of characters that turn a into b.
int EditDistance(std::string_view a, std::string_view b);

/// Full path of the nearest field, or of the nearest section if `want_section` and there is one.
/// A key without its section counts as nearly right. Empty for an empty schema.
std::string NearestKey(std::string_view key, const ConfigSchema& schema, bool want_section);

/// `unknown key 'a.c'; did you mean 'a.b'?`
std::string UnknownKey(std::string_view key, const ConfigSchema& schema, bool want_section);

}  // namespace covsplat::internal
