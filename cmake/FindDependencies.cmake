# Everything comes from the system's packages; README.md names each with its purpose.

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt 9 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(CLI11 2.1 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(tl-expected 1.0 REQUIRED)
find_package(embree 3 REQUIRED)
find_package(assimp 5.2 REQUIRED)
find_package(nanoflann 1.4 REQUIRED)
find_package(OpenCVFeatures REQUIRED)

# Only `mesh --method poisson` needs it.
find_package(Open3D QUIET)

find_package(hwy REQUIRED)
find_package(liblzf REQUIRED)
if(COVSPLAT_TESTS)
  find_package(GTest 1.12 REQUIRED)
  include(GoogleTest)
endif()
if(COVSPLAT_BENCH)
  find_package(benchmark 1.7 REQUIRED)
endif()
