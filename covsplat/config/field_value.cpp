#include "covsplat/config/field_value.hpp"

#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace covsplat::internal {
namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;  // clang 14 does not find it by itself

/// std::from_chars does not know the locale; it knows "nan" and "inf", which no field may be.
template <class T>
bool ParseNumber(std::string_view text, T& number) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with("+") || text.starts_with("-+")) return false;
  T parsed{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), parsed);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  if (!std::isfinite(static_cast<double>(parsed))) return false;
  number = parsed;
  return true;
}

bool InRange(double number, Range range) { return number >= range.low && number <= range.high; }

std::string FormatDouble(double number) {
  if (std::isnan(number)) return ".nan";
  if (std::isinf(number)) return number > 0 ? ".inf" : "-.inf";
  std::string text = fmt::format("{}", number);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string FormatList(const std::vector<double>& numbers) {
  std::vector<std::string> items;
  items.reserve(numbers.size());
  for (const double number : numbers) items.push_back(FormatDouble(number));
  return fmt::format("[{}]", fmt::join(items, ", "));
}

std::string Quote(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += {'\\', c};
    } else if (code < 0x20 || code == 0x7F) {
      quoted += fmt::format("\\x{:02x}", code);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

bool AssignBool(const std::string& text, bool& value) {
  if (text != "true" && text != "false") return false;
  value = text == "true";
  return true;
}

bool AssignList(const RawValue& raw, std::vector<double>& value) {
  std::vector<double> numbers(raw.items.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!ParseNumber(raw.items[i], numbers[i])) return false;
  }
  value = std::move(numbers);
  return raw.is_list;
}

bool AssignEnum(const std::string& text, const EnumAccess& value) {
  for (std::size_t i = 0; i < value.names.size(); ++i) {
    if (value.names[i] != text) continue;
    value.set(i);
    return true;
  }
  return false;
}

/// What a value of the wrong type should have been.
std::string TypeWanted(const ConfigEntry& field) {
  const std::string choices = FormatChoices(field);
  const auto number = [&](std::string_view kind) {
    return fmt::format("must be {} within {}", kind, choices);
  };
  return std::visit(Overloaded{[](std::monostate) { return std::string("is a section"); },
                               [&](int*) { return number("a whole number"); },
                               [&](double*) { return number("a number"); },
                               [](bool*) { return std::string("must be true or false"); },
                               [](std::string*) { return std::string("must be one text"); },
                               [&](std::vector<double>*) {
                                 return number("a list of numbers such as [1, 2], each");
                               },
                               [&](const EnumAccess&) { return "must be one of " + choices; }},
                    field.value);
}

}  // namespace

std::string RawValue::Text() const {
  return is_list ? fmt::format("[{}]", fmt::join(items, ", ")) : items.front();
}

std::optional<std::string> Assign(const ConfigEntry& field, const RawValue& raw) {
  const bool wants_list = std::holds_alternative<std::vector<double>*>(field.value);
  if (raw.is_list != wants_list) return TypeWanted(field);
  const bool assigned = std::visit(
      Overloaded{[](std::monostate) { return false; },
                 [&](int* value) { return ParseNumber(raw.items.front(), *value); },
                 [&](double* value) { return ParseNumber(raw.items.front(), *value); },
                 [&](bool* value) { return AssignBool(raw.items.front(), *value); },
                 [&](std::string* value) { return *value = raw.items.front(), true; },
                 [&](std::vector<double>* value) { return AssignList(raw, *value); },
                 [&](const EnumAccess& value) { return AssignEnum(raw.items.front(), value); }},
      field.value);
  return assigned ? FindProblem(field) : TypeWanted(field);
}

std::optional<std::string> FindProblem(const ConfigEntry& field) {
  bool good = true;
  if (const auto* whole = std::get_if<int*>(&field.value)) good = InRange(**whole, field.range);
  if (const auto* real = std::get_if<double*>(&field.value)) good = InRange(**real, field.range);
  if (const auto* list = std::get_if<std::vector<double>*>(&field.value)) {
    for (const double number : **list) good = good && InRange(number, field.range);
    if (!good) return "each number must be within " + FormatChoices(field);
  }
  if (const auto* choice = std::get_if<EnumAccess>(&field.value)) {
    if (choice->get() >= choice->names.size()) return TypeWanted(field);
  }
  if (good) return std::nullopt;
  return "must be within " + FormatChoices(field);
}

std::string FormatValue(const ConfigEntry& field) {
  return std::visit(Overloaded{[](std::monostate) { return std::string(); },
                               [](const int* value) { return fmt::format("{}", *value); },
                               [](const double* value) { return FormatDouble(*value); },
                               [](const bool* value) { return fmt::format("{}", *value); },
                               [](const std::string* value) { return Quote(*value); },
                               [](const std::vector<double>* value) { return FormatList(*value); },
                               [](const EnumAccess& value) {
                                 const std::size_t i = value.get();
                                 return i < value.names.size() ? value.names[i] : "~";
                               }},
                    field.value);
}

std::string FormatChoices(const ConfigEntry& field) {
  if (const auto* choice = std::get_if<EnumAccess>(&field.value)) {
    return fmt::format("{}", fmt::join(choice->names, ", "));
  }
  if (std::holds_alternative<bool*>(field.value)) return "true, false";
  if (std::holds_alternative<std::string*>(field.value) || field.IsSection()) return "";
  return fmt::format("{} to {}", field.range.low, field.range.high);
}

}  // namespace covsplat::internal
