// What the shell sees of a command's end.
#pragma once

#include <cstdio>

#include "covsplat/core/result.hpp"

namespace covsplat {

enum ExitCode : int {
  kExitOk = 0,
  kExitUsage = 2,        ///< wrong flags or configuration
  kExitInput = 3,        ///< something to read is missing or damaged
  kExitOutput = 4,       ///< something could not be written
  kExitUnavailable = 5,  ///< this build or machine cannot do it
  kExitInterrupted = 130,
};

ExitCode ExitCodeOf(ErrorCode code);

/// Prints "covsplat: error: ..." and gives the exit code.
ExitCode ReportError(const Error& error, std::FILE* out = stderr);

/// Prints "covsplat: warning: ...".
void ReportWarning(const std::string& message, std::FILE* out = stderr);

}  // namespace covsplat
