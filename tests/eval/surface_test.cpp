#include "covsplat/eval/surface.hpp"

#include "tests/eval/meshes.hpp"
#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr const char* kHeader =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n";
constexpr const char* kFaces = "element face 2\nproperty list uchar int vertex_indices\n";
constexpr const char* kSquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

std::string ErrorOf(const Result<Surface>& surface) {
  return surface ? "no error" : surface.error().message;
}

TEST(Surface, AMeshIsReadWithWhatIsWrongWithIt) {
  const TemporaryFolder folder;
  const auto path = folder.Put(
      "m.ply", std::string(kHeader) + kFaces + "end_header\n" + kSquare + "3 0 1 2\n3 0 1 1\n");
  const auto surface = LoadSurface(path);
  ASSERT_TRUE(surface) << surface.error().message;
  EXPECT_TRUE(surface->IsMesh());
  ASSERT_EQ(surface->remarks.size(), 1u);
  EXPECT_NE(surface->remarks[0].find("1 triangles without area"), std::string::npos);
  EXPECT_TRUE(BoundsOf(*surface).max().isApprox(Eigen::Vector3d(1, 1, 0)));
}

TEST(Surface, AFileWithoutFacesIsACloud) {
  const TemporaryFolder folder;
  const auto path = folder.Put("c.ply", std::string(kHeader) + "end_header\n" + kSquare);
  const auto surface = LoadSurface(path);
  ASSERT_TRUE(surface) << surface.error().message;
  EXPECT_FALSE(surface->IsMesh());
  EXPECT_EQ(surface->points.size(), 4u);
  const auto none = folder.Put("no_faces.ply",
                               std::string(kHeader) +
                                   "element face 0\nproperty list uchar int vertex_indices\n"
                                   "end_header\n" +
                                   kSquare);
  ASSERT_TRUE(LoadSurface(none));
  EXPECT_FALSE(LoadSurface(none)->IsMesh());
}

TEST(Surface, WithoutAnySurfaceItIsAnError) {
  const TemporaryFolder folder;
  const auto flat = folder.Put(
      "flat.ply", std::string(kHeader) + kFaces + "end_header\n" + kSquare + "3 0 1 1\n3 2 2 2\n");
  EXPECT_NE(ErrorOf(LoadSurface(flat)).find("none of its 2 triangles has an area"),
            std::string::npos);
  const auto empty = folder.Put("empty.ply",
                                "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
                                "property float y\nproperty float z\nend_header\n");
  EXPECT_NE(ErrorOf(LoadSurface(empty)).find("no finite points"), std::string::npos);
  const auto nan = folder.Put("nan.ply",
                              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                              "property float y\nproperty float z\nend_header\nnan 0 0\n");
  EXPECT_NE(ErrorOf(LoadSurface(nan)).find("no finite points"), std::string::npos);
  EXPECT_NE(ErrorOf(LoadSurface(folder.Put("a.stl", "solid"))).find(".ply"), std::string::npos);
  EXPECT_NE(ErrorOf(LoadSurface(folder.Path() / "gone.ply")).find("gone.ply"), std::string::npos);
}

TEST(Surface, IndicesBeyondTheVerticesAreAnError) {
  const TemporaryFolder folder;
  const auto path = folder.Put(
      "m.ply", std::string(kHeader) + kFaces + "end_header\n" + kSquare + "3 0 1 2\n3 0 1 9\n");
  EXPECT_NE(ErrorOf(LoadSurface(path)).find("no vertex 9"), std::string::npos);
}

TEST(Surface, TooLargeOnesAreRefusedBeforeMemoryRunsOut) {
  ThreadPool pool(1);
  Surface wide, far;
  wide.mesh = test::Plane(0, 0, 15000, 15000, 0);
  EXPECT_NE(PointsOf(wide, {}, {}, pool).error().message.find("--voxel"), std::string::npos);
  far.points = {{0, 0, 0}, {1e7, 0, 0}};
  EXPECT_NE(PointsOf(far, {}, {}, pool).error().message.find("metres"), std::string::npos);
}

Eigen::AlignedBox3d Box(double low, double high) {
  return {Eigen::Vector3d::Constant(low), Eigen::Vector3d::Constant(high)};
}

TEST(Surface, OddSizesAndPlacesAreNoticed) {
  EXPECT_FALSE(OddBounds(Box(0, 10), Box(-5, 40)));
  EXPECT_NE(OddBounds(Box(0, 10), Box(0, 1e4))->find("millimetres"), std::string::npos);
  EXPECT_NE(OddBounds(Box(0, 1e4), Box(0, 10))->find("millimetres"), std::string::npos);
  EXPECT_NE(OddBounds(Box(0, 10), Box(50, 60))->find("--run"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
