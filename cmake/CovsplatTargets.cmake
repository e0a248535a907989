# Helpers that every module's CMakeLists.txt uses.

add_library(covsplat_options INTERFACE)
target_include_directories(covsplat_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(covsplat_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wconversion -Wshadow>
  $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall,-Wextra,-Wshadow>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Every 64-bit x86 since 2009; hot kernels dispatch to AVX2 and AVX-512 at run time.
  target_compile_options(covsplat_options INTERFACE -march=x86-64-v2)
endif()
if(COVSPLAT_WERROR)
  target_compile_options(covsplat_options INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-Werror>
    $<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings>)
endif()
if(COVSPLAT_SANITIZE)
  target_compile_options(covsplat_options INTERFACE
    -fsanitize=${COVSPLAT_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(covsplat_options INTERFACE -fsanitize=${COVSPLAT_SANITIZE})
endif()

# covsplat_module(<name> SOURCES ... DEPS ...): the static library covsplat_<name>.
function(covsplat_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_library(covsplat_${name} STATIC ${ARG_SOURCES})
  target_link_libraries(covsplat_${name} PUBLIC covsplat_options ${ARG_DEPS})
endfunction()

# covsplat_simd(<name>): a module with kernels for several instruction sets, of which Highway picks
# one at run time.
function(covsplat_simd name)
  target_link_libraries(covsplat_${name} PUBLIC hwy::hwy)
  # SSE4 (the baseline), AVX2 and AVX-512 on x86; further levels would only lengthen the build.
  target_compile_definitions(covsplat_${name} PRIVATE
    HWY_DISABLE_PCLMUL_AES "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_AVX3_DL)")
  if(COVSPLAT_SANITIZE)
    # One level is enough to find undefined behaviour and races, and sanitised kernels compile
    # slowly.
    target_compile_definitions(covsplat_${name} PRIVATE HWY_COMPILE_ONLY_STATIC)
  endif()
  # Packs of vectors are passed between inlined functions only: their calling convention is moot.
  target_compile_options(covsplat_${name} PRIVATE -Wno-psabi)
endfunction()

# covsplat_test(<name> SOURCES ... DEPS ...): one GoogleTest binary, each test known to CTest.
function(covsplat_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE covsplat_options ${ARG_DEPS} GTest::gtest_main)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60)
endfunction()
