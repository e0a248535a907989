#include "apps/own_verb.hpp"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

extern char** environ;

namespace covsplat {
namespace {

constexpr const char* kThisProgram = "/proc/self/exe";

/// Where the child's stdout goes.
class StdoutToFile {
 public:
  explicit StdoutToFile(const std::filesystem::path& file) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(
        &actions_, STDOUT_FILENO, file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  }
  ~StdoutToFile() { posix_spawn_file_actions_destroy(&actions_); }
  StdoutToFile(const StdoutToFile&) = delete;
  StdoutToFile& operator=(const StdoutToFile&) = delete;

  const posix_spawn_file_actions_t* Get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

}  // namespace

Result<void> RunOwnVerb(const std::vector<std::string>& words, const std::filesystem::path& out) {
  std::vector<std::string> owned = {"covsplat"};
  owned.insert(owned.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  arguments.reserve(owned.size() + 1);
  for (std::string& word : owned) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const StdoutToFile redirect(out);
  pid_t child = 0;
  const int failed =
      posix_spawn(&child, kThisProgram, redirect.Get(), nullptr, arguments.data(), environ);
  if (failed != 0) {
    return Fail(ErrorCode::kUnavailable,
                "covsplat {} cannot be started, with {} for its output: {}",
                words.front(),
                out.string(),
                std::generic_category().message(failed));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return Fail(ErrorCode::kUnavailable,
              "covsplat {} failed ({} {})",
              words.front(),
              WIFSIGNALED(status) ? "signal" : "exit code",
              WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
}

}  // namespace covsplat
