// The figures of a map evaluation as JSON and as a table.
#include "apps/map_evaluation.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

Json SurfaceJson(const JudgedSurface& surface) {
  return {{"path", surface.path.string()},
          {"kind", surface.triangles > 0 ? "mesh" : "points"},
          {"triangles", surface.triangles},
          {"points", surface.points}};
}

Json ErrorsJson(const SurfaceError& error) {
  Json json = {{"accuracy_cm", 100.0 * error.accuracy_m},
               {"completeness_cm", 100.0 * error.completeness_m},
               {"chamfer_l1_cm", 100.0 * error.chamfer_m},
               {"result_points", error.result_points},
               {"truth_points", error.truth_points},
               {"result_left_out_percent", 100.0 * error.result_left_out},
               {"truth_left_out_percent", 100.0 * error.truth_left_out}};
  for (const ThresholdScore& score : error.scores) {
    json["scores"].push_back({{"tau_m", score.tau_m},
                              {"precision_percent", 100.0 * score.precision},
                              {"recall_percent", 100.0 * score.recall},
                              {"f_score_percent", 100.0 * score.f_score}});
  }
  return json;
}

Json MatrixJson(const SE3& pose) {
  Json rows = Json::array();
  const Eigen::Matrix4d matrix = pose.Matrix();
  for (int i = 0; i < 4; ++i) {
    rows.push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2), matrix(i, 3)});
  }
  return rows;
}

Json SettingsJson(const MapEvaluationRequest& request) {
  return {{"voxel_m", request.sampling.voxel_m},
          {"samples_per_voxel", request.sampling.samples_per_voxel},
          {"seed", request.sampling.seed},
          {"truncation_m", request.errors.truncation_m},
          {"crop_m", request.errors.crop_m},
          {"visible_m", request.visibility.near_m},
          {"space_m", request.visibility.space_m}};
}

std::string SurfaceLine(const char* name, const JudgedSurface& surface) {
  const std::string points = FormatCount(static_cast<double>(surface.points));
  const std::string what = surface.triangles > 0
                               ? fmt::format("mesh, {} triangles as {} points",
                                             FormatCount(static_cast<double>(surface.triangles)),
                                             points)
                               : fmt::format("cloud without faces, {} points", points);
  return fmt::format("{:8} {} ({})\n", name, surface.path.string(), what);
}

std::string ErrorTable(const char* title, const char* note, const SurfaceError& error) {
  std::string text = fmt::format("\n{}: {}\n", title, note);
  text += fmt::format("  accuracy {:.2f} cm, completeness {:.2f} cm, Chamfer-L1 {:.2f} cm\n",
                      100.0 * error.accuracy_m,
                      100.0 * error.completeness_m,
                      100.0 * error.chamfer_m);
  text += fmt::format("  not counted: {:.2f} % of the result, {:.2f} % of the truth\n",
                      100.0 * error.result_left_out,
                      100.0 * error.truth_left_out);
  text += fmt::format("  {:>8} {:>11} {:>8} {:>8}\n", "tau", "precision", "recall", "F-score");
  for (const ThresholdScore& s : error.scores) {
    text += fmt::format("  {:>6.3g} m {:>9.2f} % {:>6.2f} % {:>6.2f} %\n",
                        s.tau_m,
                        100.0 * s.precision,
                        100.0 * s.recall,
                        100.0 * s.f_score);
  }
  return text;
}

}  // namespace

Json MapEvaluationJson(const MapEvaluationRequest& request, const MapEvaluation& evaluation) {
  Json json = {{"result", SurfaceJson(evaluation.result)},
               {"truth", SurfaceJson(evaluation.truth)},
               {"T_truth_result", MatrixJson(evaluation.T_truth_result)},
               {"alignment", nullptr},
               {"settings", SettingsJson(request)},
               {"paper", ErrorsJson(evaluation.paper)},
               {"strict", nullptr}};
  if (evaluation.alignment) {
    json["alignment"] = {{"matched_poses", evaluation.alignment->matched},
                         {"ate_rmse_m", evaluation.alignment->ate_translation_m.rmse}};
  }
  if (evaluation.strict) {
    json["strict"] = ErrorsJson(*evaluation.strict);
    json["strict"]["returns"] = evaluation.returns;
  }
  return json;
}

std::string MapEvaluationText(const MapEvaluation& evaluation) {
  std::string text = SurfaceLine("result", evaluation.result);
  text += SurfaceLine("truth", evaluation.truth);
  if (evaluation.alignment) {
    text += fmt::format("aligned  by {} poses, ATE RMSE {}\n",
                        evaluation.alignment->matched,
                        FormatMetres(evaluation.alignment->ate_translation_m.rmse));
  }
  text += ErrorTable("paper",
                     "truth cut where the result is far, outliers of the result dropped",
                     evaluation.paper);
  if (evaluation.strict) {
    text += ErrorTable("strict",
                       "truth that the sensor saw, all of the result in observed space",
                       *evaluation.strict);
  } else {
    text += "\nstrict: needs --recording, whose true poses tell what was visible\n";
  }
  for (const auto& path : evaluation.written) text += fmt::format("wrote {}\n", path.string());
  return text;
}

}  // namespace covsplat
