#include "apps/command_line.hpp"

#include <fstream>
#include <sstream>

namespace covsplat {
namespace {

bool IsPlain(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
  return !word.empty() && word.find_first_not_of(kPlain) == std::string::npos;
}

std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string QuoteWords(const std::string& words) {
  std::string line;
  std::istringstream stream(words);
  for (std::string word; std::getline(stream, word, '\0');) {
    if (!line.empty()) line += ' ';
    line += IsPlain(word) ? word : Quoted(word);
  }
  return line;
}

std::string CommandLine() {
  std::ostringstream words;
  words << std::ifstream("/proc/self/cmdline").rdbuf();
  return QuoteWords(words.str());
}

}  // namespace covsplat
