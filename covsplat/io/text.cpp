#include "covsplat/io/text.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <memory>
#include <system_error>

namespace covsplat {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

template <class T>
std::optional<T> ParseWhole(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

tl::unexpected<Error> CannotRead(const std::filesystem::path& path) {
  const std::string reason = std::error_code(errno, std::generic_category()).message();
  return Fail(ErrorCode::kInput, "{}: cannot be read: {}", path.string(), reason);
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

Result<std::string> ReadFile(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
  if (!file) return CannotRead(path);
  std::error_code ignored;
  const std::uintmax_t expected = std::filesystem::file_size(path, ignored);
  std::string bytes;
  if (!ignored) bytes.reserve(expected + 1);
  std::string block(std::size_t{1} << 18, '\0');
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file.get())) {
    bytes.append(block, 0, count);
  }
  if (std::ferror(file.get()) != 0) return CannotRead(path);
  return bytes;
}

bool LineReader::Next() {
  if (offset_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', offset_), text_.size());
  line_ = text_.substr(offset_, end - offset_);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  offset_ = std::min(end + 1, text_.size());
  ++number_;
  return true;
}

bool LineReader::NextWithContent() {
  while (Next()) {
    const std::size_t first = line_.find_first_not_of(kBlanks);
    if (first != std::string_view::npos && line_[first] != '#') return true;
  }
  return false;
}

std::vector<std::string_view> SplitWords(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t begin = line.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

std::optional<double> ParseDouble(std::string_view word) { return ParseWhole<double>(word); }

std::optional<std::int64_t> ParseInteger(std::string_view word) {
  return ParseWhole<std::int64_t>(word);
}

std::optional<std::vector<double>> ParseDoubles(std::string_view line) {
  std::vector<double> numbers;
  for (const std::string_view word : SplitWords(line)) {
    const std::optional<double> number = ParseDouble(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace covsplat
