#include "covsplat/mesh/screened_poisson.hpp"

namespace covsplat {

Result<TriangleMesh> ScreenedPoisson(const OrientedPoints&, int, int) {
  return Fail(ErrorCode::kUnavailable,
              "method poisson needs Open3D, which this build is without: run tools/setup.sh "
              "--with-poisson and build again");
}

}  // namespace covsplat
