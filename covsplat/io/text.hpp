// The text side of every file format: whole files, lines with numbers, words, numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"

namespace covsplat {

/// The bytes of a file; the error says why it cannot be read.
Result<std::string> ReadFile(const std::filesystem::path& path);

/// Walks over the lines of a text, which must outlive it. Line ends are \n or \r\n.
class LineReader {
 public:
  explicit LineReader(std::string_view text, std::size_t offset = 0, std::int64_t number = 0)
      : text_(text), offset_(offset), number_(number) {}

  /// Moves to the next line; false at the end of the text.
  bool Next();
  /// As Next(), but passes over lines that are blank or start with '#'.
  bool NextWithContent();

  std::string_view Line() const { return line_; }
  std::int64_t Number() const { return number_; }  ///< of the line, from 1
  std::size_t Offset() const { return offset_; }   ///< byte that follows the line's end

 private:
  std::string_view text_;
  std::string_view line_;
  std::size_t offset_;
  std::int64_t number_;
};

/// What stands between the blanks and tabs of a line.
std::vector<std::string_view> SplitWords(std::string_view line);

/// Nothing unless the whole word is a number; "nan" and "inf" are.
std::optional<double> ParseDouble(std::string_view word);
std::optional<std::int64_t> ParseInteger(std::string_view word);

/// The numbers of a line, or nothing if any word is not one.
std::optional<std::vector<double>> ParseDoubles(std::string_view line);

}  // namespace covsplat
