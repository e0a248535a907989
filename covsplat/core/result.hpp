// Result<T>: the outcome of anything that depends on the outside world (files, configuration,
// devices). Our own mistakes are COVSPLAT_CHECKs; numerical outcomes are fields of result structs.
#pragma once

#include <string>

#include <fmt/format.h>
#include <tl/expected.hpp>

namespace covsplat {

enum class ErrorCode {
  kUsage,        ///< the request itself is wrong: flags, configuration keys and values
  kInput,        ///< something that was read is missing or damaged
  kOutput,       ///< something could not be written
  kUnavailable,  ///< this build or machine cannot do it (for example CUDA)
};

/// What went wrong, where, and what to do about it; `message` is a full sentence for the user.
struct Error {
  ErrorCode code = ErrorCode::kInput;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

/// Makes the error arm of any Result: `return Fail(ErrorCode::kInput, "{}: is empty", path);`
template <class... Args>
tl::unexpected<Error> Fail(ErrorCode code, fmt::format_string<Args...> text, Args&&... args) {
  return tl::unexpected<Error>(Error{code, fmt::format(text, std::forward<Args>(args)...)});
}

/// Passes an error of one Result on as the error of another.
template <class T>
tl::unexpected<Error> Forward(const Result<T>& failed) {
  return tl::unexpected<Error>(failed.error());
}

}  // namespace covsplat
