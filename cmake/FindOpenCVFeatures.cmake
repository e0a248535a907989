# Debian's libopencv-features2d-dev comes without OpenCV's own package file: finds
# OpenCVFeatures::features2d.
find_path(OpenCVFeatures_INCLUDE_DIR opencv2/features2d.hpp PATH_SUFFIXES opencv4)
find_library(OpenCVFeatures_LIBRARY opencv_features2d)
find_library(OpenCVFeatures_CORE_LIBRARY opencv_core)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVFeatures REQUIRED_VARS
  OpenCVFeatures_LIBRARY OpenCVFeatures_CORE_LIBRARY OpenCVFeatures_INCLUDE_DIR)

if(OpenCVFeatures_FOUND AND NOT TARGET OpenCVFeatures::features2d)
  add_library(OpenCVFeatures::features2d UNKNOWN IMPORTED)
  set_target_properties(OpenCVFeatures::features2d PROPERTIES
    IMPORTED_LOCATION "${OpenCVFeatures_LIBRARY}"
    INTERFACE_LINK_LIBRARIES "${OpenCVFeatures_CORE_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OpenCVFeatures_INCLUDE_DIR}")
endif()
