#include "covsplat/mapping/map_file.hpp"

#include <string_view>
#include <utility>

#include "covsplat/io/output_file.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/mapping/compact_map.hpp"
#include "covsplat/mapping/map_ply.hpp"
#include "covsplat/mapping/map_spz.hpp"

namespace covsplat {
namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b";
constexpr std::string_view kPlainSpzMagic = "NGSP";  // SPZ from version 4 on is not gzip

Result<MapFile> NamedFormat(std::string format, Result<SavedMap> map) {
  if (!map) return Forward(map);
  return MapFile{std::move(format), std::move(*map)};
}

}  // namespace

Result<MapFormat> MapFormatOf(const std::filesystem::path& path) {
  if (path.extension() == ".ply") return MapFormat::kPly;
  if (path.extension() == ".spz") return MapFormat::kSpz;
  if (path.extension() == ".csmap") return MapFormat::kCompact;
  return Fail(ErrorCode::kUsage,
              "{}: cannot tell the format of a map by \"{}\"; end the name with .csmap, .ply or "
              ".spz",
              path.string(),
              path.extension().string());
}

Result<MapFile> ReadMapFile(const std::filesystem::path& path) {
  const Result<std::string> read = ReadFile(path);
  if (!read) return Forward(read);
  const std::string_view bytes = *read;
  const std::string file = path.string();
  if (bytes.starts_with("CSMAP")) {
    return NamedFormat(fmt::format("csmap, version {}", kCompactMapVersion),
                       ParseCompactMap(bytes, file));
  }
  if (bytes.starts_with("ply")) return NamedFormat("ply", ParseMapPly(bytes, file));
  if (bytes.starts_with(kGzipMagic)) {
    Result<SpzFile> spz = ParseSpz(bytes, file);
    if (!spz) return Forward(spz);
    return MapFile{fmt::format("spz, version {}", spz->version), std::move(spz->map)};
  }
  if (bytes.starts_with(kPlainSpzMagic)) {
    return Fail(ErrorCode::kInput,
                "{}: is SPZ of version 4 or later, and covsplat reads 2 and 3; save it as one of "
                "these",
                file);
  }
  return Fail(
      ErrorCode::kInput,
      "{}: is no map: {}",
      file,
      bytes.empty() ? "the file is empty" : "it starts as neither .csmap nor .ply nor .spz does");
}

Result<void> WriteMapFile(const std::filesystem::path& path,
                          MapFormat format,
                          const SavedMap& map) {
  if (format == MapFormat::kPly) return WriteMapPly(path, map);
  if (format == MapFormat::kCompact) return WriteFileAtomically(path, PackCompactMap(map));
  const Result<std::string> spz = PackSpz(map, path.string());
  if (!spz) return Forward(spz);
  return WriteFileAtomically(path, *spz);
}

}  // namespace covsplat
