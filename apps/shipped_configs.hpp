// The files of configs/, which are part of the program.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace covsplat {

/// The text of configs/NAME.yaml; nothing if there is none.
std::optional<std::string> ShippedConfig(std::string_view name);

}  // namespace covsplat
