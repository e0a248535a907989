#include "apps/bench_table.hpp"

#include "apps/paper_results.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

/// The figures of a row, from the paper or from us; what there is not is left out.
struct Figures {
  std::optional<double> ate_rmse_m, accuracy_cm, completeness_cm, chamfer_l1_cm, f_score_percent,
      scans_per_s, gaussians, map_mb;
};

Figures FiguresOf(const PaperResult& paper) {
  Figures figures;
  figures.ate_rmse_m = paper.ate_rmse_m;
  if (paper.map) {
    figures.accuracy_cm = paper.map->accuracy_cm;
    figures.completeness_cm = paper.map->completeness_cm;
    figures.chamfer_l1_cm = paper.map->chamfer_l1_cm;
    figures.f_score_percent = paper.map->f_score_percent;
    figures.scans_per_s = paper.map->scans_per_s;
  }
  figures.gaussians = paper.gaussians;
  figures.map_mb = paper.map_mb;
  return figures;
}

Figures FiguresOf(const BenchResult& ours) {
  Figures figures;
  if (ours.exit_code != kExitOk) return figures;
  figures.ate_rmse_m = ours.ate_rmse_m;
  if (ours.map) {
    figures.accuracy_cm = ours.map->accuracy_cm;
    figures.completeness_cm = ours.map->completeness_cm;
    figures.chamfer_l1_cm = ours.map->chamfer_l1_cm;
    figures.f_score_percent = ours.map->f_score_percent;
  }
  figures.scans_per_s = ours.scans_per_s;
  figures.gaussians = static_cast<double>(ours.gaussians);
  figures.map_mb = ours.map_mb;
  return figures;
}

std::string Cell(const std::optional<double>& value, int digits, int width) {
  return value ? fmt::format("{:>{}.{}f}", *value, width, digits)
               : fmt::format("{:>{}}", "-", width);
}

std::string Row(std::string_view sequence, std::string_view who, const Figures& f) {
  return fmt::format("{:23} {:9}{}{}{}{}{}{}{}{}\n",
                     sequence,
                     who,
                     Cell(f.ate_rmse_m, 3, 8),
                     Cell(f.accuracy_cm, 2, 8),
                     Cell(f.completeness_cm, 2, 8),
                     Cell(f.chamfer_l1_cm, 2, 9),
                     Cell(f.f_score_percent, 2, 8),
                     Cell(f.scans_per_s, 2, 9),
                     Cell(f.gaussians, 0, 11),
                     Cell(f.map_mb, 1, 8));
}

Json FiguresJson(const Figures& f) {
  Json json;
  const auto add = [&](const char* name, const std::optional<double>& value) {
    json[name] = value ? Json(*value) : Json(nullptr);
  };
  add("ate_rmse_m", f.ate_rmse_m);
  add("accuracy_cm", f.accuracy_cm);
  add("completeness_cm", f.completeness_cm);
  add("chamfer_l1_cm", f.chamfer_l1_cm);
  add("f_score_percent", f.f_score_percent);
  add("scans_per_s", f.scans_per_s);
  add("gaussians", f.gaussians);
  add("map_mb", f.map_mb);
  return json;
}

std::string NotesOn(const BenchResult& ours, const std::optional<PaperResult>& paper) {
  if (ours.exit_code != kExitOk) {
    return fmt::format(
        "{}: the run ended with exit code {}\n", ours.sequence, static_cast<int>(ours.exit_code));
  }
  std::string text;
  if (ours.first_scans >= 0) {
    text += fmt::format(
        "{}: its first {} scans only, the paper has all\n", ours.sequence, ours.first_scans);
  }
  const bool expected = paper && paper->map;
  if (!ours.map_note.empty() && expected) {
    text += fmt::format("{}: the map is not judged: {}\n", ours.sequence, ours.map_note);
  }
  return text;
}

}  // namespace

std::string BenchTable(std::string_view data_set,
                       std::span<const BenchResult> results,
                       std::span<const MissingSequence> missing) {
  std::string notes;
  std::string text = fmt::format("{:23} {:9}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>11}{:>8}\n",
                                 data_set,
                                 "",
                                 "ATE m",
                                 "Acc cm",
                                 "Com cm",
                                 "C-L1 cm",
                                 "F %",
                                 "scans/s",
                                 "Gaussians",
                                 "MB");
  for (const BenchResult& ours : results) {
    const std::optional<PaperResult> paper = FindPaperResult(data_set, ours.sequence);
    if (paper) text += Row(ours.sequence, "paper", FiguresOf(*paper));
    text += Row(paper ? "" : ours.sequence, "covsplat", FiguresOf(ours));
    notes += NotesOn(ours, paper);
  }
  for (const auto& [name, reason] : missing) {
    notes += fmt::format("{}: is missing: {}\n", name, reason);
  }
  text +=
      fmt::format("\nF at 0.2 m. paper: Ryzen 9 7900X and RTX 4090; covsplat: {}\n", MachineName());
  return text + notes;
}

std::string BenchJson(std::string_view data_set,
                      std::span<const BenchResult> results,
                      std::span<const MissingSequence> missing) {
  Json json = {{"data_set", data_set}, {"machine", MachineName()}};
  json["sequences"] = Json::array();
  json["missing"] = Json::array();
  for (const BenchResult& ours : results) {
    const std::optional<PaperResult> paper = FindPaperResult(data_set, ours.sequence);
    Json sequence = {{"name", ours.sequence},
                     {"exit_code", static_cast<int>(ours.exit_code)},
                     {"covsplat", FiguresJson(FiguresOf(ours))},
                     {"paper", paper ? FiguresJson(FiguresOf(*paper)) : Json(nullptr)}};
    if (!ours.map_note.empty()) sequence["map_note"] = ours.map_note;
    if (ours.first_scans >= 0) sequence["first_scans"] = ours.first_scans;
    json["sequences"].push_back(std::move(sequence));
  }
  for (const auto& [name, reason] : missing) {
    json["missing"].push_back({{"name", name}, {"reason", reason}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace covsplat
