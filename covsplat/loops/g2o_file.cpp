#include "covsplat/loops/g2o_file.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "covsplat/io/output_file.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kPoseNumbers = 7;
constexpr std::size_t kInformationNumbers = 21;

using Words = std::span<const std::string_view>;

// Files have the translation first.
int InFile(int k) { return (k + 3) % 6; }

std::string InformationText(const Matrix6d& information) {
  std::string text;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) text += fmt::format(" {}", information(InFile(r), InFile(c)));
  }
  return text;
}

std::string EdgeText(const PoseEdge& edge) {
  const std::string measured = PoseText(edge.T_from_to) + InformationText(edge.information);
  if (edge.from == kMapNode) return fmt::format("EDGE_SE3_PRIOR {} 0 {}\n", edge.to, measured);
  return fmt::format("EDGE_SE3:QUAT {} {} {}\n", edge.from, edge.to, measured);
}

std::optional<std::vector<double>> Numbers(Words words) {
  std::vector<double> numbers;
  for (const std::string_view word : words) {
    const std::optional<double> number = ParseDouble(word);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<SE3> PoseOf(Words words) {
  const auto numbers = Numbers(words);
  return numbers ? ParsePose(*numbers) : std::nullopt;
}

std::optional<Matrix6d> ParseInformation(Words words) {
  const auto n = Numbers(words);
  if (!n || n->size() != kInformationNumbers) return std::nullopt;
  Matrix6d information;
  std::size_t next = 0;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) {
      information(InFile(r), InFile(c)) = information(InFile(c), InFile(r)) = (*n)[next++];
    }
  }
  return information;
}

/// The lines of a file, by the ids that stand in it.
struct Lines {
  struct Edge {
    std::int64_t line;
    std::optional<std::int64_t> from;  ///< nothing: the map
    std::int64_t to;
    SE3 T_from_to;
    Matrix6d information;
  };
  std::map<std::int64_t, SE3> nodes;
  std::vector<Edge> edges;
};

/// What is wrong with a line, or "".
std::string_view TakeNode(Words words, Lines& lines) {
  if (words.size() != 2 + kPoseNumbers) return "is not a vertex: an id and a pose of 7 numbers";
  const auto id = ParseInteger(words[1]);
  const auto pose = PoseOf(words.subspan(2));
  if (!id || !pose) return "is not a vertex: an id and a pose of 7 numbers";
  if (!lines.nodes.emplace(*id, *pose).second) return "has the id of an earlier vertex";
  return "";
}

std::string_view TakeEdge(Words words, std::int64_t line, Lines& lines) {
  constexpr std::string_view kProblem =
      "is not an edge: two ids, a pose of 7 numbers and the 21 of its information";
  if (words.size() != 3 + kPoseNumbers + kInformationNumbers) return kProblem;
  const auto first = ParseInteger(words[1]);
  const auto second = ParseInteger(words[2]);
  const auto pose = PoseOf(words.subspan(3, kPoseNumbers));
  const auto information = ParseInformation(words.subspan(3 + kPoseNumbers));
  if (!first || !second || !pose || !information) return kProblem;
  if (words[0] == "EDGE_SE3_PRIOR") {  // the second id is that of the sensor's offset
    lines.edges.push_back({line, std::nullopt, *first, *pose, *information});
  } else {
    if (*first == *second) return "ties a vertex to itself";
    lines.edges.push_back({line, *first, *second, *pose, *information});
  }
  return "";
}

std::string_view TakeLine(Words words, std::int64_t number, Lines& lines) {
  const std::string_view kind = words[0];
  if (kind == "VERTEX_SE3:QUAT") return TakeNode(words, lines);
  if (kind == "EDGE_SE3:QUAT" || kind == "EDGE_SE3_PRIOR") return TakeEdge(words, number, lines);
  if (kind == "FIX" || kind.starts_with("PARAMS_")) return "";
  return "is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, EDGE_SE3_PRIOR, FIX";
}

Result<PoseGraph> GraphOf(const Lines& lines, const std::filesystem::path& path) {
  PoseGraph graph;
  std::map<std::int64_t, int> number;
  for (const auto& [id, pose] : lines.nodes) {
    number.emplace(id, static_cast<int>(graph.T_map_node.size()));
    graph.T_map_node.push_back(pose);
  }
  for (const Lines::Edge& edge : lines.edges) {
    const auto to = number.find(edge.to);
    const auto from = edge.from ? number.find(*edge.from) : to;
    if (to == number.end() || from == number.end()) {
      return Fail(ErrorCode::kInput,
                  "{}:{}: ties a vertex that the file does not have",
                  path.string(),
                  edge.line);
    }
    const int first = edge.from ? from->second : kMapNode;
    const bool doubtful = edge.from && std::abs(first - to->second) != 1;
    graph.edges.push_back({first, to->second, edge.T_from_to, edge.information, doubtful});
  }
  return graph;
}

}  // namespace

Result<void> WriteG2o(const std::filesystem::path& path, const PoseGraph& graph) {
  std::string text = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n";
  for (std::size_t i = 0; i < graph.T_map_node.size(); ++i) {
    text += fmt::format("VERTEX_SE3:QUAT {} {}\n", i, PoseText(graph.T_map_node[i]));
  }
  if (!graph.T_map_node.empty()) text += "FIX 0\n";
  for (const PoseEdge& edge : graph.edges) text += EdgeText(edge);
  return WriteFileAtomically(path, text);
}

Result<PoseGraph> ReadG2o(const std::filesystem::path& path) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  Lines lines;
  LineReader reader(*text);
  while (reader.NextWithContent()) {
    const std::vector<std::string_view> words = SplitWords(reader.Line());
    const std::string_view problem = TakeLine(words, reader.Number(), lines);
    if (!problem.empty()) {
      return Fail(ErrorCode::kInput, "{}:{}: {}", path.string(), reader.Number(), problem);
    }
  }
  if (lines.nodes.empty()) return Fail(ErrorCode::kInput, "{}: has no vertex", path.string());
  return GraphOf(lines, path);
}

}  // namespace covsplat
