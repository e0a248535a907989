#include "covsplat/loops/g2o_file.hpp"

#include "tests/loops/pose_graph_fixtures.hpp"
#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

using test::Measured;
using test::Odometry;
using test::SquareWay;

TEST(G2oFile, WhatIsWrittenIsReadBackToTheLastDigit) {
  const std::vector<SE3> truth = SquareWay(1);
  Rng rng(1);
  PoseGraph graph = Odometry(truth, rng);
  graph.edges.push_back(Measured(truth, 3, 150, true, rng));
  graph.edges.push_back({kMapNode, 7, truth[7], 2.0 * Matrix6d::Identity()});
  graph.edges[0].information(1, 4) = graph.edges[0].information(4, 1) = 12.5;
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteG2o(folder.Path() / "a.g2o", graph));
  const auto read = ReadG2o(folder.Path() / "a.g2o");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->T_map_node.size(), graph.T_map_node.size());
  for (std::size_t i = 0; i < graph.T_map_node.size(); ++i) {
    EXPECT_EQ(read->T_map_node[i].Translation(), graph.T_map_node[i].Translation());
    EXPECT_LT(read->T_map_node[i].Rotation().angularDistance(graph.T_map_node[i].Rotation()),
              1e-15);
  }
  ASSERT_EQ(read->edges.size(), graph.edges.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    EXPECT_EQ(read->edges[e].from, graph.edges[e].from);
    EXPECT_EQ(read->edges[e].to, graph.edges[e].to);
    EXPECT_EQ(read->edges[e].doubtful, graph.edges[e].doubtful);
    EXPECT_EQ(read->edges[e].information, graph.edges[e].information);
    EXPECT_EQ(read->edges[e].T_from_to.Translation(), graph.edges[e].T_from_to.Translation());
  }
}

TEST(G2oFile, FilesOfOthersHaveAnyIdsAndOrder) {
  const TemporaryFolder folder;
  const auto path = folder.Put("a.g2o",
                               "# made elsewhere\n"
                               "EDGE_SE3:QUAT 40 7 1 2 3 0 0 0 1  "
                               "1 0 0 0 0 0  2 0 0 0 0  3 0 0 0  4 0 0  5 0  6\n"
                               "VERTEX_SE3:QUAT 40 4 5 6 0 0 0 1\n"
                               "VERTEX_SE3:QUAT 7 0 0 0 0 0 1 0\n"
                               "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n"
                               "FIX 7\n");
  const auto graph = ReadG2o(path);
  ASSERT_TRUE(graph) << graph.error().message;
  ASSERT_EQ(graph->T_map_node.size(), 2U);
  EXPECT_EQ(graph->T_map_node[1].Translation(), Eigen::Vector3d(4.0, 5.0, 6.0));
  ASSERT_EQ(graph->edges.size(), 1U);
  EXPECT_EQ(graph->edges[0].from, 1);
  EXPECT_EQ(graph->edges[0].to, 0);
  EXPECT_FALSE(graph->edges[0].doubtful);
  const Vector6d diagonal = graph->edges[0].information.diagonal();
  EXPECT_EQ(diagonal, (Vector6d() << 4.0, 5.0, 6.0, 1.0, 2.0, 3.0).finished());
}

TEST(G2oFile, BadLinesAreNamed) {
  const TemporaryFolder folder;
  const auto problem_of = [&](const std::string& text) {
    const auto graph = ReadG2o(folder.Put("bad.g2o", text));
    return graph ? std::string("none") : graph.error().message;
  };
  const std::string good = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n";
  EXPECT_NE(problem_of("").find("bad.g2o: has no vertex"), std::string::npos);
  EXPECT_NE(problem_of(good + good).find("bad.g2o:2: has the id"), std::string::npos);
  EXPECT_NE(problem_of(good + "VERTEX_SE3:QUAT 1 0 0 0 0 0 0 nan\n").find(":2: is not a vertex"),
            std::string::npos);
  EXPECT_NE(problem_of(good + "EDGE_SE3:QUAT 0 1 0 0 0\n").find(":2: is not an edge"),
            std::string::npos);
  EXPECT_NE(problem_of(good + "VERTEX_SE2 0 0 0 0\n").find(":2: is none of"), std::string::npos);
  const std::string to_nowhere =
      "EDGE_SE3:QUAT 0 5 1 2 3 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  EXPECT_NE(problem_of(good + to_nowhere).find(":2: ties a vertex that the file does not have"),
            std::string::npos);
}

}  // namespace
}  // namespace covsplat
