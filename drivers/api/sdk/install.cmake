# Installs the files needed to build a driver outside this tree: cmake --install BUILD --component sdk --prefix DIR
include(CMakePackageConfigHelpers)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/weftConfigVersion.cmake COMPATIBILITY SameMajorVersion)
foreach(folder drivers/api protocols/base)
  install(DIRECTORY ${folder}/ DESTINATION include/weft/${folder} COMPONENT sdk EXCLUDE_FROM_ALL
          FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h" PATTERN sdk EXCLUDE)
  install(DIRECTORY ${folder}/ DESTINATION share/weft/sdk/${folder} COMPONENT sdk EXCLUDE_FROM_ALL
          FILES_MATCHING PATTERN "*.cpp" PATTERN sdk EXCLUDE)
endforeach()
install(FILES drivers/api/sdk/weftConfig.cmake ${CMAKE_BINARY_DIR}/weftConfigVersion.cmake
        DESTINATION lib/cmake/weft COMPONENT sdk EXCLUDE_FROM_ALL)
