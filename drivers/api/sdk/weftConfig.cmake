# For drivers outside the tree of Weft: find_package(weft), then weft_add_driver(NAME SOURCE...). The SDK consists
# of sources, which are compiled with the compiler and options of the driver.
include(CMakeFindDependencyMacro)
find_dependency(nlohmann_json)
find_path(WEFT_TL_EXPECTED tl/expected.hpp)
if(NOT WEFT_TL_EXPECTED)
  set(weft_FOUND FALSE)
  set(weft_NOT_FOUND_MESSAGE "tl/expected.hpp not found. Install libexpected-dev (Debian)")
  return()
endif()

get_filename_component(WEFT_SDK_ROOT "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET weft::driver_sdk)
  file(GLOB weft_sdk_sources "${WEFT_SDK_ROOT}/share/weft/sdk/*/*/*.cpp")
  add_library(weft_driver_sdk STATIC EXCLUDE_FROM_ALL ${weft_sdk_sources})
  add_library(weft::driver_sdk ALIAS weft_driver_sdk)
  target_include_directories(weft_driver_sdk SYSTEM PUBLIC "${WEFT_SDK_ROOT}/include/weft" "${WEFT_TL_EXPECTED}")
  target_compile_features(weft_driver_sdk PUBLIC cxx_std_20)
  target_link_libraries(weft_driver_sdk PUBLIC nlohmann_json::nlohmann_json)
  set_target_properties(weft_driver_sdk PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden)
endif()

# Builds weft-driver-NAME.so from the sources; it exports only one symbol.
function(weft_add_driver name)
  add_library(weft-driver-${name} MODULE ${ARGN})
  target_link_libraries(weft-driver-${name} PRIVATE weft::driver_sdk)
  set_target_properties(weft-driver-${name} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden)
  target_link_options(weft-driver-${name} PRIVATE -Wl,--exclude-libs,ALL -Wl,-z,defs)
endfunction()
