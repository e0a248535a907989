// YAML into a schema. yaml-cpp throws; its exceptions end in this file.
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "covsplat/config/config.hpp"
#include "covsplat/config/field_value.hpp"
#include "covsplat/config/nearest_key.hpp"

namespace covsplat::internal {
namespace {

constexpr std::size_t kMaxFileBytes = 1 << 20;

tl::unexpected<Error> FailAt(const std::string& path, int line, const std::string& message) {
  return Fail(ErrorCode::kUsage, "{}:{}: {}", path, line + 1, message);
}

bool IsText(const std::string& text) {
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x20 && c != '\n' && c != '\r' && c != '\t') return false;
  }
  return true;
}

Result<std::string> ReadText(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return Fail(ErrorCode::kUsage, "{}: is a folder, not a configuration file", path);
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    const std::string reason = std::generic_category().message(errno);
    return Fail(ErrorCode::kUsage, "{}: cannot read the configuration file: {}", path, reason);
  }
  std::string text(kMaxFileBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxFileBytes) {
    return Fail(ErrorCode::kUsage, "{}: is larger than 1 MiB, no configuration file is", path);
  }
  if (!IsText(text)) return Fail(ErrorCode::kUsage, "{}: is not a text file", path);
  return text;
}

/// Hears a document and does nothing.
class DeafHandler final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&,
                const std::string&,
                YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&,
                       const std::string&,
                       YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&,
                  const std::string&,
                  YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Whether something follows the first document. YAML::LoadAll would tell too, but it never returns
/// from a file that begins with a comma (yaml-cpp 0.7).
bool HasSecondDocument(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DeafHandler handler;
  return parser.HandleNextDocument(handler) && parser.HandleNextDocument(handler);
}

/// The text of a scalar or a list of scalars; nothing for anything else.
std::optional<RawValue> RawValueOf(const YAML::Node& node) {
  if (node.IsScalar()) return RawValue{false, {node.Scalar()}};
  if (!node.IsSequence()) return std::nullopt;
  RawValue list{true, {}};
  for (const YAML::Node& item : node) {
    if (!item.IsScalar()) return std::nullopt;
    list.items.push_back(item.Scalar());
  }
  return list;
}

const ConfigEntry* Find(const ConfigSchema& schema, const std::string& path) {
  for (const ConfigEntry& entry : schema) {
    if (entry.path == path) return &entry;
  }
  return nullptr;
}

/// Walks a document along the schema; the schema bounds the depth, whatever the aliases do.
class Loader {
 public:
  Loader(const std::string& path, const ConfigSchema& schema) : path_(path), schema_(schema) {}

  Result<void> LoadMap(const YAML::Node& map, const std::string& prefix) const {
    std::set<std::string> seen;
    for (const auto& pair : map) {
      const int line = pair.first.Mark().line;
      if (!pair.first.IsScalar()) return FailAt(path_, line, "a key must be a plain word");
      const std::string key = prefix + pair.first.Scalar();
      if (!seen.insert(key).second) {
        return FailAt(path_, line, fmt::format("key '{}' is given twice", key));
      }
      Result<void> loaded = LoadKey(key, pair.second, line);
      if (!loaded) return loaded;
    }
    return {};
  }

 private:
  Result<void> LoadKey(const std::string& key, const YAML::Node& node, int line) const {
    const ConfigEntry* entry = Find(schema_, key);
    if (entry == nullptr) return FailAt(path_, line, UnknownKey(key, schema_, node.IsMap()));
    if (!entry->IsSection()) return LoadField(*entry, node, line);
    if (node.IsNull()) return {};
    if (node.IsMap()) return LoadMap(node, key + ".");
    return FailAt(path_, line, fmt::format("'{}' is a section and needs keys below it", key));
  }

  Result<void> LoadField(const ConfigEntry& field, const YAML::Node& node, int line) const {
    const std::optional<RawValue> raw = RawValueOf(node);
    if (!raw) {
      const char* what = node.IsNull() ? "has no value" : "cannot be a section or a nested list";
      return FailAt(path_, line, fmt::format("'{}' {}", field.path, what));
    }
    const auto problem = Assign(field, *raw);
    if (!problem) return {};
    return FailAt(path_, line, fmt::format("{} = {}: {}", field.path, raw->Text(), *problem));
  }

  const std::string& path_;
  const ConfigSchema& schema_;
};

}  // namespace

Result<void> LoadYaml(const std::string& path, const ConfigSchema& schema) {
  const Result<std::string> text = ReadText(path);
  if (!text) return Forward(text);
  return LoadYamlText(*text, path, schema);
}

Result<void> LoadYamlText(const std::string& text,
                          const std::string& path,
                          const ConfigSchema& schema) {
  try {
    if (HasSecondDocument(text)) {
      return Fail(ErrorCode::kUsage, "{}: must hold one YAML document and nothing else", path);
    }
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return {};
    if (!root.IsMap()) {
      return FailAt(path, root.Mark().line, "the file must consist of 'section:' and 'key: value'");
    }
    return Loader(path, schema).LoadMap(root, "");
  } catch (const YAML::Exception& error) {
    return FailAt(path, error.mark.line, fmt::format("not valid YAML: {}", error.msg));
  } catch (const std::exception& error) {
    return Fail(ErrorCode::kUsage, "{}: cannot be read as YAML: {}", path, error.what());
  }
}

}  // namespace covsplat::internal
