#include "apps/exit_code.hpp"

namespace covsplat {

ExitCode ExitCodeOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kUsage:
      return kExitUsage;
    case ErrorCode::kInput:
      return kExitInput;
    case ErrorCode::kOutput:
      return kExitOutput;
    case ErrorCode::kUnavailable:
      return kExitUnavailable;
  }
  return kExitInput;
}

ExitCode ReportError(const Error& error, std::FILE* out) {
  std::fprintf(out, "covsplat: error: %s\n", error.message.c_str());
  return ExitCodeOf(error.code);
}

void ReportWarning(const std::string& message, std::FILE* out) {
  std::fprintf(out, "covsplat: warning: %s\n", message.c_str());
}

}  // namespace covsplat
